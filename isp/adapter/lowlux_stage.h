/* lowlux as a stage of a camera pipeline: raw frames in, images or denoised raw frames out.
 *
 * A C interface without types of libcamera or V4L2, to be linked or loaded by name (dlopen of liblowlux_stage.so.0, or
 * dlsym of each function). It guarantees:
 *   - No exception leaves it. lowlux_stage_process allocates nothing, takes no lock while it works on pixels, and
 *     starts no threads; lowlux_stage_configure allocates all memory.
 *   - Calls on one stage must come from one thread at a time; stages are independent of one another.
 *   - The bytes of a result do not depend on the number of threads, except for the times in it and the effects of a
 *     budget.
 *   - Input rows are read once, from first to last: they may lie in uncached memory.
 *   - Structs begin with their size, which the caller sets, except for the small ones that never change: source, plane
 *     and rect. Within one version structs grow at their end: callers with a later or an earlier header are supported;
 *     members that one of the two does not know are left out. A frame with unknown bits of `valid` is an error.
 * Functions return LOWLUX_STAGE_OK, LOWLUX_STAGE_ADJUSTED, or an error below 0; lowlux_stage_last_error gives details.
 * After an error in lowlux_stage_process the output planes are not touched or hold part of an image; the stage remains
 * usable.
 */
#ifndef LOWLUX_STAGE_H
#define LOWLUX_STAGE_H

/* NOLINTBEGIN(modernize-use-using,modernize-deprecated-headers): C */
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define LOWLUX_STAGE_VERSION 1

#if defined(__GNUC__)
#define LOWLUX_STAGE_EXPORT __attribute__((visibility("default")))
#else
#define LOWLUX_STAGE_EXPORT
#endif

typedef struct lowlux_stage lowlux_stage;

enum {
  LOWLUX_STAGE_OK = 0,
  LOWLUX_STAGE_ADJUSTED = 1,      /* configured, but not as requested: read the formats again */
  LOWLUX_STAGE_BAD_ARGUMENT = -1, /* a null pointer, an invalid struct size, a value out of range */
  LOWLUX_STAGE_UNSUPPORTED = -2,  /* the format is not supported, or not this output for this input */
  LOWLUX_STAGE_TOO_LARGE = -3,    /* the stage would need more memory than the limit */
  LOWLUX_STAGE_NO_MEMORY = -4,
  LOWLUX_STAGE_NOT_CONFIGURED = -5,
  LOWLUX_STAGE_SHORT_BUFFER = -6, /* a plane ends before the image does */
  LOWLUX_STAGE_BAD_STRIDE = -7,   /* rows would overlap */
  LOWLUX_STAGE_MISSING_PLANE = -8,
  LOWLUX_STAGE_BAD_PARAMETER = -9,  /* a value is not a number, or out of range */
  LOWLUX_STAGE_BAD_PROFILE = -10,   /* the profile cannot be read, or does not apply to these frames */
  LOWLUX_STAGE_UNKNOWN_LIGHT = -11, /* the look of the eye needs the luminance of the scene */
  LOWLUX_STAGE_INTERNAL = -12
};

/* Meaning of a four-character code. */
enum { LOWLUX_STAGE_DRM = 0 /* and libcamera, with its modifier */, LOWLUX_STAGE_V4L2 = 1 };

/* Outputs, by their DRM codes, with the order of bytes in memory: */
#define LOWLUX_STAGE_FOURCC(a, b, c, d) \
  ((uint32_t)(a) | ((uint32_t)(b) << 8) | ((uint32_t)(c) << 16) | ((uint32_t)(d) << 24))
#define LOWLUX_STAGE_XBGR8888 LOWLUX_STAGE_FOURCC('X', 'B', '2', '4') /* R G B 255 */
#define LOWLUX_STAGE_XRGB8888 LOWLUX_STAGE_FOURCC('X', 'R', '2', '4') /* B G R 255 */
#define LOWLUX_STAGE_BGR888 LOWLUX_STAGE_FOURCC('B', 'G', '2', '4')   /* R G B */
#define LOWLUX_STAGE_RGB888 LOWLUX_STAGE_FOURCC('R', 'G', '2', '4')   /* B G R */
#define LOWLUX_STAGE_NV12 LOWLUX_STAGE_FOURCC('N', 'V', '1', '2')     /* plane 0: Y; plane 1: Cb Cr of 2x2 pixels */
#define LOWLUX_STAGE_RGB48 LOWLUX_STAGE_FOURCC('B', 'G', '4', '8')    /* R G B of 16 bits, little endian */
/* The denoised mosaic in 16 bits, little endian, with its phase at the image's own corner. Codes of the input are
 * scaled to the high end of 16 bits: black is at the input's black times 2^(16 - bits). */
#define LOWLUX_STAGE_BAYER16 LOWLUX_STAGE_FOURCC('B', 'Y', '1', '6')

enum { LOWLUX_STAGE_MAX_PLANES = 3 };

typedef struct {
  int32_t x, y, width, height;
} lowlux_stage_rect;

/* Describes the input frames. */
typedef struct {
  size_t size;
  int32_t api; /* LOWLUX_STAGE_DRM or LOWLUX_STAGE_V4L2 */
  uint32_t fourcc;
  uint64_t modifier;        /* modifier of a DRM code; 0 for V4L2 */
  int32_t width;            /* width of full frames, 2..65536 */
  int32_t height;           /* height of full frames, 2..65536 */
  size_t stride;            /* smallest number of bytes from one row to the next; each frame states its own */
  lowlux_stage_rect crop;   /* region that becomes the image; all 0: the full frame */
  lowlux_stage_rect masked; /* light-shielded pixels; all 0: none */
  double white_level;       /* code at which a pixel is saturated, 0.001 to 65535; 0: the largest of the format */
} lowlux_stage_input;

/* Describes the output images. Width and height are those of the crop. */
typedef struct {
  size_t size;
  uint32_t fourcc; /* one of those above */
  int32_t width;
  int32_t height;
  int32_t planes;                         /* set by lowlux_stage_configure */
  size_t stride[LOWLUX_STAGE_MAX_PLANES]; /* in bytes: minimum, or as requested */
  size_t bytes[LOWLUX_STAGE_MAX_PLANES];  /* size of each plane at that stride */
  int32_t yuv_matrix; /* for NV12: 601 or 709; 0: 709 from 720 rows on, 601 below. Video range, central chroma */
} lowlux_stage_output;

/* Describes a raw format. */
typedef struct {
  size_t size;
  int32_t bits;
  int32_t packed;
  int32_t mosaic; /* 0 RGGB, 1 GRBG, 2 GBRG, 3 BGGR, -1 monochrome */
  int32_t group_pixels;
  int32_t group_bytes;
  int32_t alignment; /* required alignment of the buffer in bytes: 1 */
  int32_t margin;    /* pixels lost at each edge: 0 */
  int32_t outputs;   /* number of entries used in output */
  uint32_t output[8];
} lowlux_stage_format_info;

enum {
  LOWLUX_STAGE_DENOISE_OFF = 0,
  LOWLUX_STAGE_DENOISE_FAST = 1,         /* draft */
  LOWLUX_STAGE_DENOISE_HIGH_QUALITY = 2, /* standard, or high where it is the settings' maximum */
  LOWLUX_STAGE_DENOISE_MINIMAL = 3,      /* previous frames alone, if temporal is set; else draft */
  LOWLUX_STAGE_DENOISE_AUTO = 5          /* by the signal-to-noise ratio of the frame */
};
enum { LOWLUX_STAGE_LOOK_CAMERA = 0, LOWLUX_STAGE_LOOK_EYE = 1 };
enum {
  LOWLUX_STAGE_LEVEL_NONE = 0,
  LOWLUX_STAGE_LEVEL_DRAFT = 1,
  LOWLUX_STAGE_LEVEL_STANDARD = 2,
  LOWLUX_STAGE_LEVEL_HIGH = 3
};

/* The most expensive method by which missing colours may be interpolated. Frames for which it is not possible, or not
 * known to be better, use a cheaper one: isp/adapter/README.md. */
enum {
  LOWLUX_STAGE_DEMOSAIC_DEFAULT = 0, /* ENCODED_MALVAR */
  LOWLUX_STAGE_DEMOSAIC_MALVAR = 1,
  LOWLUX_STAGE_DEMOSAIC_ENCODED_MALVAR = 2,
  LOWLUX_STAGE_DEMOSAIC_RESIDUAL = 3,
  LOWLUX_STAGE_DEMOSAIC_RESIDUAL_MEDIAN = 4
};

/* Settings that apply from lowlux_stage_open to lowlux_stage_release. */
typedef struct {
  size_t size;
  int32_t threads;          /* 1..8, including the caller's; 0: 2 */
  uint64_t memory_limit;    /* bytes; 0: 1 GiB */
  const char* profile_file; /* JSON of `lowlux calibrate`; its hot pixels are positions in full frames; null: none */
  int32_t most_denoise;     /* highest LOWLUX_STAGE_LEVEL_... that memory is allocated for; 0: no level. Bayer only */
  int32_t temporal;         /* 1: average with previous frames, motion compensated; 0: do not. Bayer only */
  int32_t look;             /* LOWLUX_STAGE_LOOK_... */
  int32_t tone;             /* 1: the standard curve; 0: none, linear light in sRGB's encoding */
  double field_of_view_deg; /* field of view of the image's longer side; 0: 50 */
  int32_t demosaic;         /* LOWLUX_STAGE_DEMOSAIC_... */
} lowlux_stage_settings;

/* Bits for the members of lowlux_stage_params: which of them are valid, and which took effect. */
enum {
  LOWLUX_STAGE_HAS_BLACK = 1 << 0,
  LOWLUX_STAGE_HAS_EXPOSURE = 1 << 1,
  LOWLUX_STAGE_HAS_ANALOGUE_GAIN = 1 << 2,
  LOWLUX_STAGE_HAS_DIGITAL_GAIN = 1 << 3,
  LOWLUX_STAGE_HAS_COLOUR_GAINS = 1 << 4,
  LOWLUX_STAGE_HAS_COLOUR_MATRIX = 1 << 5,
  LOWLUX_STAGE_HAS_LUX = 1 << 6,
  LOWLUX_STAGE_HAS_TEMPERATURE = 1 << 7,
  LOWLUX_STAGE_HAS_DENOISE = 1 << 8,
  LOWLUX_STAGE_HAS_SEQUENCE = 1 << 9,
  LOWLUX_STAGE_HAS_TIMESTAMP = 1 << 10,
  LOWLUX_STAGE_HAS_GAMMA = 1 << 11,
  LOWLUX_STAGE_HAS_CONTRAST = 1 << 12,
  LOWLUX_STAGE_HAS_SATURATION = 1 << 13,
  LOWLUX_STAGE_HAS_SHARPNESS = 1 << 14,
  LOWLUX_STAGE_HAS_EXPOSURE_VALUE = 1 << 15,
  LOWLUX_STAGE_HAS_NOISE = 1 << 16,
  LOWLUX_STAGE_HAS_F_NUMBER = 1 << 17,
  LOWLUX_STAGE_HAS_SCENE_LUMINANCE = 1 << 18,
  LOWLUX_STAGE_HAS_BUDGET = 1 << 19,
  LOWLUX_STAGE_HAS_EXPOSURE_LIMITS = 1 << 20,
  LOWLUX_STAGE_HAS_ALL = (1 << 21) - 1
};

/* What is known of one frame, as it was exposed; not values of the frame before it. A value that is not valid is taken
 * from the profile, else measured on the frame, else left out. */
typedef struct {
  size_t size;
  uint32_t valid; /* LOWLUX_STAGE_HAS_... */
  /* R, Gr, Gb, B, in codes of the input, 0..65535; a 16-bit value v of libcamera is v 2^bits / 65536 */
  float black_level[4];
  double exposure_s;      /* 1e-7..1e5 */
  float analogue_gain;    /* 0.1..1e4; 1 is ISO 100 of the profile. Not valid: the profile's only setting, else 1 */
  float digital_gain;     /* already applied to the codes, 0.1..1e3; noise scales with it */
  float colour_gains[2];  /* R and B, relative to G = 1; 1e-3..1e3. Only ratios count: the smallest of the three is 1 */
  float colour_matrix[9]; /* rows; white-balanced camera RGB to linear sRGB; each within 1e3 */
  float lux;              /* illuminance of the scene, 0 (not known)..1e9, if nothing states the luminance better */
  float temperature_c;    /* temperature of the sensor, -100..200 */
  int32_t denoise;        /* LOWLUX_STAGE_DENOISE_...; libcamera's ZSL (4) counts as MINIMAL */
  uint32_t sequence;      /* a gap or a step back discards the previous frames */
  uint64_t timestamp_ns;  /* a step back, or one above both 2 s and three exposures, discards the previous frames */
  float gamma;            /* 0..100; accepted, without effect: the stage has its own curve */
  float contrast;         /* 0..100; accepted, without effect */
  float saturation;       /* 0..4 */
  float sharpness;        /* 0..100; accepted, without effect */
  float exposure_ev;      /* gain 2^EV of the image, -10..20; if not valid: automatic */
  float noise_gain;       /* DN per electron, at this frame's gain, 1e-6..65535; requires noise_read */
  float noise_read; /* standard deviation of a pixel without light, before it is rounded to a code [DN], 0..65535 */
  float f_number;   /* 0.1..1000 */
  double scene_luminance_cd_m2; /* mean luminance over the image, 1e-7..1e9 */
  float budget_ms;              /* time limit for this frame, 0.01..1e6; steps that do not fit are left out */
  float max_exposure_s;         /* limits of the exposure that the result advises, 1e-7..1e5: motion blur, frame rate */
  float min_exposure_s;         /* 0..max_exposure_s */
  float max_gain;               /* 1..1e4; 0: no limit */
  float clipped_fraction;       /* upper limit of clipped pixels in the fullest channel, 1e-9..0.5; 0: 0.001 */
  int32_t mains_hz; /* mains whose flicker exposures average out: 50, 60, LOWLUX_STAGE_MAINS_EITHER; 0: none */
} lowlux_stage_params;

enum { LOWLUX_STAGE_MAINS_EITHER = -1 };

/* What limits the advised exposure. */
enum {
  LOWLUX_STAGE_LIMIT_NONE = 0,
  LOWLUX_STAGE_LIMIT_TIME = 1,     /* max_exposure_s */
  LOWLUX_STAGE_LIMIT_CODES = 2,    /* the highlight reaches the largest code at this gain */
  LOWLUX_STAGE_LIMIT_FULL_WELL = 3 /* the highlight fills the pixels, at any gain */
};

/* Steps to which a budget reduces the work on a frame. No frame is ever dropped, and look and output are never changed:
 * a budget that even the last step exceeds gives that step, and took_ms reports it. Steps that are no less than the
 * frame's work without a budget are skipped. Times are those of previous frames: the first frame after
 * lowlux_stage_configure, for which none are known, is processed at the last step. A better step is chosen when it is
 * expected to leave a tenth of its time spare, and abandoned for one that fits when frames take longer. A step that did
 * not fit is tried again from time to time, sooner if it nearly fitted: isp/adapter/README.md. lowlux_stage_reset
 * keeps the measured times. */
enum {
  LOWLUX_STAGE_STEP_ALL = 0,           /* everything requested */
  LOWLUX_STAGE_STEP_STANDARD = 1,      /* the level standard in place of high */
  LOWLUX_STAGE_STEP_DRAFT = 2,         /* the level draft in place of a higher one; demosaicing by linear filters */
  LOWLUX_STAGE_STEP_FRAMES_BEFORE = 3, /* no level; previous frames only, if the settings enable them */
  LOWLUX_STAGE_STEP_PLAIN = 4          /* straight from codes, without noise reduction */
};

typedef struct {
  const void* data;
  size_t length; /* bytes available */
  size_t stride;
  int fd; /* a dma-buf, whose accesses are bracketed by DMA_BUF_IOCTL_SYNC; -1: none */
} lowlux_stage_source;

typedef struct {
  void* data;
  size_t length;
  size_t stride;
} lowlux_stage_plane;

typedef struct {
  size_t size;
  int32_t planes; /* number of planes used */
  lowlux_stage_plane plane[LOWLUX_STAGE_MAX_PLANES];
} lowlux_stage_picture;

enum {
  LOWLUX_STAGE_FROM_NOTHING = 0,
  LOWLUX_STAGE_FROM_PARAMS = 1,
  LOWLUX_STAGE_FROM_PROFILE = 2,
  LOWLUX_STAGE_FROM_MASKED = 3,
  LOWLUX_STAGE_FROM_FRAME = 4
};

/* Reports the processing of the frame. */
typedef struct {
  size_t size;
  uint32_t applied;     /* LOWLUX_STAGE_HAS_... that took effect, as far as look and output use them */
  int32_t black_from;   /* source of the black level, LOWLUX_STAGE_FROM_... */
  int32_t noise_from;   /* source of the noise model */
  int32_t white_from;   /* source of the white balance */
  float black_level[4]; /* R, Gr, Gb, B that was subtracted, including dark charge */
  float noise_gain;     /* DN per electron; 0: not known */
  float noise_read;     /* standard deviation of a pixel without light, rounded to a code [DN] */
  float colour_gains[2];
  float exposure_ev;
  int32_t level;               /* LOWLUX_STAGE_LEVEL_... of noise reduction */
  int32_t temporal;            /* 1: previous frames contributed */
  float moved;                 /* fraction of the image without previous frames, because its motion was not found */
  float scene_luminance_cd_m2; /* 0: not known */
  float adaptation;            /* m of CIE 191, 0 scotopic to 1 photopic; 1 without the look of the eye */
  int32_t step;                /* LOWLUX_STAGE_STEP_...; without a budget 0 */
  float predicted_ms;          /* expected time of the steps done; 0: not known yet */
  float took_ms;               /* time of the frame, from the first read of its rows to the last row of its image */
  /* Exposure advised for the next frames, with the best predicted signal-to-noise ratio under the limits of the
   * parameters; all 0 where limits, exposure time or analogue gain are not valid. A caller that sets it, and states
   * what each frame really had, has automatic exposure: the advice does not change while the light does not. */
  float advised_exposure_s;
  float advised_gain;    /* analogue gain, times the digital gain if that is valid */
  float advised_snr_db;  /* predicted for the mid tone, 10 log10 of the ratio of powers */
  int32_t advised_limit; /* LOWLUX_STAGE_LIMIT_... */
} lowlux_stage_result;

/* Statistics of the input frame, before subtraction and noise reduction: for the next exposure and white balance. */
typedef struct {
  size_t size;
  uint64_t sum[3]; /* sum of the codes of R, G, B */
  uint64_t count[3];
  float clipped;                 /* fraction of the pixels at white or above */
  float zero;                    /* fraction at code 0 */
  uint32_t luma[1024];           /* histogram of 2x2 cells in every second row of cells, by
                                    (77 R + 75 Gr + 75 Gb + 29 B) / 256, even bins over all codes */
  uint32_t luma64[64];           /* luma in 64 bins, as in libcamera's SwIspStats */
  float measured_black[4];       /* R, Gr, Gb, B: on masked pixels, else on the darkest hundredth of the image */
  int32_t measured_black_masked; /* 1: measured on masked pixels */
  float measured_noise_gain;     /* DN per electron, measured on this frame; 0: not measurable */
  float measured_noise_read;     /* standard deviation of a pixel without light, rounded [DN]; 0: not measurable */
} lowlux_stage_statistics;

LOWLUX_STAGE_EXPORT uint32_t lowlux_stage_version(void);

/* Describes an input format and the outputs possible for it. Needs no stage. */
LOWLUX_STAGE_EXPORT int lowlux_stage_query(int32_t api, uint32_t fourcc, uint64_t modifier,
                                           lowlux_stage_format_info* info);

/* Opens a stage. settings may be null: levels up to draft, the standard tone curve, 0 for all others. *stage is null
 * after an error. message, if not null, gets the reason. */
LOWLUX_STAGE_EXPORT int lowlux_stage_open(const lowlux_stage_settings* settings, lowlux_stage** stage, char* message,
                                          size_t message_size);

/* Allocates all memory. out->fourcc is the request, the rest is filled in; an out->stride of 0 is filled in, one that
 * is too small is adjusted. A configured stage that fails becomes unconfigured, except if a struct is missing or has
 * an invalid size: then nothing changes. */
LOWLUX_STAGE_EXPORT int lowlux_stage_configure(lowlux_stage* stage, const lowlux_stage_input* in,
                                               lowlux_stage_output* out);

/* Processes one frame. params, result and statistics may be null. */
LOWLUX_STAGE_EXPORT int lowlux_stage_process(lowlux_stage* stage, const lowlux_stage_source* in,
                                             const lowlux_stage_picture* out, const lowlux_stage_params* params,
                                             lowlux_stage_result* result, lowlux_stage_statistics* statistics);

/* Discards the previous frames. Call it at the start of a stream or a change of mode. */
LOWLUX_STAGE_EXPORT int lowlux_stage_reset(lowlux_stage* stage);

/* Ends threads and frees memory; null is allowed. */
LOWLUX_STAGE_EXPORT void lowlux_stage_release(lowlux_stage* stage);

/* Returns the message of the last call on this stage that failed; one line. Valid until the next call. */
LOWLUX_STAGE_EXPORT const char* lowlux_stage_last_error(const lowlux_stage* stage);

/* NOLINTEND(modernize-use-using,modernize-deprecated-headers) */
#ifdef __cplusplus
}
#endif
#endif
