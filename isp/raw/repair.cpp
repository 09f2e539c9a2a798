#include "isp/raw/repair.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>

#include "isp/raw/black_point.h"
#include "isp/raw/defect_rows.h"

namespace lowlux::isp {
namespace {

constexpr double range_factor = 4;
constexpr double noise_factor = 8;
constexpr double floor_of_white = 0.01;
constexpr double known_noise_factor = 5, detail_factor = 12;
// For fewer neighbours, which show less of the detail of the scene, and less of a star.
constexpr double border_factor = 2, border_shared = 0.5;
constexpr double noise_range = 4.5;  // range of eight normal deviates that one in a hundred exceeds
constexpr double max_shared = 0.1, max_shared_green = 0.07;
// For a centred Gaussian of 1.5 pixels FWHM: exp(-1/2 / 0.637^2) less a quarter of it for the neighbour across. At
// green sites the mean of red and blue counts, to which cameras respond half as strongly.
constexpr double star_fraction = 0.2187, star_fraction_green = 0.11;
constexpr double shared_deviation = 0.44;  // of the neighbours' mean excess, in standard deviations of a pixel
constexpr double certain = 3.5;            // required margin in standard deviations

template <class Sample>
struct Neighbours {
  Sample low;
  Sample high;
};

// Returns the coordinate at a distance, or beyond a border the one at the same distance on the other side, which has
// the same colour in a Bayer mosaic.
int across(int at, int distance, int size) {
  const int there = at + distance;
  return there >= 0 && there < size ? there : at - distance;
}

template <class Sample>
Neighbours<Sample> eight_same_colour(const PlaneView<const Sample>& dn, int x, int y) {
  const int left = across(x, -2, dn.width), right = across(x, 2, dn.width);
  const Sample* above = dn.row(across(y, -2, dn.height));
  const Sample* here = dn.row(y);
  const Sample* below = dn.row(across(y, 2, dn.height));
  const std::array<Sample, 8> v{above[left], above[x],    above[right], here[left],
                                here[right], below[left], below[x],     below[right]};
  return {*std::min_element(v.begin(), v.end()), *std::max_element(v.begin(), v.end())};
}

// Returns the difference of a pixel from the median of its four nearest neighbours of the same colour that lie inside
// the plane; a star next to them reaches one or two of the neighbours.
template <class Sample>
double excess(const PlaneView<const Sample>& dn, int x, int y) {
  double sum = 0, low = INFINITY, high = -INFINITY;
  int n = 0;
  for (const auto [dx, dy] : {std::array{-2, 0}, {2, 0}, {0, -2}, {0, 2}}) {
    if (x + dx < 0 || x + dx >= dn.width || y + dy < 0 || y + dy >= dn.height) continue;
    const double value = dn.at(x + dx, y + dy);
    sum += value;
    low = std::min(low, value);
    high = std::max(high, value);
    ++n;
  }
  if (n == 0) return 0;
  const double median = n > 2 ? (sum - low - high) / (n - 2) : sum / n;
  return dn.at(x, y) - median;
}

// Returns the direct neighbours' mean excess over their same-colour neighbours.
template <class Sample>
double shared_excess(const PlaneView<const Sample>& dn, int x, int y) {
  const int left = across(x, -1, dn.width), right = across(x, 1, dn.width);
  const int above = across(y, -1, dn.height), below = across(y, 1, dn.height);
  return (excess(dn, left, y) + excess(dn, right, y) + excess(dn, x, above) + excess(dn, x, below)) / 4;
}

// Data of the defect test that depends on the frame, not on the pixel.
template <class Sample>
struct Criterion {
  PlaneView<const Sample> dn;
  BayerPhase phase;
  PerSite<double> black_dn;
  DefectNoise noise;
  double floor_dn;  // minimum distance from the neighbours

  double variance(int x, int y, double dn_value) const {
    const double level = std::max(0.0, dn_value - black_dn[site_of(x, y)]);
    return static_cast<double>(noise.ratio.at(x, y)) *
           (noise.black_std_dn * noise.black_std_dn + noise.shot_dn * level);
  }
  bool noise_is_known() const { return noise.shot_dn > 0 && noise.black_std_dn > 0; }
};

template <class Sample>
double min_distance(const Criterion<Sample>& judge, int x, int y, const Neighbours<Sample>& n, double nearer) {
  const double range = static_cast<double>(n.high) - n.low;
  if (!judge.noise_is_known()) return range_factor * range + judge.floor_dn;
  const double sigma = std::sqrt(judge.variance(x, y, nearer));
  return detail_factor * std::max(0.0, range - noise_range * sigma) + known_noise_factor * sigma;
}

template <class Sample>
double most_shared(const Criterion<Sample>& judge, int x, int y, double own) {
  const bool green = colour_at(judge.phase, x, y) == CfaColour::green;
  const double cap = (green ? max_shared_green : max_shared) * own;
  if (!judge.noise_is_known()) return cap;
  double variance = 0;
  for (const auto [dx, dy] : {std::array{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
    const int u = across(x, dx, judge.dn.width), v = across(y, dy, judge.dn.height);
    variance += judge.variance(u, v, judge.dn.at(u, v)) / 4;
  }
  const double scatter = shared_deviation * std::sqrt(variance);
  return std::min(cap, (green ? star_fraction_green : star_fraction) * own - certain * scatter);
}

template <class Sample>
bool is_defect(const Criterion<Sample>& judge, int x, int y) {
  const Neighbours<Sample> n = eight_same_colour(judge.dn, x, y);
  const double value = judge.dn.at(x, y);
  const bool hot = value > n.high;
  const double beyond = hot ? value - n.high : n.low - value;
  const bool is_inside = x >= 2 && y >= 2 && x < judge.dn.width - 2 && y < judge.dn.height - 2;
  const double least = min_distance(judge, x, y, n, hot ? n.high : n.low);
  if (beyond <= (is_inside ? 1 : border_factor) * least) return false;
  const double own = excess(judge.dn, x, y);
  const double limit = most_shared(judge, x, y, (is_inside ? 1 : border_shared) * std::fabs(own));
  return shared_excess(judge.dn, x, y) * (own > 0 ? 1 : -1) < limit;
}

// Returns the smallest noise ratio of pixels x .. x + count - 1 of a row.
double min_ratio(const NoiseRatioView& ratio, int x, int count, int y) {
  float least = ratio.at(x + count - 1, y);
  if (ratio.is_one()) return 1;
  for (int i = 0; i < count; i += ratio.block_px) least = std::min(least, ratio.at(x + i, y));
  return static_cast<double>(least);
}

// Returns lower bounds on the distances that is_defect() requires, with a margin for rounding, for `count` pixels.
template <class Sample>
defect_rows::Bounds min_bounds(const Criterion<Sample>& judge, int x, int count, int y) {
  constexpr double nearly = 0.999;
  defect_rows::Bounds bounds;
  if (judge.noise_is_known()) {
    const double squared = nearly * known_noise_factor * known_noise_factor * min_ratio(judge.noise.ratio, x, count, y);
    bounds.black_dn = {static_cast<float>(judge.black_dn[site_of(x, y)]),
                       static_cast<float>(judge.black_dn[site_of(x + 1, y)])};
    bounds.variance_dn2 = static_cast<float>(squared * judge.noise.black_std_dn * judge.noise.black_std_dn);
    bounds.shot_dn = static_cast<float>(squared * judge.noise.shot_dn);
  } else {
    bounds.range_factor = static_cast<float>(nearly * range_factor);
    bounds.floor_dn = static_cast<float>(nearly * judge.floor_dn);
  }
  return bounds;
}

// Tests pixels of a row near a border, from one to below another.
template <class Sample>
void judge_border(const Criterion<Sample>& judge, int first, int last, int y, std::vector<Pixel>& found) {
  for (int x = first; x < last; ++x) {
    if (is_defect(judge, x, y)) found.push_back({x, y});
  }
}

// Tests a run of the row with the fast kernel first, so that the slower exact test runs on few pixels.
template <class Sample>
void judge_row(const Criterion<Sample>& judge, int y, std::vector<Pixel>& found) {
  std::array<std::uint8_t, 512> marked;
  constexpr int most = marked.size();
  for (int first = 2; first < judge.dn.width - 2; first += most) {
    const int count = std::min(most, judge.dn.width - 2 - first);
    const defect_rows::Bounds bounds = min_bounds(judge, first, count, y);
    const defect_rows::Rows<Sample> rows{judge.dn.row(y - 2) + first, judge.dn.row(y) + first,
                                         judge.dn.row(y + 2) + first};
    defect_rows::mark_outliers(rows, count, bounds, marked.data());
    const std::uint8_t *const begin = marked.data(), *const end = begin + count;
    for (const std::uint8_t* at = std::find(begin, end, 1); at != end; at = std::find(at + 1, end, 1)) {
      const int x = first + static_cast<int>(at - begin);
      if (is_defect(judge, x, y)) found.push_back({x, y});
    }
  }
}

bool before(const Pixel& a, const Pixel& b) { return a.y != b.y ? a.y < b.y : a.x < b.x; }

template <class Sample>
std::vector<Pixel> judge_all(const Criterion<Sample>& judge, Executor& executor) {
  std::vector<std::vector<Pixel>> found(executor.width());
  for_each_band(executor, judge.dn.height, [&](RowBand band, int index) {
    const int width = judge.dn.width, height = judge.dn.height;
    for (int y = band.first; y < band.last; ++y) {
      if (y < 2 || y >= height - 2) {
        judge_border(judge, 0, width, y, found[index]);
        continue;
      }
      judge_border(judge, 0, 2, y, found[index]);
      judge_row(judge, y, found[index]);
      judge_border(judge, width - 2, width, y, found[index]);
    }
  });
  std::vector<Pixel> all;
  for (const auto& part : found) all.insert(all.end(), part.begin(), part.end());
  return all;
}

}  // namespace

std::vector<Pixel> find_defects(const RawDn& raw, const BlackPoint& black, const DefectNoise& noise,
                                Executor& executor) {
  const Rect& a = raw.active;
  if (raw.layout != SensorLayout::bayer || a.width < 5 || a.height < 5) return {};
  double range = 0;
  for (int site = 0; site < 4; ++site) range = std::max(range, white_at(raw, site) - black.pedestal_dn[site]);
  return with_samples(raw, [&]<class Sample>(PlaneView<const Sample> readout) {
    Criterion<Sample> judge{readout.crop(a.x, a.y, a.width, a.height), raw.phase, black.pedestal_dn, noise,
                            noise_factor * noise.black_std_dn + floor_of_white * range};
    if (judge.noise_is_known()) judge.floor_dn = known_noise_factor * noise.black_std_dn;
    return judge_all(judge, executor);
  });
}

std::optional<std::vector<Pixel>> named_defects(const RawDn& raw, const std::vector<DefectRect>& defects) {
  std::int64_t area = 0;
  for (const DefectRect& d : defects) {
    const std::int64_t width = std::min(d.x + d.width, raw.active.width) - std::max(d.x, 0);
    const std::int64_t height = std::min(d.y + d.height, raw.active.height) - std::max(d.y, 0);
    area += std::max<std::int64_t>(width, 0) * std::max<std::int64_t>(height, 0);
    if (area * max_named_fraction > std::int64_t{raw.active.width} * raw.active.height) return std::nullopt;
  }
  std::vector<Pixel> pixels;
  for (const DefectRect& d : defects) {
    const int x_end = std::min(d.x + d.width, raw.active.width);
    const int y_end = std::min(d.y + d.height, raw.active.height);
    for (int y = std::max(d.y, 0); y < y_end; ++y) {
      for (int x = std::max(d.x, 0); x < x_end; ++x) pixels.push_back({x, y});
    }
  }
  std::sort(pixels.begin(), pixels.end(), before);
  pixels.erase(std::unique(pixels.begin(), pixels.end()), pixels.end());
  return pixels;
}

std::vector<Pixel> merged(const std::vector<Pixel>& a, const std::vector<Pixel>& b) {
  std::vector<Pixel> all;
  all.reserve(a.size() + b.size());
  std::set_union(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(all), before);
  return all;
}

void repair(PlaneView<float> mosaic, const std::vector<Pixel>& defects, int step) { repair(mosaic, {}, defects, step); }

void repair(PlaneView<float> piece, const Pixel& corner, const std::vector<Pixel>& defects, int step) {
  const auto inside = [&](int x, int y) { return x >= 0 && x < piece.width && y >= 0 && y < piece.height; };
  const auto sound = [&](int x, int y) {
    return inside(x, y) &&
           !std::binary_search(defects.begin(), defects.end(), Pixel{corner.x + x, corner.y + y}, before);
  };
  for (auto at = std::lower_bound(defects.begin(), defects.end(), corner, before);
       at != defects.end() && at->y - corner.y < piece.height; ++at) {
    const int x = at->x - corner.x, y = at->y - corner.y;
    if (!inside(x, y)) continue;
    float best_difference = INFINITY;
    float best = piece.at(x, y);
    float sum = 0;
    int n = 0;
    for (const auto [dx, dy] : {std::array{step, 0}, {0, step}}) {
      const bool low = sound(x - dx, y - dy), high = sound(x + dx, y + dy);
      const float a = low ? piece.at(x - dx, y - dy) : 0.0f;
      const float b = high ? piece.at(x + dx, y + dy) : 0.0f;
      sum += a + b;
      n += low + high;
      if (low && high && std::fabs(a - b) < best_difference) {
        best_difference = std::fabs(a - b);
        best = (a + b) / 2;
      }
    }
    if (best_difference == INFINITY && n > 0) best = sum / static_cast<float>(n);
    piece.at(x, y) = best;
  }
}

}  // namespace lowlux::isp
