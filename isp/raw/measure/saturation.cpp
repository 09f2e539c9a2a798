#include "isp/raw/measure/saturation.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "isp/raw/black_point.h"

namespace lowlux::isp {
namespace {

constexpr double lowest = 0.75, highest = 1.25;  // fractions of white
constexpr int neighbours = 8;
constexpr double pile_ratio = 5;
constexpr std::int64_t min_count = 32, max_samples_per_count = 20000;

std::vector<std::int64_t> histogram_of(const RawDn& raw) {
  std::vector<std::int64_t> out(65536 + 1);
  const int samples = raw.layout == SensorLayout::linear_rgb ? 3 : 1;
  for (int y = 0; y < raw.active.height; ++y) {
    const std::uint16_t* const row = raw.dn.row(raw.active.y + y) + samples * raw.active.x;
    for (int x = 0; x < samples * raw.active.width; ++x) ++out[row[x]];
  }
  return out;
}

bool is_pile(const std::vector<std::int64_t>& counts, std::size_t code, std::int64_t samples) {
  const std::int64_t count = counts[code];
  if (count < min_count || count * max_samples_per_count < samples) return false;
  std::int64_t sum = 0, used = 0;
  const std::size_t first = code - std::min<std::size_t>(code, neighbours);
  for (std::size_t i = first; i <= std::min(code + neighbours, counts.size() - 1); ++i) {
    if (i == code || counts[i] == 0) continue;
    sum += counts[i];
    ++used;
  }
  return static_cast<double>(count * used) >= pile_ratio * static_cast<double>(sum);
}

}  // namespace

double measure_saturation(const RawDn& raw, const BlackPoint& black) {
  if (raw.is_float() || raw.dn.empty()) return 1;
  double pedestal = 0, white = 0;
  for (int site = 0; site < 4; ++site) {
    pedestal += black.pedestal_dn[static_cast<std::size_t>(site)] / 4;
    white += white_at(raw, site) / 4;
  }
  const auto code_at = [&](double fraction) {
    return static_cast<std::size_t>(std::clamp(pedestal + fraction * (white - pedestal), 0.0, 65535.0));
  };
  const std::vector<std::int64_t> counts = histogram_of(raw);
  const auto first = counts.begin() + static_cast<std::ptrdiff_t>(code_at(lowest));
  const auto last = counts.begin() + static_cast<std::ptrdiff_t>(code_at(highest)) + 1;
  const auto code = static_cast<std::size_t>(std::max_element(first, last) - counts.begin());
  const std::int64_t samples = std::int64_t{raw.active.width} * raw.active.height;
  if (!is_pile(counts, code, samples)) return 1;
  return (static_cast<double>(code) - pedestal) / (white - pedestal);
}

}  // namespace lowlux::isp
