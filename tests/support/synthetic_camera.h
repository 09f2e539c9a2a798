#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "capture/synthetic/synthetic_source.h"
#include "isp/model/sensor/sensor_db.h"
#include "isp/model/spectrum/cie_data.h"
#include "isp/model/spectrum/spectral_response.h"

namespace lowlux::test {

/// Returns a sensor of 14 bits that has no effect but photon noise, quantisation and clipping, with a Nikon's filters.
inline isp::NamedSensor plain_sensor() {
  isp::NamedSensor out;
  out.model.name = "plain";
  out.model.full_well_e = 30000;
  out.model.bits = 14;
  out.model.black_level_dn = 512;
  out.model.white_level_dn = 16383;
  out.model.system_gain_dn_per_e = 0.5;
  out.camera = "Nikon_D5100";
  return out;
}

/// Returns the response of a sensor that a white of 100 cd/m2 fills in 1 s.
inline SpectralResponse response_of(const isp::NamedSensor& sensor) {
  return *isp::spectral_response(sensor, {2, 100.0});
}

inline capture::SceneSetup setup_of(int width, int height, double luminance_cd_m2, const char* light = "D65") {
  return {width, height, *isp::light_named(light), light, luminance_cd_m2};
}

inline SceneLinear even_picture(int width, int height, const Vector3& xyz) {
  SceneLinear out(width, height);
  for (int c = 0; c < 3; ++c) {
    std::fill_n(out.plane[c].data(), out.plane[c].size(), static_cast<float>(xyz[c]));
  }
  return out;
}

inline Result<capture::SyntheticSource> source_of(capture::Scene scene, const isp::NamedSensor& sensor,
                                                  const capture::SyntheticOptions& options = {}) {
  InlineExecutor executor;
  return capture::SyntheticSource::of(std::move(scene), sensor, response_of(sensor), options, executor);
}

}  // namespace lowlux::test
