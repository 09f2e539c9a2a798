#include "isp/raw/measure/masked_black.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <vector>

#include <fmt/format.h>

#include "isp/base/cfa.h"
#include "isp/model/sensor/masked_noise.h"

namespace lowlux::isp {
namespace {

constexpr int outer_trim = 4;
constexpr int inner_trim = 12;
constexpr int min_side = 8;                // of the trimmed strip, in pixels
constexpr int min_samples_per_site = 500;  // standard error below 0.05 standard deviations
constexpr double cut_sigma = 5.0;
constexpr double max_offset_of_range = 0.005;  // of an undeclared border from the tag
constexpr double max_offset_of_noise = 16;     // undeclared border to tag, in standard deviations of its pixels
constexpr double mad_to_std = 1.4826;          // for a normal distribution

enum class Side { left, right, top, bottom, elsewhere };

Side side_of(const Rect& masked, const Rect& active) {
  if (masked.x + masked.width <= active.x) return Side::left;
  if (masked.x >= active.x + active.width) return Side::right;
  if (masked.y + masked.height <= active.y) return Side::top;
  if (masked.y >= active.y + active.height) return Side::bottom;
  return Side::elsewhere;
}

// Trims `thickness` pixels at the outer and at the inner side; thin strips lose at most a quarter on each side.
void trim(int& start, int& thickness, bool inner_is_high) {
  const int outer = std::min(outer_trim, thickness / 4);
  const int inner = std::min(inner_trim, thickness / 4);
  start += inner_is_high ? outer : inner;
  thickness -= outer + inner;
}

// Returns the trimmed strip. Columns are used next to active rows only: the corners belong to the vertical blanking.
Rect trimmed(Rect masked, const Rect& active, Side side) {
  if (side == Side::left || side == Side::right) {
    const int top = std::max(masked.y, active.y);
    const int bottom = std::min(masked.y + masked.height, active.y + active.height);
    masked.y = top;
    masked.height = std::max(0, bottom - top);
    trim(masked.x, masked.width, side == Side::left);
  } else {
    trim(masked.y, masked.height, side == Side::top);
  }
  return masked;
}

std::int64_t area(const Rect& r) { return static_cast<std::int64_t>(r.width) * r.height; }

// Returns the largest usable strip, columns before rows.
std::optional<Rect> best_region(const RawDn& raw) {
  std::optional<Rect> best;
  bool best_is_column = false;
  for (const Rect& masked : raw.masked) {
    const Side side = side_of(masked, raw.active);
    if (side == Side::elsewhere) continue;
    const bool column = side == Side::left || side == Side::right;
    const Rect region = trimmed(masked, raw.active, side);
    if (std::min(region.width, region.height) < min_side || area(region) < 4 * min_samples_per_site) continue;
    if (!best || (column && !best_is_column) || (column == best_is_column && area(region) > area(*best))) {
      best = region;
      best_is_column = column;
    }
  }
  return best;
}

// Finds the median and deviation of 16-bit codes by counting, exactly and independently of the order of the samples.
class Histogram {
 public:
  Histogram() : count_(65536) {}
  void add(std::uint16_t code) {
    ++count_[code];
    ++total_;
  }
  double median() const { return rank(count_, total_); }
  double median_absolute_deviation(double median) const {
    std::vector<std::int64_t> deviations(131073);  // in half codes
    for (int code = 0; code < 65536; ++code) {
      deviations[static_cast<int>(std::fabs(2 * (code - median)))] += count_[code];
    }
    return rank(deviations, total_) / 2;
  }

 private:
  static double rank(const std::vector<std::int64_t>& counts, std::int64_t total) {
    std::int64_t below = 0;
    for (std::size_t i = 0; i < counts.size(); ++i) {
      below += counts[i];
      if (2 * below >= total) return static_cast<double>(i);
    }
    return 0;
  }
  std::vector<std::int64_t> count_;
  std::int64_t total_ = 0;
};

struct Sums {
  double sum = 0;
  double sum_of_squares = 0;
  std::int64_t n = 0;
  void add(double v) {
    sum += v;
    sum_of_squares += v * v;
    ++n;
  }
  double mean() const { return n > 0 ? sum / static_cast<double>(n) : 0; }
  double variance() const {
    return n > 1 ? std::max(0.0, (sum_of_squares - sum * mean()) / static_cast<double>(n - 1)) : 0;
  }
};

double variance_of_means(const std::vector<Sums>& lines) {
  Sums means;
  for (const Sums& line : lines) {
    if (line.n > 0) means.add(line.mean());
  }
  return means.n > 0 ? means.variance() / static_cast<double>(means.n) : 0;
}

struct SiteEstimate {
  double mean = 0;
  double standard_error = 0;
  double noise_std = 0;
};

// Values are taken relative to the median, so that the sums of squares keep their precision.
SiteEstimate estimate_site(const RawDn& raw, const Rect& region, int site, double gain_dn_per_e) {
  const auto first = [&](int start, int origin, int parity) { return start + (((start - origin) & 1) != parity); };
  const int x0 = first(region.x, raw.active.x, site & 1);
  const int y0 = first(region.y, raw.active.y, site >> 1);
  Histogram histogram;
  for (int y = y0; y < region.y + region.height; y += 2) {
    for (int x = x0; x < region.x + region.width; x += 2) histogram.add(raw.dn.at(x, y));
  }
  const double median = histogram.median();
  const double spread = mad_to_std * histogram.median_absolute_deviation(median);
  const double cut = cut_sigma * std::max(spread, 0.5);  // at least half a code: a constant strip has no spread

  Sums all;
  std::vector<Sums> rows(region.height);
  std::vector<Sums> columns(region.width);
  for (int y = y0; y < region.y + region.height; y += 2) {
    for (int x = x0; x < region.x + region.width; x += 2) {
      const double v = raw.dn.at(x, y) - median;
      if (v < -cut || v > cut + max_hidden_charge_e * gain_dn_per_e) continue;
      all.add(v);
      rows[y - region.y].add(v);
      columns[x - region.x].add(v);
    }
  }
  const double white_part = all.variance() / static_cast<double>(std::max<std::int64_t>(all.n, 1));
  const double se2 = std::max(white_part, variance_of_means(rows) + variance_of_means(columns) - white_part);
  return {median + all.mean(), std::sqrt(se2), std::sqrt(all.variance())};
}

double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  const auto n = static_cast<double>(a.size());
  const double mean_a = std::accumulate(a.begin(), a.end(), 0.0) / n;
  const double mean_b = std::accumulate(b.begin(), b.end(), 0.0) / n;
  double ab = 0, aa = 0, bb = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    ab += (a[i] - mean_a) * (b[i] - mean_b);
    aa += (a[i] - mean_a) * (a[i] - mean_a);
    bb += (b[i] - mean_b) * (b[i] - mean_b);
  }
  return aa > 0 && bb > 0 ? ab / std::sqrt(aa * bb) : 0;
}

double block_mean(const RawDn& raw, const Rect& r) {
  double sum = 0;
  for (int y = r.y; y < r.y + r.height; ++y) {
    for (int x = r.x; x < r.x + r.width; ++x) sum += raw.dn.at(x, y);
  }
  return sum / static_cast<double>(area(r));
}

// Returns whether light reaches a strip: its profile along the edge then follows that of the adjacent active pixels.
bool profile_follows_scene(const RawDn& raw, const Rect& region, double noise_std) {
  const bool column = region.x + region.width <= raw.active.x || region.x >= raw.active.x + raw.active.width;
  const int length = column ? region.height : region.width;
  constexpr int step = 16;
  const int depth = std::min(64, column ? raw.active.width : raw.active.height);
  const bool before = column ? region.x < raw.active.x : region.y < raw.active.y;
  const int near = column ? (before ? raw.active.x : raw.active.x + raw.active.width - depth)
                          : (before ? raw.active.y : raw.active.y + raw.active.height - depth);
  const int along_start = column ? raw.active.y : raw.active.x;
  const int along_end = along_start + (column ? raw.active.height : raw.active.width);
  std::vector<double> strip;
  std::vector<double> scene;
  for (int at = column ? region.y : region.x; at + step <= (column ? region.y : region.x) + length; at += step) {
    if (at < along_start || at + step > along_end) continue;
    strip.push_back(
        block_mean(raw, column ? Rect{region.x, at, region.width, step} : Rect{at, region.y, step, region.height}));
    scene.push_back(block_mean(raw, column ? Rect{near, at, depth, step} : Rect{at, near, step, depth}));
  }
  if (strip.size() < 8) return false;
  Sums profile;
  for (const double v : strip) profile.add(v - strip.front());
  const double expected = noise_std / std::sqrt(static_cast<double>(step) * (column ? region.width : region.height));
  return std::sqrt(profile.variance()) > 5 * expected && correlation(strip, scene) > 0.5;
}

std::string why_not_dark(const RawDn& raw, const Rect& region, const BlackPoint& black) {
  if (!raw.black_tag)
    return "the file does not state that its border is masked, and there is no black level to verify it";
  const double level = mean_of_sites(black.pedestal_dn);
  const double noise = mean_of_sites(black.noise_std_dn);
  const double tag = raw.black_tag->pattern_dn.front();
  if (!(noise > 0)) return "the border was not read out, because it has one value only";
  if (std::fabs(level - tag) > std::max(max_offset_of_noise * noise, max_offset_of_range * (raw.white_dn[1] - tag))) {
    return fmt::format("the border's level {:.1f} DN is too far from the tagged black {:.1f} DN to be masked", level,
                       tag);
  }
  if (profile_follows_scene(raw, region, mean_of_sites(black.noise_std_dn)))
    return "the border shows the scene, so it is not masked";
  return {};
}

}  // namespace

MaskedBlack measure_masked_black(const RawDn& raw, double gain_dn_per_e) {
  MaskedBlack out;
  if (raw.layout == SensorLayout::linear_rgb) {
    out.refusal = "the file has demosaiced samples, which have no masked pixels";
    return out;
  }
  if (raw.is_float()) {
    out.refusal = "the samples are floating-point numbers: masked pixels are measured on integer codes only";
    return out;
  }
  const std::optional<Rect> region = best_region(raw);
  if (!region) {
    out.refusal = raw.masked.empty() ? "the file has no masked pixels" : "the masked border is too small to measure on";
    return out;
  }
  out.region = *region;
  BlackPoint black;
  black.source = BlackPoint::Source::masked_pixels;
  black.holds = BlackPoint::Holds::pedestal_and_dark;
  for (int site = 0; site < 4; ++site) {
    const SiteEstimate estimate = estimate_site(raw, *region, site, gain_dn_per_e);
    black.pedestal_dn[site] = estimate.mean;
    black.pedestal_standard_error_dn[site] = estimate.standard_error;
    black.noise_std_dn[site] = estimate.noise_std;
  }
  if (!raw.masked_is_stated) out.refusal = why_not_dark(raw, *region, black);
  if (out.refusal.empty()) out.black = black;
  return out;
}

}  // namespace lowlux::isp
