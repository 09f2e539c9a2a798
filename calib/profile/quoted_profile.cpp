#include "calib/profile/quoted_profile.h"

#include <string>
#include <utility>

#include <fmt/format.h>

#include "isp/model/sensor/sensor_db.h"

namespace lowlux::calib {
namespace {

Provenance quoted(std::string figures, std::string source) {
  return {.kind = Provenance::Kind::quoted, .figures = std::move(figures), .source = std::move(source)};
}

GainProfile gain_of(const isp::NamedSensor& named) {
  GainProfile out;
  out.gain_setting = named.gain_setting;
  out.iso = named.iso;
  out.sensor = named.model;
  if (named.black_level_is_sourced) {
    // Noise crosses codes: their mean lies half a code below the pedestal where the converter rounds down.
    const double lost_dn = named.model.quantisation == Quantisation::floor ? 0.5 : 0;
    const Estimate level{named.model.black_level_dn - lost_dn, 0};
    out.pedestal_dn = PerSite<Estimate>{level, level, level, level};
  }
  out.provenance.push_back(quoted("sensor", named.source));
  for (const std::string& assumption : named.assumptions) {
    out.provenance.push_back(quoted("assumed (no published value)", assumption));
  }
  return out;
}

}  // namespace

Result<CameraProfile> quoted_profile(std::string_view sensor) {
  CameraProfile out;
  for (const std::string_view setting : isp::gain_settings(sensor)) {
    if (const auto named = isp::sensor_named(sensor, setting, {})) out.gains.push_back(gain_of(*named));
  }
  if (!out.gains.empty()) return out;
  if (const auto known = isp::sensor_named(sensor, "", {}); !known) return tl::make_unexpected(known.error());
  return fail(ErrorCode::insufficient,
              fmt::format("the published figures of {} are not sufficient for a profile", sensor));
}

}  // namespace lowlux::calib
