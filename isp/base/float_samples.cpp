#include "isp/base/float_samples.h"

#include <algorithm>
#include <cmath>

#include "isp/base/text.h"

namespace lowlux {

std::optional<std::string> unusable_sample(const RawDn& raw) {
  const Plane<float>& dn = raw.dn_float;
  const int samples = raw.layout == SensorLayout::linear_rgb ? 3 : 1;
  const float limit = max_sample_whites * static_cast<float>(*std::ranges::max_element(raw.white_dn));
  const auto is_usable = [limit](float value) { return std::fabs(value) <= limit; };
  for (int y = 0; y < dn.height(); ++y) {
    const float *const row = dn.row(y), *const end = row + dn.width();
    const float* const bad = std::find_if_not(row, end, is_usable);
    if (bad == end) continue;
    const std::string place =
        "the value at column " + std::to_string((bad - row) / samples) + ", row " + std::to_string(y);
    if (!std::isfinite(*bad)) return place + " is not a finite number";
    return place + ", " + number_text(static_cast<double>(*bad)) + ", is more than 2^24 times the white level";
  }
  return std::nullopt;
}

}  // namespace lowlux
