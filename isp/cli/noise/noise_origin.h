#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "calib/noise/noise_figures.h"

namespace lowlux::cli {

/// States where the noise model of a frame comes from, and how well it is known.
struct NoiseOrigin {
  /// Lists where the noise model of a frame may come from, in the order in which they are preferred.
  enum class Source : std::uint8_t {
    given,         // --noise
    profile,       // --profile
    file,          // the file's NoiseProfile
    picture,       // measured on the image
    darktable,     // the user's darktable has figures of the camera
    raspberry_pi,  // libcamera's tuning files have figures of the sensor
    sensor_class,  // median of the sensors of its class
  };

  Source source = Source::file;
  std::string basis;                           // camera and setting that figures belong to; empty: the frame itself
  std::optional<calib::NoiseFigures> figures;  // absent for profiles and files, whose figures the plan states
  std::string unmeasurable;         // why the image alone does not show its noise; empty if it does, or was not asked
  bool is_adjusted = false;         // figures are those of the source, adjusted to the image
  double prior_ratio = 1;           // noise variance of the image to that of the source, where it is far below it
  std::vector<std::string> doubts;  // about a measurement on the image; empty: none found
};

/// Returns "given", "profile", "file", "picture", "darktable", "raspberry-pi" or "sensor-class".
std::string_view name_of(NoiseOrigin::Source source);

/// Returns the source in words: "given with --noise", "camera profile", "measured on the image".
std::string_view title_of(NoiseOrigin::Source source);

/// Returns "typical of its class (small sensor at ISO 100), adjusted to the image: 0.31 DN/e- within a factor of 1.5,
/// ...".
std::string origin_text(const NoiseOrigin& origin);

/// Returns one JSON object: source, basis, gain_dn_per_e, read_noise_e, their factors, adjusted_to_image,
/// measured_over_expected (prior_ratio), unmeasurable, doubts.
std::string origin_json(const NoiseOrigin& origin);

}  // namespace lowlux::cli
