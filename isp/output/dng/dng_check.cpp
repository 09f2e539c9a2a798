#include "isp/output/dng/dng_check.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "isp/base/float_samples.h"
#include "isp/base/text.h"

namespace lowlux::isp {
namespace {

constexpr double max_level_dn = 65535;
constexpr double max_float_level_dn = 4294967295.0;  // WhiteLevel is an integer of up to 32 bits
constexpr std::size_t max_values = 65535;            // libtiff counts the values of these tags in 16 bits
constexpr double largest_coefficient =
    1000;  // largest value of a matrix or gain: larger ones are implausible, and rationals are too coarse
constexpr double smallest_coefficient = 1e-9;  // rationals hold 4.7e-10 as the least, and libtiff rounds below to 0
constexpr double smallest_gain = 1e-4;

tl::unexpected<Error> cannot(const char* tag, const std::string& why) {
  return fail(ErrorCode::invalid_argument, std::string("a DNG cannot store this ") + tag + ": " + why);
}

std::string text_of(const Rect& r) {
  return std::to_string(r.width) + " x " + std::to_string(r.height) + " pixels at (" + std::to_string(r.x) + ", " +
         std::to_string(r.y) + ")";
}

bool inside(const Rect& r, std::int64_t width, std::int64_t height) {
  return r.x >= 0 && r.y >= 0 && r.width > 0 && r.height > 0 && std::int64_t{r.x} + r.width <= width &&
         std::int64_t{r.y} + r.height <= height;
}

bool within(double number, double low, double high) { return number >= low && number <= high; }

bool all_within(const std::vector<double>& numbers, double low, double high) {
  return std::all_of(numbers.begin(), numbers.end(), [&](double n) { return within(n, low, high); });
}

double largest(const std::vector<double>& values) {
  return values.empty() ? 0.0 : *std::max_element(values.begin(), values.end());
}

Result<void> check_geometry(const RawDn& raw) {
  const int samples = samples_of(raw.layout);
  if (raw.samples() == 0 || raw.row_samples() % samples != 0) {
    return cannot("image", std::to_string(raw.row_samples()) + " x " + std::to_string(raw.rows()) +
                               " samples do not fill whole pixels of " + std::to_string(samples) + " samples");
  }
  if (raw.is_float() && !raw.dn.empty()) return cannot("image", "it has both codes and floating-point samples");
  const int width = raw.row_samples() / samples, height = raw.rows();
  const std::string readout = " do not lie in the readout of " + std::to_string(width) + " x " + std::to_string(height);
  if (!inside(raw.active, width, height)) return cannot("ActiveArea", text_of(raw.active) + readout);
  if (!inside(raw.default_crop, raw.active.width, raw.active.height)) {
    return cannot("DefaultCropSize",
                  text_of(raw.default_crop) + " do not lie in the active area of " + text_of(raw.active));
  }
  if (raw.masked_is_stated && raw.masked.size() > max_values / 4) return cannot("MaskedAreas", "there are too many");
  for (const Rect& masked : raw.masked) {
    if (!inside(masked, width, height)) return cannot("MaskedAreas", text_of(masked) + readout);
  }
  return {};
}

double max_level(const RawDn& raw) { return raw.is_float() ? max_float_level_dn : max_level_dn; }

std::string levels_text(double low, const RawDn& raw) {
  return "expected " + number_text(low) + " to " + number_text(max_level(raw)) + " DN";
}

Result<void> check_deltas(const RawDn& raw, const std::vector<double>& deltas, int expected, const char* tag) {
  if (deltas.empty()) return {};
  if (deltas.size() != static_cast<std::size_t>(expected) || deltas.size() > max_values) {
    return cannot(tag, std::to_string(deltas.size()) + " values for " + std::to_string(expected) +
                           " columns or rows, at most 65535");
  }
  if (!all_within(deltas, -max_level(raw), max_level(raw))) return cannot(tag, levels_text(-max_level(raw), raw));
  return {};
}

Result<void> check_samples(const RawDn& raw) {
  const auto unusable = unusable_sample(raw);
  return unusable ? cannot("sample", *unusable) : Result<void>{};
}

Result<void> check_black(const RawDn& raw) {
  if (!raw.black_tag) return {};
  const BlackLevel& black = *raw.black_tag;
  const bool counted = within(black.rows, 1, max_level_dn) && within(black.columns, 1, max_level_dn) &&
                       black.samples == samples_of(raw.layout);
  const std::int64_t expected = counted ? std::int64_t{black.rows} * black.columns * black.samples : 0;
  if (!counted || expected != std::ssize(black.pattern_dn) || black.pattern_dn.size() > max_values) {
    return cannot("BlackLevel", std::to_string(black.pattern_dn.size()) + " values for " + std::to_string(black.rows) +
                                    " x " + std::to_string(black.columns) + " sites of " +
                                    std::to_string(black.samples) + " samples, at most 65535");
  }
  if (!all_within(black.pattern_dn, 0, max_level(raw))) return cannot("BlackLevel", levels_text(0, raw));
  if (auto fits = check_deltas(raw, black.column_dn, raw.active.width, "BlackLevelDeltaH"); !fits) return fits;
  return check_deltas(raw, black.row_dn, raw.active.height, "BlackLevelDeltaV");
}

Result<void> check_white(const RawDn& raw) {
  for (const double white : raw.white_dn) {
    if (!within(white, 1, max_level(raw))) return cannot("WhiteLevel", number_text(white) + ", " + levels_text(1, raw));
    if (raw.is_float() && white != std::round(white)) {
      return cannot("WhiteLevel", number_text(white) + " is not an integer: scale the samples, for example to 1");
    }
    if (raw.layout != SensorLayout::linear_rgb && white != raw.white_dn[0]) {
      return cannot("WhiteLevel",
                    "a mosaic has one channel, found " + number_text(raw.white_dn[0]) + " and " + number_text(white));
    }
  }
  if (!raw.black_tag) return {};
  const BlackLevel& black = *raw.black_tag;
  const double deltas = largest(black.column_dn) + largest(black.row_dn);
  for (std::size_t i = 0; i < black.pattern_dn.size(); ++i) {
    const double white = std::round(raw.white_dn[black.samples == 3 ? i % 3 : 0]);
    const double level = black.pattern_dn[i] + deltas;
    if (!(white > level)) {
      return cannot("WhiteLevel",
                    number_text(white) + " DN is not above the black level of " + number_text(level) + " DN");
    }
  }
  return {};
}

/// Returns whether the coefficients are in range, and the matrix of the rationals that the file holds is regular.
bool fits(const Matrix3& matrix) {
  Matrix3 written = matrix;
  for (Vector3& row : written) {
    for (double& value : row) {
      if (!within(value, -largest_coefficient, largest_coefficient)) return false;
      if (std::fabs(value) < smallest_coefficient) value = 0;
    }
  }
  return inverse(written).has_value();
}

bool fits(const Vector3& gains) {
  return std::all_of(gains.begin(), gains.end(),
                     [](double gain) { return within(gain, smallest_gain, largest_coefficient); });
}

Result<void> check_colour(const CameraColour& colour) {
  constexpr const char* expected = "expected a regular matrix of figures from -1000 to 1000";
  if (colour.calibrations.size() > 2) {
    return cannot("ColorMatrix", std::to_string(colour.calibrations.size()) + " calibrations, expected up to 2");
  }
  for (const ColourCalibration& c : colour.calibrations) {
    if (!fits(c.xyz_to_camera)) return cannot("ColorMatrix", expected);
    if (!fits(c.camera_calibration)) return cannot("CameraCalibration", expected);
    if (c.forward && !fits(*c.forward)) return cannot("ForwardMatrix", expected);
  }
  if (!fits(colour.analog_balance)) return cannot("AnalogBalance", "expected 0.0001 to 1000");
  if (colour.as_shot_neutral && !fits(*colour.as_shot_neutral)) {
    return cannot("AsShotNeutral", "expected 0.0001 to 1000");
  }
  if (const auto& xy = colour.as_shot_white_xy; xy && !((*xy)[0] > 0 && (*xy)[1] > 0 && (*xy)[0] + (*xy)[1] < 1)) {
    return cannot("AsShotWhiteXY", "it is not a chromaticity");
  }
  return {};
}

Result<void> check_noise(const NoiseProfile& noise) {
  for (int i = 0; i < 3; ++i) {
    if (!within(noise.scale[i], 0, 1) || !within(noise.offset[i], -1, 1)) {
      return cannot("NoiseProfile", "expected scales of 0 to 1 and offsets of -1 to 1");
    }
  }
  return {};
}

Result<void> check_ratio(const NoiseRatio& of, const Rect& active) {
  const bool fits = within(of.block_px, 1, 65535) && of.ratio.width() == ratio_blocks(active.width, of.block_px) &&
                    of.ratio.height() == ratio_blocks(active.height, of.block_px) &&
                    std::all_of(of.ratio.data(), of.ratio.data() + of.ratio.size(),
                                [](float ratio) { return std::isfinite(ratio) && ratio > 0; });
  if (!fits) return cannot("DNGPrivateData", "expected positive noise ratios in blocks that cover the active area");
  return {};
}

bool is_consistent(const GainMap& map) {
  const bool positive = map.top >= 0 && map.left >= 0 && map.bottom > map.top && map.right > map.left &&
                        map.row_pitch > 0 && map.column_pitch > 0 && map.first_plane >= 0 && map.planes > 0 &&
                        map.points_v > 0 && map.points_h > 0 && map.map_planes > 0;
  const double points = static_cast<double>(map.points_v) * map.points_h * map.map_planes;
  return positive && points == static_cast<double>(map.gain.size()) &&
         std::all_of(map.gain.begin(), map.gain.end(), [](float g) { return std::isfinite(g) && g >= 0; }) &&
         std::isfinite(map.spacing_v) && std::isfinite(map.spacing_h) && std::isfinite(map.origin_v) &&
         std::isfinite(map.origin_h);
}

Result<void> check_corrections(const RawFrame& frame) {
  const RawCorrections& c = frame.corrections;
  if (!std::all_of(c.gain_maps.begin(), c.gain_maps.end(), is_consistent)) {
    return cannot("GainMap", "it contradicts itself");
  }
  for (const RadialGain& r : c.radial_gains) {
    const bool finite = std::all_of(std::begin(r.k), std::end(r.k), [](double k) { return std::isfinite(k); });
    if (!finite || !within(r.centre_x, 0, 1) || !within(r.centre_y, 0, 1)) {
      return cannot("FixVignetteRadial", "expected finite figures and a centre in the image");
    }
  }
  const Rect& active = frame.raw.active;
  for (const DefectRect& d : c.defects) {
    const Rect rect{d.x, d.y, d.width, d.height};
    if (!inside(rect, active.width, active.height)) {
      return cannot("FixBadPixelsList", text_of(rect) + " do not lie in the active area");
    }
  }
  return {};
}

}  // namespace

Result<void> check_dng_frame(const RawFrame& frame) {
  return check_geometry(frame.raw)
      .and_then([&] { return check_samples(frame.raw); })
      .and_then([&] { return check_black(frame.raw); })
      .and_then([&] { return check_white(frame.raw); })
      .and_then([&] { return check_colour(frame.colour); })
      .and_then([&] { return frame.noise ? check_noise(*frame.noise) : Result<void>{}; })
      .and_then([&] { return frame.noise_ratio ? check_ratio(*frame.noise_ratio, frame.raw.active) : Result<void>{}; })
      .and_then([&] { return check_corrections(frame); });
}

}  // namespace lowlux::isp
