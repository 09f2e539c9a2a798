#include "calib/noise/raspberry_sensors.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "calib/noise/sensor_class.h"
#include "isp/base/text.h"

namespace lowlux::calib {
namespace {

/// Bits are those of the full-resolution mode and gains those of the driver, at most 16. Slope and black level are
/// rpi.noise reference_slope and rpi.black_level of the sensor's file in src/ipa/rpi/vc4/data (16-bit codes).
struct KnownSensor {
  std::string_view name;
  int bits;
  double max_gain;
  double slope;
  double black_level;
};

constexpr std::array known_sensors{
    KnownSensor{"imx219", 10, 10.6, 3.67, 4096}, KnownSensor{"imx283", 12, 16, 2.147, 3200},
    KnownSensor{"imx290", 12, 16, 2.67, 3840},   KnownSensor{"imx296", 10, 15.6, 2.671, 3840},
    KnownSensor{"imx327", 12, 16, 2.67, 3840},   KnownSensor{"imx335", 12, 16, 3.349, 3200},
    KnownSensor{"imx378", 12, 16, 2.641, 4096},  KnownSensor{"imx415", 12, 16, 3.439, 3840},
    KnownSensor{"imx462", 12, 16, 3.849, 3840},  KnownSensor{"imx477", 12, 16, 2.767, 4096},
    KnownSensor{"imx500", 10, 16, 2.747, 4096},  KnownSensor{"imx519", 10, 16, 2.776, 4096},
    KnownSensor{"imx708", 10, 16, 2.5, 4096},    KnownSensor{"ov5647", 10, 15.5, 4.25, 1024},
    KnownSensor{"ov7251", 10, 15.5, 2.5, 4096},  KnownSensor{"ov9281", 10, 15.5, 2.5, 4096},
};

RaspberryTuning tuning_of(const KnownSensor& sensor) {
  return {.reference_slope = sensor.slope, .black_level = sensor.black_level, .target = "bcm2835"};
}

std::string lower_case(std::string_view text) {
  std::string out(text);
  std::ranges::transform(out, out.begin(), ascii_lower);
  return out;
}

}  // namespace

std::optional<TunedSensor> tuned_sensor(std::string_view file_name) {
  const std::string name = lower_case(file_name.substr(0, file_name.find_first_of("._")));
  const auto* const found = std::ranges::find(known_sensors, std::string_view(name), &KnownSensor::name);
  if (found == known_sensors.end()) return std::nullopt;
  return TunedSensor{.name = name, .bits = found->bits, .max_gain = found->max_gain, .source = {}};
}

std::optional<CameraProfile> raspberry_profile(std::string_view sensor) {
  auto tuned = tuned_sensor(sensor);
  if (!tuned) return std::nullopt;
  tuned->source = "libcamera v0.7.1, src/ipa/rpi/vc4/data/" + tuned->name + ".json";
  auto profile =
      profile_of_tuning(tuning_of(*std::ranges::find(known_sensors, tuned->name, &KnownSensor::name)), *tuned);
  if (!profile) return std::nullopt;
  return *std::move(profile);
}

std::optional<RaspberryMatch> find_raspberry_noise(std::string_view make, std::string_view model, double iso,
                                                   double range_dn) {
  if (lower_case(make).find("raspberry") == std::string::npos || !(iso >= 50 && iso <= 6400) || !(range_dn > 0))
    return std::nullopt;
  const std::string key = lower_case(model);
  const auto* const found = std::ranges::find_if(
      known_sensors, [&key](const KnownSensor& sensor) { return key.find(sensor.name) != std::string::npos; });
  if (found == known_sensors.end()) return std::nullopt;
  const RaspberryTuning tuning = tuning_of(*found);
  const double analogue_gain = iso / 100;
  const double range_of_sensor_dn = std::exp2(found->bits) - 1 - found->black_level * std::exp2(found->bits - 16);
  const double electrons = range_of_sensor_dn / (analogue_gain * tuning_gain_dn_per_e(tuning, found->bits));
  return RaspberryMatch{.figures = {.gain_dn_per_e = range_dn / electrons,
                                    .read_noise_e = class_read_noise_e(electrons),
                                    .gain_factor = tuning_gain_factor(tuning),
                                    .read_noise_factor = read_noise_factor},
                        .sensor = std::string(found->name),
                        .analogue_gain = analogue_gain};
}

}  // namespace lowlux::calib
