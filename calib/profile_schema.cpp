#include "calib/profile_schema.h"

#include <fmt/format.h>

#include "isp/model/noise_budget.h"

namespace lowlux::calib {

void ProfileFailure::set(ErrorCode code, const std::string& path, const std::string& what) {
  if (!error) error = Error{code, fmt::format("{}: {}", path.empty() ? "profile" : path, what), path};
}

std::string joined(const std::string& path, const std::string& key) { return path.empty() ? key : path + "." + key; }

std::string indexed(const std::string& path, std::size_t i) { return fmt::format("{}[{}]", path, i); }

bool check_range(double value, const Range& range, const std::string& path, ProfileFailure& failure) {
  if (value >= range.low && value <= range.high) return true;
  failure.set(ErrorCode::malformed, path,
              fmt::format("found {:g}, possible are {:g} to {:g}", value, range.low, range.high));
  return false;
}

void check_together(const CameraProfile& profile, ProfileFailure& failure) {
  for (std::size_t i = 0; i < profile.gains.size() && !failure.error; ++i) {
    const auto good = isp::check_sensor(profile.gains[i].sensor);
    if (!good) failure.set(ErrorCode::malformed, indexed("gains", i) + ".sensor", good.error().message);
  }
}

}  // namespace lowlux::calib
