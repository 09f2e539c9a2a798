#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <string>
#include <utility>

#include "calib/profile/profile_io.h"
#include "isp/base/camera_profile.h"
#include "tests/fuzz/input.h"

namespace lowlux::test {

/// A profile with drawn figures, which may be none that a profile can have: then the text is no profile.
inline std::string any_profile_text(FuzzInput& in) {
  CameraProfile profile{.make = "Maker", .model = "Model"};
  if (in.below(4) == 0) profile.mosaic = in.below(2) == 0 ? "monochrome" : "RGGB";
  for (int gains = in.below(3); gains > 0; --gains) {
    GainProfile gain;
    gain.gain_setting = "gain " + std::to_string(gains);
    gain.iso = 100.0 * gains;
    SensorModel sensor{.name = "Sensor"};
    sensor.system_gain_dn_per_e = in.take<std::uint16_t>() / 1024.0;
    sensor.read_noise_e = in.take<std::uint16_t>() / 1024.0;
    sensor.full_well_e = 1 + in.take<std::uint16_t>();
    sensor.bits = 8 + 2 * in.below(5);
    sensor.white_level_dn = (1 << sensor.bits) - 1;
    for (double& current : sensor.dark_current_e_per_s) current = in.take<std::uint8_t>();
    gain.sensor = std::move(sensor);
    for (int hot = in.below(4); hot > 0; --hot) {
      gain.hot_pixels.push_back({in.below(80), in.below(80), 10.0 * in.take<std::uint16_t>()});
    }
    profile.gains.push_back(std::move(gain));
  }
  return calib::profile_text(profile).value_or("{");
}

/// A text as a file that has a name.
class NamedText {
 public:
  explicit NamedText(const std::string& text) : fd_(memfd_create("profile", 0)) {
    require(fd_ >= 0 && write(fd_, text.data(), text.size()) == static_cast<ssize_t>(text.size()));
    name_ = "/proc/self/fd/" + std::to_string(fd_);
  }
  ~NamedText() { close(fd_); }
  NamedText(const NamedText&) = delete;
  NamedText& operator=(const NamedText&) = delete;
  const char* name() const { return name_.c_str(); }

 private:
  int fd_;
  std::string name_;
};

}  // namespace lowlux::test
