#include "isp/cli/noise/noise_origin.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "isp/base/json_text.h"

namespace lowlux::cli {
namespace {

/// Returns an uncertainty in words; empty where none is stated.
std::string factor_text(double factor) {
  if (!(factor > 1)) return {};
  if (factor < 1.2) return fmt::format(" +- {:.2g} %", 100 * (factor - 1));
  return fmt::format(" within a factor of {:.2g}", factor);
}

}  // namespace

std::string_view title_of(NoiseOrigin::Source source) {
  switch (source) {
    case NoiseOrigin::Source::given:
      return "given with --noise";
    case NoiseOrigin::Source::profile:
      return "camera profile";
    case NoiseOrigin::Source::file:
      return "stated by the file (NoiseProfile)";
    case NoiseOrigin::Source::picture:
      return "measured on the image";
    case NoiseOrigin::Source::darktable:
      return "darktable's measurements";
    case NoiseOrigin::Source::raspberry_pi:
      return "libcamera's tuning of the sensor";
    case NoiseOrigin::Source::sensor_class:
      return "typical of its class";
  }
  return "";
}

std::string_view name_of(NoiseOrigin::Source source) {
  switch (source) {
    case NoiseOrigin::Source::given:
      return "given";
    case NoiseOrigin::Source::profile:
      return "profile";
    case NoiseOrigin::Source::file:
      return "file";
    case NoiseOrigin::Source::picture:
      return "picture";
    case NoiseOrigin::Source::darktable:
      return "darktable";
    case NoiseOrigin::Source::raspberry_pi:
      return "raspberry-pi";
    case NoiseOrigin::Source::sensor_class:
      return "sensor-class";
  }
  return "";
}

std::string origin_text(const NoiseOrigin& origin) {
  std::string text(title_of(origin.source));
  if (!origin.basis.empty()) text += " (" + origin.basis + ")";
  if (origin.prior_ratio < 1) {
    text += fmt::format(", times {:.2g} as measured on the image", origin.prior_ratio);
  } else if (origin.is_adjusted) {
    text += ", adjusted to the image";
  }
  if (!origin.figures) return text;
  const calib::NoiseFigures& f = *origin.figures;
  return text + fmt::format(": {:.3g} DN/e-{}, read noise {:.2g} e-{}", f.gain_dn_per_e, factor_text(f.gain_factor),
                            f.read_noise_e, factor_text(f.read_noise_factor));
}

std::string origin_json(const NoiseOrigin& origin) {
  nlohmann::ordered_json json{{"source", name_of(origin.source)}, {"basis", origin.basis}};
  if (origin.figures) {
    const calib::NoiseFigures& f = *origin.figures;
    json["gain_dn_per_e"] = f.gain_dn_per_e;
    json["read_noise_e"] = f.read_noise_e;
    json["gain_factor"] = f.gain_factor;
    json["read_noise_factor"] = f.read_noise_factor;
  }
  json["adjusted_to_image"] = origin.is_adjusted;
  json["measured_over_expected"] = origin.prior_ratio;
  json["unmeasurable"] = origin.unmeasurable;
  json["doubts"] = origin.doubts;
  return json_text(json);
}

}  // namespace lowlux::cli
