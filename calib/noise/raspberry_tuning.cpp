#include "calib/noise/raspberry_tuning.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "calib/noise/json_scalars.h"
#include "calib/noise/sensor_class.h"
#include "isp/base/text.h"
#include "isp/model/sensor/noise_budget.h"

namespace lowlux::calib {
namespace {

constexpr double codes_16_bits = 65536, max_slope = 100, max_constant = 1000;
constexpr double slope_factor = 1.25;  // uncertainty of the gain where the convention is known

/// Collects the entries of noise and black level, of either version: algorithms by name, or in a list.
class TuningReader : public JsonReader {
 public:
  RaspberryTuning tuning;
  bool has_constant = false, has_slope = false, has_black = false;

  bool number(JsonPath path, double value) override {
    if (path.size() == 4 && is_at(path.first(2), "algorithms/[]")) path = path.subspan(2);
    put(path, "rpi.noise/reference_constant", value, tuning.reference_constant, has_constant);
    put(path, "rpi.noise/reference_slope", value, tuning.reference_slope, has_slope);
    put(path, "rpi.black_level/black_level", value, tuning.black_level, has_black);
    return true;
  }
  bool text(JsonPath path, std::string_view value) override {
    if (is_at(path, "target")) tuning.target = value.substr(0, 16);
    return true;
  }
  bool flag(JsonPath /*path*/, bool /*value*/) override { return true; }
  bool end_object(JsonPath /*path*/) override { return true; }

 private:
  static void put(JsonPath path, std::string_view keys, double value, double& out, bool& is_found) {
    if (!is_at(path, keys)) return;
    out = value;
    is_found = true;
  }
};

bool is_pisp(const RaspberryTuning& tuning) { return tuning.target == "pisp"; }

/// Returns the setting at an analogue gain.
GainProfile setting_at(const RaspberryTuning& tuning, const TunedSensor& sensor, double gain) {
  GainProfile out;
  out.gain_setting = fmt::format("analogue gain {:g}", gain);
  out.iso = 100 * gain;
  const double step = std::exp2(16 - sensor.bits);
  SensorModel model;
  model.name = sensor.name;
  model.bits = sensor.bits;
  model.white_level_dn = std::exp2(sensor.bits) - 1;
  model.black_level_dn = tuning.black_level / step;
  model.system_gain_dn_per_e = gain * tuning_gain_dn_per_e(tuning, sensor.bits);
  model.full_well_e = (model.white_level_dn - model.black_level_dn) / model.system_gain_dn_per_e;
  const bool is_stated = tuning.reference_constant > 0;
  const double constant_dn = tuning.reference_constant * std::sqrt(gain) / step;
  model.read_noise_e = is_stated ? constant_dn / model.system_gain_dn_per_e : class_read_noise_e(model.full_well_e);
  out.errors.system_gain_dn_per_e = model.system_gain_dn_per_e * (tuning_gain_factor(tuning) - 1);
  out.errors.read_noise_e = model.read_noise_e * (read_noise_factor - 1);
  const Estimate level{model.black_level_dn, 0};
  out.pedestal_dn = PerSite<Estimate>{level, level, level, level};
  out.sensor = std::move(model);
  return out;
}

void add_provenance(const RaspberryTuning& tuning, const TunedSensor& sensor, GainProfile& out) {
  const auto add = [&out](std::string figures, std::string source) {
    out.provenance.push_back(
        {.kind = Provenance::Kind::quoted, .figures = std::move(figures), .source = std::move(source)});
  };
  add("system gain, pedestal",
      fmt::format("{} (BSD-2-Clause): reference_slope {:g}, black_level {:g}; gain within a "
                  "factor of {:.2g}",
                  sensor.source, tuning.reference_slope, tuning.black_level, tuning_gain_factor(tuning)));
  add("assumed (no published value)", "full well: the charge at the white level");
  if (tuning.reference_constant > 0) {
    add("read noise", fmt::format("{}: reference_constant {:g}", sensor.source, tuning.reference_constant));
  } else {
    add("assumed (no published value)",
        fmt::format("read noise: that of sensors in general, within a factor of {:.2g}", read_noise_factor));
  }
  add("assumed (no published value)", "dark current, PRNU, DSNU, row and column noise: none");
}

Result<void> check(const TuningReader& found) {
  if (!found.has_slope || !found.has_constant) {
    return fail(ErrorCode::malformed,
                "the file has no rpi.noise with reference_constant and reference_slope: it is not a tuning file of a "
                "Raspberry Pi camera, or states no noise");
  }
  const RaspberryTuning& t = found.tuning;
  if (!(t.reference_slope > 0 && t.reference_slope < max_slope)) {
    return fail(ErrorCode::malformed,
                fmt::format("reference_slope is {:g}, expected above 0 and below {:g}", t.reference_slope, max_slope));
  }
  if (!(t.reference_constant >= 0 && t.reference_constant <= max_constant)) {
    return fail(ErrorCode::malformed,
                fmt::format("reference_constant is {:g}, expected 0 to {:g}", t.reference_constant, max_constant));
  }
  if (!found.has_black || !(t.black_level >= 0 && t.black_level < codes_16_bits / 2)) {
    return fail(ErrorCode::malformed,
                "the file has no rpi.black_level with a black_level of 0 to 32767 (16-bit codes)");
  }
  return {};
}

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

Result<RaspberryTuning> parse_raspberry_tuning(std::string_view json) {
  TuningReader reader;
  if (const auto read = read_json(json, max_tuning_bytes, reader); !read) return tl::make_unexpected(read.error());
  if (const auto good = check(reader); !good) return tl::make_unexpected(good.error());
  return std::move(reader.tuning);
}

double tuning_gain_factor(const RaspberryTuning& tuning) {
  return is_pisp(tuning) ? std::exp(std::hypot(std::log(slope_factor), std::log(std::numbers::sqrt2))) : slope_factor;
}

double tuning_gain_dn_per_e(const RaspberryTuning& tuning, int bits) {
  const double gain = tuning.reference_slope * tuning.reference_slope * std::exp2(bits - 16);
  return is_pisp(tuning) ? gain / std::numbers::sqrt2 : gain;
}

Result<CameraProfile> profile_of_tuning(const RaspberryTuning& tuning, const TunedSensor& sensor) {
  if (sensor.bits < 8 || sensor.bits > 16) {
    return fail(ErrorCode::invalid_argument, fmt::format("the sensor has {} bits, expected 8 to 16", sensor.bits));
  }
  if (!(sensor.max_gain > 1)) {
    return fail(ErrorCode::invalid_argument,
                fmt::format("an analogue gain of at most {:g}: it must be above 1", sensor.max_gain));
  }
  CameraProfile out;
  for (const double gain : {1.0, sensor.max_gain}) {
    out.gains.push_back(setting_at(tuning, sensor, gain));
    add_provenance(tuning, sensor, out.gains.back());
    if (const auto good = isp::check_sensor(*out.gains.back().sensor); !good) return tl::make_unexpected(good.error());
  }
  return out;
}

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

std::vector<std::string> raspberry_sensors() {
  std::vector<std::string> names;
  names.reserve(std::size(known_sensors));
  for (const KnownSensor& sensor : known_sensors) names.emplace_back(sensor.name);
  return names;
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
