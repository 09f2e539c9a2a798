#include "isp/model/sensor/amplifier_glow.h"

#include <cmath>

namespace lowlux::isp {

AmplifierGlow::AmplifierGlow(const SensorModel& sensor, const Exposure& exposure, int width_px, int height_px)
    : peak_e_(sensor.glow_e_per_s * exposure.time_s),
      x_px_(sensor.glow_position[0] * width_px - 0.5),
      y_px_(sensor.glow_position[1] * height_px - 0.5),
      per_px_(1 / (sensor.glow_length * std::hypot(width_px, height_px))) {}

double AmplifierGlow::mean_e(int x, int y) const {
  const double right = x - x_px_, down = y - y_px_;
  return peak_e_ * std::exp(-per_px_ * std::sqrt(right * right + down * down));
}

}  // namespace lowlux::isp
