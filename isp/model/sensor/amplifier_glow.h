#pragma once

#include "isp/base/sensor.h"
#include "isp/model/sensor/noise_budget.h"

namespace lowlux::isp {

/// Mean charge of amplifier glow in the pixels of a frame:
///     g(x, y) [e-] = t G exp(-d / (l D)),  d the distance of the pixel's centre from the source, D the diagonal
/// with G, l and the source's position of SensorModel. Transistors of the output amplifier emit near infrared light by
/// hot carriers (Janesick 2001); it does not follow the temperature law of dark current, and reaches light-shielded
/// pixels too. Its charge is Poisson distributed.
class AmplifierGlow {
 public:
  /// @param width_px, height_px  of the frame, light-shielded columns included
  AmplifierGlow(const SensorModel& sensor, const Exposure& exposure, int width_px, int height_px);

  bool present() const { return peak_e_ > 0; }
  double mean_e(int x, int y) const;

 private:
  double peak_e_, x_px_, y_px_, per_px_;
};

}  // namespace lowlux::isp
