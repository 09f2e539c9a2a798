// The program lowlux-decode: see decoder_process.h.
#include <libraw/libraw.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <span>

#include "capture/decoder/decoder_name.h"
#include "capture/decoder/decoder_program.h"

namespace lowlux::capture {
namespace {

constexpr float unknown_temperature_c = -1000.0f;

template <std::size_t n>
void copy_text(char (&out)[n], const char* text) {
  std::snprintf(out, n, "%s", text);
}

void fill_sizes(const libraw_data_t& data, DecodedHeader& h) {
  const libraw_image_sizes_t& sizes = data.sizes;
  h.raw_width = sizes.raw_width;
  h.raw_height = sizes.raw_height;
  h.left = sizes.left_margin;
  h.top = sizes.top_margin;
  h.width = sizes.width;
  h.height = sizes.height;
  h.flip = sizes.flip;
  h.pixel_aspect = sizes.pixel_aspect;
  for (int i = 0; i < 8; ++i) std::copy_n(sizes.mask[i], 4, h.masks[i]);
}

/// Fills the matrix of cameras that LibRaw knows by a matrix to sRGB alone. It is the identity where nothing is known.
void fill_camera_to_srgb(const libraw_colordata_t& colour, DecodedHeader& h) {
  bool is_identity = true, has_table = false;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      is_identity = is_identity && colour.rgb_cam[i][j] == (i == j ? 1 : 0);
      has_table = has_table || colour.cam_xyz[i][j] != 0;
    }
  }
  if (is_identity || has_table) return;
  for (int i = 0; i < 3; ++i) std::copy_n(colour.rgb_cam[i], 3, h.camera_to_srgb[i]);
}

void fill_colour(const libraw_data_t& data, DecodedHeader& h) {
  const libraw_colordata_t& colour = data.color;
  h.filters = data.idata.filters;
  for (int i = 0; i < 36; ++i) h.x_trans[i] = static_cast<std::uint8_t>(data.idata.xtrans[i / 6][i % 6]);
  h.black = colour.black;
  std::copy_n(colour.cblack, 4, h.channel_black);
  h.pattern_rows = static_cast<std::int32_t>(std::min(colour.cblack[4], 4098U));
  h.pattern_columns = static_cast<std::int32_t>(std::min(colour.cblack[5], 4098U));
  std::copy_n(colour.cblack + 6, std::size(h.pattern_black), h.pattern_black);
  h.maximum = colour.maximum;
  std::copy_n(colour.cam_mul, 4, h.camera_multiplier);
  for (int i = 0; i < 3; ++i) std::copy_n(colour.cam_xyz[i], 3, h.xyz_to_camera[i]);
  fill_camera_to_srgb(colour, h);
}

void fill_shot(const libraw_data_t& data, DecodedHeader& h) {
  h.dng_version = data.idata.dng_version;
  h.iso = data.other.iso_speed;
  h.exposure_s = data.other.shutter;
  h.f_number = data.other.aperture;
  h.focal_length_mm = data.other.focal_len;
  h.timestamp = data.other.timestamp;
  h.sensor_temperature_c = data.makernotes.common.SensorTemperature;
  h.camera_temperature_c = data.makernotes.common.CameraTemperature;
  copy_text(h.make, data.idata.make);
  copy_text(h.model, data.idata.model);
  copy_text(h.software, data.idata.software);
}

/// Sets how files are unpacked: by LibRaw itself and without its options, of which only the conversion of
/// floating-point samples to integers would have an effect here. LibRaw 0.21 has these fields in rawparams, older
/// versions in params.
template <typename Data>
void set_unpacking(Data& data, const ReadLimits& limits) {
  const auto set = [&limits](auto& parameters, unsigned& options) {
    parameters.use_rawspeed = 0;
    parameters.use_dngsdk = 0;
    parameters.max_raw_memory_mb = static_cast<unsigned>((limits.max_pixels * 8 >> 20) + 1);
    options = 0;
  };
  if constexpr (requires { data.rawparams; }) {
    set(data.rawparams, data.rawparams.options);
  } else {
    set(data.params, data.params.raw_processing_options);
  }
}

/// Returns whether the camera is that of any file of this size: LibRaw knows files without a header by a table of
/// sizes, and does not report that it used it. Zeros, which have no header, are then recognised as the same camera.
bool is_guessed_by_size(const libraw_data_t& data, std::size_t file_bytes, const ReadLimits& limits) {
  if (data.idata.dng_version != 0) return false;
  const std::unique_ptr<void, decltype(&std::free)> zeros(std::calloc(file_bytes, 1), &std::free);
  if (!zeros) return false;
  const auto other = std::make_unique<LibRaw>(LIBRAW_OPIONS_NO_DATAERR_CALLBACK);
  set_unpacking(other->imgdata, limits);
  return other->open_buffer(zeros.get(), file_bytes) == LIBRAW_SUCCESS &&
         std::strcmp(other->imgdata.idata.make, data.idata.make) == 0 &&
         std::strcmp(other->imgdata.idata.model, data.idata.model) == 0;
}

/// Returns a description of a property that lowlux does not develop; nullptr if there is none. Needs open, not unpack.
const char* unsupported_kind(LibRaw& libraw) {
  const libraw_iparams_t& id = libraw.imgdata.idata;
  if (id.is_foveon != 0) return "Foveon (three-layer) sensors are not supported";
  if (libraw.is_floating_point() != 0) return "floating-point raws are not supported: convert to an integer DNG";
  if (id.filters != 0 && id.filters != x_trans_filters && id.filters < 1000)
    return "this mosaic is not supported: only Bayer and X-Trans mosaics and monochrome are";
  if (libraw.is_fuji_rotated() != 0) return "rotated (Super CCD) mosaics are not supported";
  if (libraw.is_sraw() != 0) return "reduced (sRAW, YCbCr) raws are not supported: set the camera to full raws";
  if (id.colors != 1 && id.colors != 3) return "sensors with two or four colours are not supported";
  if (id.filters != 0 && std::strncmp(id.cdesc, "RGB", 3) != 0)
    return "mosaics of colours other than R, G, B are not supported";
  return nullptr;
}

/// Sets the outcome of a LibRaw error code.
void fill_failure(int error, const char* step, DecodedHeader& h) {
  const char* text = libraw_strerror(error);
  switch (error) {
    case LIBRAW_FILE_UNSUPPORTED:
    case LIBRAW_REQUEST_FOR_NONEXISTENT_IMAGE:
    case LIBRAW_NOT_IMPLEMENTED:
      h.outcome = DecodeOutcome::not_raw;
      break;
    case LIBRAW_UNSUFFICIENT_MEMORY:
    case LIBRAW_MEMPOOL_OVERFLOW:
      h.outcome = DecodeOutcome::out_of_memory;
      break;
    case LIBRAW_TOO_BIG:
      h.outcome = DecodeOutcome::too_large;
      break;
    default:
      h.outcome = DecodeOutcome::damaged;
  }
  std::snprintf(h.reason, sizeof h.reason, "%s cannot %s this file: %s", decoder_name().c_str(), step, text);
}

/// Writes the rows of a three-sample image, which LibRaw stores with four samples for each pixel.
bool write_rgb(const libraw_data_t& data, DecodeSink& sink) {
  const std::size_t width = data.sizes.raw_width;
  const auto row = std::make_unique<std::uint16_t[]>(width * 3);
  for (std::size_t y = 0; y < data.sizes.raw_height; ++y) {
    const auto* pixel = data.rawdata.color4_image + y * width;
    for (std::size_t x = 0; x < width; ++x) std::copy_n(pixel[x], 3, row.get() + 3 * x);
    if (!sink.write_samples(row.get(), width * 3)) return false;
  }
  return true;
}

bool write_mosaic(const libraw_data_t& data, DecodeSink& sink) {
  const std::size_t width = data.sizes.raw_width;
  const std::size_t pitch = data.sizes.raw_pitch != 0 ? data.sizes.raw_pitch / sizeof(std::uint16_t) : width;
  if (pitch == width) return sink.write_samples(data.rawdata.raw_image, width * data.sizes.raw_height);
  for (std::size_t y = 0; y < data.sizes.raw_height; ++y) {
    if (!sink.write_samples(data.rawdata.raw_image + y * pitch, width)) return false;
  }
  return true;
}

void unpack(LibRaw& libraw, DecodedHeader& h, DecodeSink& sink) {
  const int error = libraw.unpack();
  if (error != LIBRAW_SUCCESS) return fill_failure(error, "decode", h);
  const libraw_data_t& data = libraw.imgdata;
  h.outcome = DecodeOutcome::damaged;
  if (libraw.error_count() > 0) {
    std::snprintf(h.reason, sizeof h.reason, "the image data is damaged or truncated (%s met %d faults in it)",
                  decoder_name().c_str(), libraw.error_count());
    return;
  }
  h.outcome = DecodeOutcome::unsupported;
  if (data.rawdata.ph1_cblack != nullptr || data.rawdata.ph1_rblack != nullptr) {
    return copy_text(h.reason, "Phase One files with their own black calibration are not supported");
  }
  fill_sizes(data, h);
  fill_colour(data, h);
  bool written = false;
  if (data.rawdata.raw_image != nullptr) {
    h.samples = 1;
    written = write_mosaic(data, sink);
  } else if (data.rawdata.color4_image != nullptr && data.idata.filters == 0 && data.idata.colors == 3) {
    h.samples = 3;
    written = write_rgb(data, sink);
  } else {
    return copy_text(h.reason, "the samples of this file are neither a mosaic nor three colours");
  }
  h.outcome = written ? DecodeOutcome::decoded : DecodeOutcome::out_of_memory;
}

/// Decodes the mosaic of a raw file with LibRaw: unpacking only, without its processing.
void decode_with_libraw(std::span<const std::byte> file, const ReadLimits& limits, DecodeSink& sink) {
  auto header = std::make_unique<DecodedHeader>();
  DecodedHeader& h = *header;
  h = {};
  h.sensor_temperature_c = h.camera_temperature_c = unknown_temperature_c;
  auto libraw = std::make_unique<LibRaw>(LIBRAW_OPIONS_NO_DATAERR_CALLBACK);
  set_unpacking(libraw->imgdata, limits);
  const int error = libraw->open_buffer(const_cast<std::byte*>(file.data()), file.size());
  if (error != LIBRAW_SUCCESS) {
    fill_failure(error, "open", h);
    return sink.finish(h);
  }
  fill_sizes(libraw->imgdata, h);
  fill_shot(libraw->imgdata, h);
  h.is_guessed_by_size = is_guessed_by_size(libraw->imgdata, file.size(), limits) ? 1 : 0;
  if (const char* kind = unsupported_kind(*libraw)) {
    h.outcome = DecodeOutcome::unsupported;
    copy_text(h.reason, kind);
  } else if (std::int64_t{h.raw_width} * h.raw_height > limits.max_pixels) {
    h.outcome = DecodeOutcome::too_large;
  } else {
    unpack(*libraw, h, sink);
  }
  sink.finish(h);
}

}  // namespace
}  // namespace lowlux::capture

int main(int count, char** arguments) {
  lowlux::capture::run_decoder(std::span(arguments, static_cast<std::size_t>(count)),
                               lowlux::capture::decode_with_libraw);
}
