#include "calib/profile/profile_schema.h"

#include <fmt/format.h>

#include "isp/model/sensor/noise_budget.h"
#include "isp/model/vision/scene_light.h"

namespace lowlux::calib {

void ProfileFailure::set(ErrorCode code, const std::string& path, const std::string& what) {
  if (!error) error = Error{code, fmt::format("{}: {}", path.empty() ? "profile" : path, what), path};
}

std::string joined(const std::string& path, const std::string& key) { return path.empty() ? key : path + "." + key; }

std::string indexed(const std::string& path, std::size_t i) { return fmt::format("{}[{}]", path, i); }

bool check_range(double value, const Range& range, const std::string& path, ProfileFailure& failure) {
  if (value >= range.low && value <= range.high) return true;
  failure.set(ErrorCode::malformed, path,
              fmt::format("found {:g}, expected {:g} to {:g}", value, range.low, range.high));
  return false;
}

namespace {

void check_gain(const GainProfile& gain, const std::string& path, ProfileFailure& failure) {
  if (gain.sensor) {
    const auto good = isp::check_sensor(*gain.sensor);
    if (!good) failure.set(ErrorCode::malformed, path + ".sensor", good.error().message);
  }
  const auto check_rising = [&](const std::optional<MeasuredRange>& range, const char* key) {
    if (range && range->low > range->high) {
      failure.set(ErrorCode::malformed, joined(path, key),
                  fmt::format("{:g} to {:g} is not a range", range->low, range->high));
    }
  };
  check_rising(gain.dark_exposure_s, "dark_exposure_s");
  check_rising(gain.dark_temperature_c, "dark_temperature_c");
}

}  // namespace

void check_together(const CameraProfile& profile, ProfileFailure& failure) {
  for (std::size_t i = 0; i < profile.gains.size() && !failure.error; ++i) {
    check_gain(profile.gains[i], indexed("gains", i), failure);
  }
  for (std::size_t i = 0; i < profile.colours.size() && !failure.error; ++i) {
    const ColourProfile& colour = profile.colours[i];
    if (!inverse(colour.calibration.xyz_to_camera)) {
      failure.set(ErrorCode::malformed, indexed("colours", i) + ".xyz_to_camera", "the matrix is singular");
    }
    if (colour.scotopic_weights) {
      const auto& [red, green, blue] = *colour.scotopic_weights;
      if (const auto light = isp::light_of_ratio(red + green + blue); !light) {
        failure.set(ErrorCode::malformed, indexed("colours", i) + ".scotopic_weights",
                    "their sum is the S/P of the illuminant: " + light.error().message);
      }
    }
  }
}

}  // namespace lowlux::calib
