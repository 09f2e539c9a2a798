#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "isp/base/dark_frame.h"
#include "isp/base/frame.h"
#include "isp/base/image.h"
#include "isp/base/result.h"
#include "isp/pipeline/budget/cost_model.h"
#include "isp/pipeline/finished/display_target.h"
#include "isp/pipeline/noise_reduction.h"
#include "isp/pipeline/plan/look.h"
#include "isp/raw/black_point.h"
#include "isp/raw/kernel/demosaic.h"
#include "isp/raw/measure/saturation_level.h"
#include "isp/render/output_space.h"
#include "isp/render/profile_tables.h"
#include "isp/render/tone.h"
#include "isp/render/white_balance.h"

namespace lowlux::isp {

/// Describes a square of the upright image, before it is cropped or shrunk, around a pixel.
struct PickedArea {
  int x = 0;
  int y = 0;
  int size = 16;  // side [px], 1 or more
};

/// Holds the request for a white balance.
struct WhiteBalanceChoice {
  enum class Mode : std::uint8_t { as_shot, automatic, temperature, preset, gains, picked } mode = Mode::as_shot;
  double cct_k = 0;  // for Mode::temperature, white_min_k..white_max_k
  double tint = 0;   // for Mode::temperature, see white_balance_of_temperature
  WhitePreset preset = WhitePreset::daylight;
  Vector3 gains{1, 1, 1};  // for Mode::gains: factors of R, G, B, above 0
  PickedArea picked;
};

/// Describes how much is done of the steps that the options leave open: row and column noise, the level of noise
/// reduction, dark charge, the change for a display. See step_plan.h.
struct ProcessingGoal {
  bool all = false;  // every step, with Level::high
  /// States the CIEDE2000 that the omitted steps may change, as visible_noise.h measures it. With a budget it may be
  /// absent: then the most accurate plan that fits is wanted, Level::best included.
  std::optional<double> tolerance_delta_e = 0.5;
  std::optional<double> budget_s;         // time for planning and rendering the frame; requires `cost`
  std::shared_ptr<const CostModel> cost;  // speed of this machine; absent: no time is predicted
};

/// Describes a region of the upright image, before it is shrunk: in pixels, or in percent of width and height.
struct PictureCrop {
  double x = 0;
  double y = 0;
  double width = 0;
  double height = 0;
  bool percent = false;
};

/// Lists what becomes of colours of which a channel is saturated.
enum class Highlights : std::uint8_t {
  clip,         // all channels end where the first saturates: they become neutral
  reconstruct,  // see reconstruct_highlights
};

/// Describes how a frame is to be developed.
struct DevelopOptions {
  WhiteBalanceChoice white_balance;
  std::optional<double> exposure_ev;  // absent: automatic
  double exposure_offset_ev = 0;      // added to an automatic exposure
  ToneCurve tone = ToneCurve::standard;
  ToneShape tone_shape;   // shape of the standard curve
  double saturation = 1;  // factor of the distance to the grey of the same luminance, in linear light
  Highlights highlights = Highlights::clip;
  double local_tone = 0;             // 0..1, see LocalTone; for images with the standard curve and without a look
  std::optional<double> sharpen_px;  // blur to sharpen for, see CaptureSharpening; absent: none
  OutputSpace space = OutputSpace::srgb;
  SampleType samples = SampleType::u8;     // f32 is scene-linear: signed, unbounded, without tone
  bool half = false;                       // exact 2x2 binning instead of demosaicing
  std::optional<DemosaicMethod> demosaic;  // absent: chosen by light, noise reduction and budget
  std::optional<PictureCrop> crop;
  std::optional<int> max_size;  // length of the longer side [px], 1 or more; larger images are shrunk in linear light
  BlackRequest black;
  bool estimate_dark = true;  // dark charge that is not known is estimated from the frame itself
  /// States the dark charge [e-] of each site that another frame of the same series shows, scaled to this one: used in
  /// place of an estimate. Estimates of single frames scatter, and one that changes makes frames differ.
  std::optional<PerSite<double>> series_dark_e;
  /// Pixels are saturated from the level on that the frame shows, where that is below white, else at white.
  bool find_saturation = true;
  std::optional<SaturationLevel> series_saturation;  // set: used instead, as another frame of the same series shows it
  bool find_defects = true;                     // search for hot and dead pixels in addition to those the source lists
  std::shared_ptr<const DarkFrame> dark_frame;  // set: subtracted pixel by pixel instead of `black`
  DenoiseChoice denoise;
  LookChoice look;
  /// Holds the tables of the profile in the file; null: none. They are applied to images for viewing:
  /// in spaces that are not linear, without a look of the eye or of a model.
  std::shared_ptr<const ProfileTables> profile_tables;
  std::shared_ptr<const DisplayTarget> display;  // set: sRGB codes are changed for it
  std::optional<ProcessingGoal> effects;         // absent: each option above decides for itself
};

/// Holds the width and height of an image, before orientation if nothing else is stated.
struct PictureSize {
  int width = 0;
  int height = 0;
};
/// Returns the size of the rendered image, before it is cropped or shrunk.
PictureSize picture_size(const RawDn& raw, const DevelopOptions& options);

/// Checks that the options fit together: float samples require a linear space and no tone curve, and XYZ and camera RGB
/// require float samples; a change for a display requires sRGB codes of 8 or 16 bits. Error: invalid_argument.
Result<void> check_options(const DevelopOptions& options);

}  // namespace lowlux::isp
