#include "capture/libcamera/libcamera_facts.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace lowlux::capture {
namespace {

constexpr double absolute_zero_c = -273.15;

std::optional<double> above(double least, const std::optional<float>& value) {
  if (!value || !std::isfinite(*value) || !(*value > least)) return std::nullopt;
  return static_cast<double>(*value);
}

template <std::size_t N>
bool all_finite(const std::array<float, N>& values) {
  return std::all_of(values.begin(), values.end(), [](float value) { return std::isfinite(value); });
}

std::optional<std::array<double, 4>> black_levels_dn(const std::array<std::int32_t, 4>& levels, int bits) {
  std::array<double, 4> levels_dn{};
  for (std::size_t i = 0; i < levels.size(); ++i) {
    if (levels[i] < 0 || levels[i] > 65535) return std::nullopt;
    levels_dn[i] = std::ldexp(levels[i], bits - 16);
  }
  return levels_dn;
}

}  // namespace

FrameFacts frame_facts(const LibcameraValues& values, int bits) {
  assert(bits >= 1 && bits <= 16);
  FrameFacts facts;
  if (values.exposure_us && *values.exposure_us > 0) facts.exposure_s = *values.exposure_us * 1e-6;
  facts.analogue_gain = above(0, values.analogue_gain);
  facts.digital_gain = above(0, values.digital_gain);
  if (values.black_levels) facts.black_level_dn = black_levels_dn(*values.black_levels, bits);
  if (values.colour_gains && all_finite(*values.colour_gains)) {
    const auto [red, blue] = *values.colour_gains;
    if (red > 0 && blue > 0) facts.colour_gains = {red, blue};
  }
  if (values.colour_matrix && all_finite(*values.colour_matrix) && *values.colour_matrix != std::array<float, 9>{}) {
    std::copy(values.colour_matrix->begin(), values.colour_matrix->end(), facts.colour_matrix.emplace().begin());
  }
  if (values.colour_temperature_k && *values.colour_temperature_k > 0) {
    facts.colour_temperature_k = *values.colour_temperature_k;
  }
  if (values.lux && std::isfinite(*values.lux) && *values.lux >= 0) facts.lux = *values.lux;
  facts.temperature_c = above(absolute_zero_c, values.temperature_c);
  return facts;
}

}  // namespace lowlux::capture
