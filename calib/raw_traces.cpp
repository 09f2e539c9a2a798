#include "calib/raw_traces.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "calib/flat_samples.h"

namespace lowlux::calib {
namespace {

constexpr int windows = 16;
constexpr double dense_per_code = 30;
constexpr int least_width = 8;           // codes of a window: fewer tell no step
constexpr double quietest_share = 0.05;  // of each group of samples
constexpr int grid = 8;
constexpr double least_excess = 0.1;

struct Steps {
  int smallest = 0;  // 0: nowhere dense enough
  int largest = 0;
};

std::vector<std::int64_t> histogram(const RawDn& raw, int site) {
  std::vector<std::int64_t> out(65536, 0);
  for (int y = site >> 1; y < raw.active.height; y += 2) {
    const std::uint16_t* row = raw.dn.row(raw.active.y + y) + raw.active.x;
    for (int x = site & 1; x < raw.active.width; x += 2) ++out[row[x]];
  }
  return out;
}

/// Where all but a thousandth of the pixels at either end lie.
std::array<int, 2> range_in_use(const std::vector<std::int64_t>& count) {
  std::int64_t all = 0;
  for (const std::int64_t n : count) all += n;
  int low = 0, high = 65535;
  for (std::int64_t sum = 0; low < high && (sum += count[low]) <= all / 1000;) ++low;
  for (std::int64_t sum = 0; high > low && (sum += count[high]) <= all / 1000;) --high;
  return {low, high};
}

Steps steps_of(const std::vector<std::int64_t>& count) {
  const auto [low, high] = range_in_use(count);
  Steps out;
  for (int w = 0; w < windows; ++w) {
    const int first = low + (high - low) * w / windows, last = low + (high - low) * (w + 1) / windows;
    std::int64_t pixels = 0;
    int used = 0;
    for (int code = first; code < last; ++code) {
      pixels += count[code];
      used += count[code] > 0 ? 1 : 0;
    }
    if (last - first < least_width || static_cast<double>(pixels) < dense_per_code * (last - first)) continue;
    const int step = static_cast<int>(std::lround(static_cast<double>(last - first) / used));
    out.smallest = out.smallest == 0 ? step : std::min(out.smallest, step);
    out.largest = std::max(out.largest, step);
  }
  return out;
}

/// Mean size of second differences at each phase of an 8 x 8 grid of one colour's pixels, across columns or rows.
std::array<double, grid> restlessness(const RawDn& raw, bool across_columns) {
  std::array<double, grid> sum{}, n{};
  const int dx = across_columns ? 2 : 0, dy = across_columns ? 0 : 2;
  for (int y = 2 * dy; y < raw.active.height - dy; ++y) {
    for (int x = 2 * dx; x < raw.active.width - dx; ++x) {
      const auto at = [&](int i) {
        return static_cast<int>(raw.dn.at(raw.active.x + x + i * dx, raw.active.y + y + i * dy));
      };
      const int phase = (across_columns ? x / 2 : y / 2) % grid;
      sum[phase] += std::abs(3 * (at(0) - at(-1)) - at(1) + at(-2));
      n[phase] += 1;
    }
  }
  for (int p = 0; p < grid; ++p) sum[p] = n[p] > 0 ? sum[p] / n[p] : 0;
  return sum;
}

/// By how much the largest phase exceeds the quiet ones, if it does so by more than they scatter. A step raises the
/// phase it lies at and both beside it: five are left.
double excess_of(std::array<double, grid> phase) {
  std::sort(phase.begin(), phase.end());
  const double quiet = phase[2], scatter = phase[4] - phase[0];
  return quiet > 0 && phase[7] - quiet > 3 * scatter ? phase[7] / quiet - 1 : 0;
}

}  // namespace

RawTraces code_traces(const RawDn& raw) {
  RawTraces out;
  for (int site = 0; site < 4; ++site) {
    const Steps steps = steps_of(histogram(raw, site));
    if (steps.smallest == 0) continue;
    out.code_step_dn = std::max(out.code_step_dn, steps.smallest);
    out.largest_step_dn = std::max(out.largest_step_dn, steps.largest);
    out.companded = out.companded || steps.largest > steps.smallest;
  }
  out.grid_excess = std::max(excess_of(restlessness(raw, true)), excess_of(restlessness(raw, false)));
  out.block_grid = out.grid_excess > least_excess;
  return out;
}

void add_filter_trace(const NoiseSamples& blocks_by_surroundings, RawTraces& traces) {
  const FlatPoints quiet = quietest_points(blocks_by_surroundings, {}, quietest_share);
  traces.fine_to_coarse = quiet.mean_middle > 0 ? quiet.mean_high / quiet.mean_middle : 0;
  traces.denoised = quiet.mean_middle > 0 && traces.fine_to_coarse < least_fine_to_coarse;
}

}  // namespace lowlux::calib
