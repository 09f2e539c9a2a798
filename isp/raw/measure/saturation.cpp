#include "isp/raw/measure/saturation.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "isp/raw/black_point.h"

namespace lowlux::isp {
namespace {

constexpr double lowest = 0.75, highest = 1.25;  // fractions of white
constexpr int neighbours = 8;
constexpr double pile_ratio = 5;
constexpr std::int64_t min_count = 32, max_samples_per_count = 20000;

/// Black and white level of some samples of a frame [DN].
struct Range {
  double pedestal = 0;
  double white = 0;

  double fraction(double code) const { return (code - pedestal) / (white - pedestal); }
  std::size_t code_at(double fraction) const {
    return static_cast<std::size_t>(std::clamp(pedestal + fraction * (white - pedestal), 0.0, 65535.0));
  }
};

/// Returns the mean levels of the sites, or of the channels of linear_rgb, for which use(site) holds.
template <class Use>
Range mean_range(const RawDn& raw, const BlackPoint& black, const Use& use) {
  Range out;
  double count = 0;
  for (int site = 0; site < 4; ++site) {
    if (!use(site)) continue;
    out.pedestal += black.pedestal_dn[static_cast<std::size_t>(site)];
    out.white += white_at(raw, site);
    count += 1;
  }
  return {out.pedestal / count, out.white / count};
}

/// Counts the codes of every `step`-th sample of each row from the first on.
std::vector<std::int64_t> histogram_of(const RawDn& raw, int first, int step) {
  std::vector<std::int64_t> out(65536 + 1);
  const int samples = raw.layout == SensorLayout::linear_rgb ? 3 : 1;
  for (int y = 0; y < raw.active.height; ++y) {
    const std::uint16_t* const row = raw.dn.row(raw.active.y + y) + samples * raw.active.x;
    for (int x = first; x < samples * raw.active.width; x += step) ++out[row[x]];
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

/// Returns the code at which the histogram of this range has the peak of saturation; nullopt where it has none.
std::optional<std::size_t> pile_of(const std::vector<std::int64_t>& counts, const Range& range, std::int64_t samples) {
  const auto first = counts.begin() + static_cast<std::ptrdiff_t>(range.code_at(lowest));
  const auto last = counts.begin() + static_cast<std::ptrdiff_t>(range.code_at(highest)) + 1;
  const auto code = static_cast<std::size_t>(std::max_element(first, last) - counts.begin());
  return is_pile(counts, code, samples) ? std::optional(code) : std::nullopt;
}

}  // namespace

std::array<double, 3> measure_saturation(const RawDn& raw, const BlackPoint& black) {
  std::array<double, 3> out{1, 1, 1};
  if (raw.is_float() || raw.dn.empty()) return out;
  const std::int64_t pixels = std::int64_t{raw.active.width} * raw.active.height;
  if (raw.layout == SensorLayout::linear_rgb) {
    for (int c = 0; c < 3; ++c) {
      const Range range = mean_range(raw, black, [c](int channel) { return channel == c; });
      const auto code = pile_of(histogram_of(raw, c, 3), range, pixels);
      if (code) out[static_cast<std::size_t>(c)] = range.fraction(static_cast<double>(*code));
    }
    return out;
  }
  const auto any = [](int) { return true; };
  const auto code = pile_of(histogram_of(raw, 0, 1), mean_range(raw, black, any), pixels);
  if (!code) return out;
  for (int c = 0; c < 3; ++c) {
    const auto has_colour = [&](int site) {
      return raw.layout == SensorLayout::monochrome || static_cast<int>(colour_at(raw.phase, site & 1, site >> 1)) == c;
    };
    out[static_cast<std::size_t>(c)] = mean_range(raw, black, has_colour).fraction(static_cast<double>(*code));
  }
  return out;
}

}  // namespace lowlux::isp
