#include "isp/metrics/gamut_ratio.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <numeric>

#include "isp/metrics/convex_hull.h"

namespace lowlux::isp {
namespace {

constexpr std::size_t side = 2 * gamut_reach;  // bins along a* and along b*
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

// The counts are integers, so that the order of threads does not matter.
template <class Count>
void increase(Count& count, Count by) {
  std::atomic_ref(count).fetch_add(by, std::memory_order_relaxed);
}

double centre(std::size_t bin) { return static_cast<double>(bin) + 0.5 - gamut_reach; }

/// Returns the first and last kept bin of each row: no other can be a corner of the hull.
std::vector<Xy> outermost(const std::vector<bool>& kept) {
  std::vector<Xy> out;
  out.reserve(2 * side);
  for (std::size_t row = 0; row < side; ++row) {
    const auto begin = kept.begin() + static_cast<std::ptrdiff_t>(row * side);
    const auto end = begin + static_cast<std::ptrdiff_t>(side);
    const auto first = std::find(begin, end, true);
    if (first == end) continue;
    auto last = end - 1;
    while (!*last) --last;
    out.push_back({centre(static_cast<std::size_t>(first - begin)), centre(row)});
    if (last != first) out.push_back({centre(static_cast<std::size_t>(last - begin)), centre(row)});
  }
  return out;
}

double convex_percent(const std::vector<bool>& reference, const std::vector<bool>& test) {
  const std::vector<Xy> first = convex_hull(outermost(reference)), second = convex_hull(outermost(test));
  return first.empty() ? nan : 100 * shared_area(first, second) / polygon_area(first);
}

}  // namespace

GamutBins::GamutBins() : count_(side * side) {}

void GamutBins::add(std::span<const Lab> colours) {
  std::uint64_t strange = 0, far = 0;
  for (const Lab& c : colours) {
    if (!std::isfinite(c.l) || !std::isfinite(c.a) || !std::isfinite(c.b)) {
      ++strange;
      continue;
    }
    const double a = std::floor(c.a) + gamut_reach, b = std::floor(c.b) + gamut_reach;
    if (!(a >= 0 && a < side && b >= 0 && b < side)) {
      ++far;
      continue;
    }
    increase(count_[static_cast<std::size_t>(b) * side + static_cast<std::size_t>(a)], std::uint32_t{1});
  }
  increase(not_finite_, strange);
  increase(beyond_, far);
}

std::uint64_t GamutBins::counted() const { return std::accumulate(count_.begin(), count_.end(), std::uint64_t{0}); }

std::vector<bool> GamutBins::kept() const {
  const double least = std::max(gamut_min_pixels, gamut_min_fraction * static_cast<double>(counted()));
  std::vector<bool> out(count_.size());
  std::transform(count_.begin(), count_.end(), out.begin(), [&](std::uint32_t n) { return n >= least; });
  return out;
}

GamutRatio gamut_ratio(const GamutBins& reference, const GamutBins& test) {
  const std::vector<bool> expected = reference.kept(), got = test.kept();
  GamutRatio out;
  std::size_t both = 0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    out.reference_bins += expected[i] ? 1 : 0;
    out.test_bins += got[i] ? 1 : 0;
    both += expected[i] && got[i] ? 1 : 0;
  }
  out.occupancy_percent =
      out.reference_bins == 0 ? nan : 100 * static_cast<double>(both) / static_cast<double>(out.reference_bins);
  out.convex_percent = convex_percent(expected, got);
  return out;
}

GamutRatio gamut_ratio(std::span<const Lab> reference, std::span<const Lab> test) {
  GamutBins first, second;
  first.add(reference);
  second.add(test);
  return gamut_ratio(first, second);
}

}  // namespace lowlux::isp
