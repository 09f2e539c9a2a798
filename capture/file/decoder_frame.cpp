#include "capture/file/decoder_frame.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <numeric>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "capture/dng/dng_info.h"
#include "capture/dng/dng_levels.h"
#include "capture/file/pass_on.h"
#include "capture/x_trans/x_trans_frame.h"
#include "isp/base/camera_profile.h"
#include "isp/model/colour/colorimetry.h"

namespace lowlux::capture {
namespace {

/// Returns the colour number 0..3 (3: the second green) of a site of the visible area in dcraw's packed pattern.
int channel_of(std::uint32_t filters, int x, int y) {
  return static_cast<int>(filters >> ((((y << 1) & 14) | (x & 1)) << 1) & 3);
}

/// Returns the phase of a packed pattern: it must be Bayer over all of its eight rows.
std::optional<BayerPhase> phase_of(std::uint32_t filters) {
  for (int p = 0; p < 4; ++p) {
    const auto phase = static_cast<BayerPhase>(p);
    bool same = true;
    for (int i = 0; i < 16; ++i) {
      const int channel = channel_of(filters, i & 1, i >> 1);
      const int colour = channel == 3 ? 1 : channel;
      same = same && colour == static_cast<int>(colour_at(phase, i & 1, i >> 1));
    }
    if (same) return phase;
  }
  return std::nullopt;
}

bool inside(const Rect& r, const DecodedHeader& h) {
  return r.x >= 0 && r.y >= 0 && r.width > 0 && r.height > 0 && r.width <= h.raw_width && r.height <= h.raw_height &&
         r.x <= h.raw_width - r.width && r.y <= h.raw_height - r.height;
}

Result<void> fill_geometry(const DecodedHeader& h, RawDn& raw) {
  raw.active = {h.left, h.top, h.width, h.height};
  if (!inside(raw.active, h)) {
    return fail(ErrorCode::malformed, "the decoder reports a visible area that is not inside the readout");
  }
  raw.default_crop = {0, 0, h.width, h.height};
  for (const auto& mask : h.masks) {
    const auto [top, left, bottom, right] = std::to_array(mask);
    if (top < 0 || left < 0 || bottom > h.raw_height || right > h.raw_width || bottom <= top || right <= left) continue;
    raw.masked.push_back({left, top, right - left, bottom - top});
  }
  raw.masked_is_stated = !raw.masked.empty();
  if (raw.masked.empty()) raw.masked = borders(h.raw_width, h.raw_height, raw.active);
  return {};
}

/// Returns the colour number of a site of the visible area.
int channel_of(const DecodedHeader& h, int x, int y) {
  if (h.filters != x_trans_filters) return channel_of(h.filters, x, y);
  return std::min<int>(h.x_trans[y % x_trans_period * x_trans_period + x % x_trans_period], 3);
}

/// Returns the black level as dcraw and LibRaw sum it: one for all, one for each colour number, and a pattern.
BlackLevel decoder_black(const DecodedHeader& h) {
  const bool has_pattern =
      h.pattern_rows > 0 && h.pattern_columns > 0 &&
      std::int64_t{h.pattern_rows} * h.pattern_columns <= std::int64_t{std::ssize(h.pattern_black)};
  const int rows = has_pattern ? h.pattern_rows : 1, columns = has_pattern ? h.pattern_columns : 1;
  BlackLevel black;
  const int cell = h.filters == 0 ? 1 : h.filters == x_trans_filters ? x_trans_period : 2;
  black.rows = std::lcm(rows, cell);
  black.columns = std::lcm(columns, cell);
  black.samples = h.samples;
  for (int y = 0; y < black.rows; ++y) {
    for (int x = 0; x < black.columns; ++x) {
      for (int s = 0; s < black.samples; ++s) {
        const int channel = h.filters == 0 ? s : channel_of(h, x, y);
        const double pattern = has_pattern ? h.pattern_black[(y % rows) * columns + x % columns] : 0.0;
        black.pattern_dn.push_back(static_cast<double>(h.black) + h.channel_black[channel] + pattern);
      }
    }
  }
  return black;
}

/// Sets the levels. A black of 0 in a file with masked pixels means that the decoder expects it to be measured there.
/// Without them it is kept, because many older cameras clip at 0, with a warning, because the decoder also reports 0 if
/// it does not know.
Result<void> fill_levels(const DecodedHeader& h, RawDn& raw, std::vector<std::string>& warnings) {
  raw.white_dn.fill(h.maximum);
  if (h.maximum < 1 || h.maximum > 65535) {
    return fail(ErrorCode::malformed, "the decoder reports a white level of " + std::to_string(h.maximum));
  }
  BlackLevel black = decoder_black(h);
  const bool all_zero = std::all_of(black.pattern_dn.begin(), black.pattern_dn.end(), [](double b) { return b == 0; });
  if (!(all_zero && raw.masked_is_stated)) raw.black_tag = std::move(black);
  if (all_zero && !raw.masked_is_stated) {
    warnings.emplace_back("the black level of 0 is that of the decoder, which also reports 0 if it is not known");
  }
  return check_levels(raw, "as the decoder reports them");
}

/// Returns the EXIF orientation of dcraw's flip: bit 0 mirrors x, bit 1 mirrors y, bit 2 transposes.
Orientation orientation_of(int flip) {
  constexpr int orientation[] = {1, 2, 4, 3, 5, 8, 6, 7};
  return static_cast<Orientation>(orientation[flip >= 0 && flip <= 7 ? flip : 0]);
}

FrameInfo info_of(const DecodedHeader& h) {
  FrameInfo info;
  info.make = h.make;
  info.model = h.model;
  info.software = h.software;
  info.exposure_s = plausible_exposure_s(h.exposure_s);
  info.iso = plausible_iso(h.iso);
  info.f_number = plausible_f_number(h.f_number);
  info.focal_length_mm = plausible_focal_length_mm(h.focal_length_mm);
  info.temperature_c = decoder_temperature_c(h);
  info.orientation = orientation_of(h.flip);
  std::tm time{};
  const std::time_t seconds = h.timestamp;
  char text[32];
  // The camera's clock has no time zone: the decoder read it as local time, so conversion to local time restores it.
  if (seconds > 0 && localtime_r(&seconds, &time) != nullptr &&
      std::strftime(text, sizeof text, "%Y:%m:%d %H:%M:%S", &time) > 0) {
    info.date_time = plausible_date(text);
  }
  return info;
}

/// Returns the camera RGB of white as it was shot, at most 1; nullopt where the multipliers are not known.
std::optional<Vector3> as_shot_neutral(const DecodedHeader& h) {
  const float* gain = h.camera_multiplier;
  const bool known = std::all_of(gain, gain + 3, [](float g) { return std::isfinite(g) && g > 0; });
  if (!known) return std::nullopt;
  const double least = std::min({gain[0], gain[1], gain[2]});
  return Vector3{least / gain[0], least / gain[1], least / gain[2]};
}

CameraColour colour_of(const DecodedHeader& h) {
  CameraColour colour;
  if (const auto calibration = table_calibration(h)) {
    colour.calibrations.push_back(*calibration);
    colour.source = CameraColour::Source::decoder_table;
  }
  colour.as_shot_neutral = as_shot_neutral(h);
  return colour;
}

/// Returns the matrix of a camera that the decoder knows by one from white-balanced camera RGB to sRGB alone. The white
/// of the shot is taken for D65.
std::optional<Matrix3> matrix_by_srgb(const DecodedHeader& h) {
  Matrix3 to_srgb{};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) to_srgb[i][j] = h.camera_to_srgb[i][j];
  }
  const auto neutral = as_shot_neutral(h);
  const auto from_srgb = inverse(to_srgb), from_xyz = inverse(*isp::rgb_to_xyz(isp::primaries_rec709));
  if (!neutral || !from_srgb) return std::nullopt;
  return diagonal3(*neutral) * *from_srgb * *from_xyz;
}

}  // namespace

std::optional<ColourCalibration> table_calibration(const DecodedHeader& header) {
  ColourCalibration calibration;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) calibration.xyz_to_camera[i][j] = header.xyz_to_camera[i][j];
  }
  if (!inverse(calibration.xyz_to_camera)) {
    const auto matrix = matrix_by_srgb(header);
    if (!matrix || !inverse(*matrix)) return std::nullopt;
    calibration.xyz_to_camera = *matrix;
  }
  calibration.cct_k = 6504;  // the table holds Adobe's matrices for D65, as dcraw's adobe_coeff does
  return calibration;
}

std::optional<double> decoder_temperature_c(const DecodedHeader& header) {
  const auto sensor = plausible_temperature_c(header.sensor_temperature_c);
  return sensor ? sensor : plausible_temperature_c(header.camera_temperature_c);
}

Result<RawFrame> frame_of_decoder(DecodedRaw decoded, const XTransUse& x_trans_use) {
  const DecodedHeader& h = decoded.header;
  const auto x_trans = h.samples == 1 && h.filters == x_trans_filters ? x_trans_phase(h.x_trans) : std::nullopt;
  RawFrame frame;
  if (h.samples == 3) {
    frame.raw.layout = SensorLayout::linear_rgb;
  } else if (h.filters == 0) {
    frame.raw.layout = SensorLayout::monochrome;
  } else if (x_trans) {
    // The samples are a mosaic until they are interpolated below.
  } else if (const auto phase = phase_of(h.filters)) {
    frame.raw.phase = *phase;
  } else {
    return fail(ErrorCode::unsupported, "this mosaic is neither X-Trans nor one of the four Bayer patterns of R, G, B");
  }
  if (auto filled = fill_geometry(h, frame.raw); !filled) return pass_on(filled);
  if (auto filled = fill_levels(h, frame.raw, frame.warnings); !filled) return pass_on(filled);
  frame.raw.info = info_of(h);
  if (frame.raw.layout != SensorLayout::monochrome) frame.colour = colour_of(h);
  if (h.is_guessed_by_size != 0) {
    frame.warnings.push_back("the file has no known header: the camera " +
                             camera_name(frame.raw.info.make, frame.raw.info.model) +
                             " was guessed from the size of the file alone; if it is another, write the samples to a "
                             "DNG that states their size, mosaic and levels");
  }
  if (std::isfinite(h.pixel_aspect) && std::fabs(h.pixel_aspect - 1) > 1e-3) {
    frame.warnings.emplace_back("the pixels are not square: their aspect is not applied");
  }
  frame.raw.dn = std::move(decoded.samples);
  if (x_trans) {
    if (auto used = use_mosaic(frame, *x_trans, x_trans_use); !used) return pass_on(used);
  }
  return frame;
}

}  // namespace lowlux::capture
