#include "isp/cli/dataset/pixel_mask.h"

#include <cmath>
#include <cstdint>
#include <vector>

#include "capture/synthetic/fixed_pattern.h"
#include "isp/model/sensor/noise_source_plan.h"

namespace lowlux::cli {

Plane<std::uint8_t> mask_of(const RawFrame& frame, const SimulateArgs& args, const SensorModel& sensor) {
  const RawDn& raw = frame.raw;
  Plane<std::uint8_t> out(raw.row_samples(), raw.rows());
  const auto columns = static_cast<std::size_t>(out.width());
  const bool hot_simulated =
      args.options.effects.tolerance.has_value() || args.options.effects.effects.has(isp::Effect::hot_pixels);
  const double fraction = hot_simulated ? sensor.hot_pixel_fraction : 0;
  const double white_dn = std::round(raw.white_dn[0]);  // as the file states it
  std::vector<std::uint32_t> words(columns);
  std::vector<std::uint8_t> hot(columns);
  for (int y = 0; y < out.height(); ++y) {
    capture::find_hot_pixels({args.options.sensor_seed, 0, static_cast<std::uint32_t>(y)}, fraction, words, hot);
    for (int x = 0; x < out.width(); ++x) {
      const double code = raw.is_float() ? raw.dn_float.at(x, y) : raw.dn.at(x, y);
      unsigned mask = code >= white_dn ? mask_saturated : 0;
      if (hot[static_cast<std::size_t>(x)] != 0) mask |= mask_hot;
      if (x < args.options.masked_columns) mask |= mask_shielded;
      out.at(x, y) = static_cast<std::uint8_t>(mask);
    }
  }
  return out;
}

}  // namespace lowlux::cli
