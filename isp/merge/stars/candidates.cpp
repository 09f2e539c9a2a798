#include "isp/merge/stars/candidates.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <tuple>

#include "isp/base/cfa.h"
#include "isp/merge/stars/detection_limit.h"
#include "isp/merge/stars/star_rows.h"

namespace lowlux::merge {
namespace {

constexpr int max_gap_px = 12;     // of a saturated core
constexpr float bright_score = 3;  // of the sites next to it
constexpr int border_px = 2;       // candidates are no closer to the border
constexpr int directions = 16;     // in which the surroundings are examined
constexpr int max_bright_directions = 5;

/// Limits of the matched filter at levels of background in geometric steps.
class Limits {
 public:
  Limits(const CandidateSearch& search, const std::vector<float>& taps) {
    const PerSite<double> median = median_level(search.background);
    double lowest = 1e9, highest = 0;
    for (const PerSite<float>& level : search.background.level_e) {
      lowest = std::min(lowest, mean_of_sites(level));
      highest = std::max(highest, mean_of_sites(level));
    }
    lowest = std::clamp(lowest, 1e-4, 1e7);
    highest = std::clamp(highest, lowest, 1e7);
    log_first_ = std::log(lowest);
    log_step_ = std::max(std::log(highest / lowest) / (steps - 1), 1e-6);
    const double centre = std::max(mean_of_sites(median), 1e-9);
    for (int i = 0; i < steps; ++i) {
      PerSite<double> level{};
      const double mean = std::exp(log_first_ + i * log_step_);
      for (std::size_t s = 0; s < 4; ++s) level[s] = mean * std::clamp(median[s] / centre, 0.0, 4.0);
      limit_[static_cast<std::size_t>(i)] = detection_limit(taps, level, search.frame.variance_e2, search.probability);
    }
  }

  double lowest() const { return *std::min_element(limit_.begin(), limit_.end()); }

  double at(const PerSite<double>& level) const {
    const double mean = std::max(mean_of_sites(level), 1e-4);
    const double place = std::clamp((std::log(mean) - log_first_) / log_step_, 0.0, steps - 1.0);
    const int i = std::min(static_cast<int>(place), steps - 2);
    const auto k = static_cast<std::size_t>(i);
    return limit_[k] + (place - i) * (limit_[k + 1] - limit_[k]);
  }

 private:
  static constexpr int steps = 17;
  double log_first_ = 0;
  double log_step_ = 1;
  std::array<double, steps> limit_{};
};

/// Rows of floats with padding on both sides, of which the last `kept` are held.
class RowRing {
 public:
  RowRing(int width, int kept)
      : stride_(static_cast<std::size_t>(width) + 2 * rows::row_padding),
        kept_(kept),
        values_(stride_ * static_cast<std::size_t>(kept), 0.0F) {}

  float* row(int y) {
    return values_.data() + stride_ * static_cast<std::size_t>((y % kept_ + kept_) % kept_) + rows::row_padding;
  }

 private:
  std::size_t stride_;
  int kept_;
  std::vector<float> values_;
};

/// Gives the gaps of saturated cores the score of their brighter side.
void fill_gaps(const float* signal, int width, float* score) {
  for (int x = 0; x < width; ++x) {
    if (!std::isnan(signal[x])) continue;
    int end = x;
    while (end < width && std::isnan(signal[end])) ++end;
    const float side = std::max(x > 0 ? score[x - 1] : 0.0F, end < width ? score[end] : 0.0F);
    if (end - x <= max_gap_px && side > bright_score) std::fill(score + x, score + end, side);
    x = end;
  }
}

/// Searches a band of rows.
class BandSearch {
 public:
  BandSearch(const CandidateSearch& search, const std::vector<float>& taps, const Limits& limits)
      : search_(search),
        taps_(taps),
        limits_(limits),
        width_(search.frame.signal_e.width),
        height_(search.frame.signal_e.height),
        radius_(static_cast<int>(taps.size()) - 1),
        around_(static_cast<int>(std::ceil(4 * search.psf_sigma_px))),
        scores_(width_, 2 * radius_ + 1),
        filtered_(width_, 2 * around_ + 1),
        vertical_(static_cast<std::size_t>(width_) + 2 * rows::row_padding, 0.0F),
        columns_(static_cast<std::size_t>(width_)) {
    for (std::vector<float>& nodes : nodes_) nodes.resize(search.background.column_px.size());
    for (const float column : search.background.column_px) node_px_.push_back(2 * static_cast<int>((column + 1) / 2));
    for (int i = 0; i < directions; ++i) {
      const double angle = 2 * std::numbers::pi * i / directions;
      direction_[static_cast<std::size_t>(i)] = {static_cast<int>(std::lround(around_ * std::cos(angle))),
                                                 static_cast<int>(std::lround(around_ * std::sin(angle)))};
    }
  }

  void run(RowBand band, std::vector<Candidate>& out) {
    int scored = band.first - around_ - radius_, filtered = band.first - around_;
    for (int y = band.first; y < band.last; ++y) {
      for (; filtered <= y + around_; ++filtered) {
        for (; scored <= filtered + radius_; ++scored) score(scored);
        filter(filtered);
      }
      collect(y, out);
    }
  }

 private:
  bool inside(int y) const { return y >= 0 && y < height_; }

  /// Interpolates level and 1 / standard deviation of one row at the nodes.
  void interpolate_nodes(int y) {
    const Background& background = search_.background;
    const std::vector<float>& rows_px = background.row_px;
    const int last = background.rows() - 1;
    const auto above = std::upper_bound(rows_px.begin(), rows_px.end(), static_cast<float>(y)) - rows_px.begin();
    const int j = std::clamp(static_cast<int>(above) - 1, 0, std::max(last - 1, 0)), next = std::min(j + 1, last);
    const float from = rows_px[static_cast<std::size_t>(j)];
    const float distance = next == j ? 1.0F : rows_px[static_cast<std::size_t>(next)] - from;
    const float weight = next == j ? 0.0F : (static_cast<float>(y) - from) / distance;
    const float inner = std::clamp(weight, 0.0F, 1.0F);
    for (int i = 0; i < background.columns(); ++i) {
      const auto upper = static_cast<std::size_t>(j) * background.columns() + i;
      const auto lower = static_cast<std::size_t>(next) * background.columns() + i;
      for (std::size_t parity = 0; parity < 2; ++parity) {
        const std::size_t s = 2 * (y & 1) + parity;
        const float level = background.level_e[upper][s], per_std = background.per_std[upper][s];
        nodes_[parity][static_cast<std::size_t>(i)] = level + weight * (background.level_e[lower][s] - level);
        nodes_[2 + parity][static_cast<std::size_t>(i)] = per_std + inner * (background.per_std[lower][s] - per_std);
      }
    }
  }

  void score(int y) {
    float* const score = scores_.row(y);
    if (!inside(y)) {
      std::fill_n(score - rows::row_padding, width_ + 2 * rows::row_padding, 0.0F);
      return;
    }
    interpolate_nodes(y);
    const float* const signal = search_.frame.signal_e.row(y);
    const bool missing = rows::score_row({.signal_e = signal,
                                          .width = width_,
                                          .nodes = static_cast<int>(node_px_.size()),
                                          .node_px = node_px_.data(),
                                          .level_e = {nodes_[0].data(), nodes_[1].data()},
                                          .per_std = {nodes_[2].data(), nodes_[3].data()},
                                          .score = score});
    if (missing) fill_gaps(signal, width_, score);
  }

  void filter(int y) {
    std::array<const float*, 64> around{};
    for (int j = 0; j <= 2 * radius_; ++j) around[static_cast<std::size_t>(j)] = scores_.row(y - radius_ + j);
    float* const out = filtered_.row(y);
    if (!inside(y)) {
      std::fill_n(out, width_, 0.0F);
      return;
    }
    rows::filter_row({.rows = around.data(),
                      .radius = radius_,
                      .taps = taps_.data(),
                      .width = width_,
                      .vertical = vertical_.data() + rows::row_padding,
                      .out = out});
  }

  bool is_peak(int x, int y, float value) {
    for (int j = -1; j <= 1; ++j) {
      const float* const row = filtered_.row(y + j);
      for (int i = -1; i <= 1; ++i) {
        if (i == 0 && j == 0) continue;
        const bool before = j < 0 || (j == 0 && i < 0);
        if (row[x + i] > value || (before && row[x + i] == value)) return false;
      }
    }
    return true;
  }

  /// Returns whether little around is nearly as bright: edges and texture are, stars are not.
  bool is_alone(int x, int y, float value) {
    const float limit = 0.3F * value + 2.5F;
    int bright = 0;
    for (const auto& [dx, dy] : direction_) {
      if (x + dx >= 0 && x + dx < width_ && filtered_.row(y + dy)[x + dx] > limit) ++bright;
    }
    return bright <= max_bright_directions;
  }

  void collect(int y, std::vector<Candidate>& out) {
    if (y < border_px || y >= height_ - border_px) return;
    const float* const row = filtered_.row(y);
    const int found = rows::bright_columns(row, width_, static_cast<float>(limits_.lowest()), columns_.data());
    for (int k = 0; k < found; ++k) {
      const int x = columns_[static_cast<std::size_t>(k)];
      if (x < border_px || x >= width_ - border_px || !is_peak(x, y, row[x]) || !is_alone(x, y, row[x])) continue;
      if (static_cast<double>(row[x]) <= limits_.at(level_at(search_.background, x, y))) continue;
      const auto vertex = [&](float before, float after) {
        const float curvature = 2 * row[x] - before - after;
        return curvature > 0 ? (after - before) / (2 * curvature) : 0.0F;
      };
      out.push_back(
          {x, y, vertex(row[x - 1], row[x + 1]), vertex(filtered_.row(y - 1)[x], filtered_.row(y + 1)[x]), row[x]});
    }
  }

  const CandidateSearch& search_;
  const std::vector<float>& taps_;
  const Limits& limits_;
  int width_;
  int height_;
  int radius_;
  int around_;
  RowRing scores_;
  RowRing filtered_;
  std::vector<float> vertical_;
  std::vector<std::int32_t> columns_;
  std::vector<std::int32_t> node_px_;
  std::array<std::vector<float>, 4> nodes_;  // level of even and odd columns, 1 / standard deviation of both
  std::array<std::array<int, 2>, directions> direction_{};
};

}  // namespace

std::vector<float> matched_filter_taps(double psf_sigma_px) {
  std::vector<double> taps;
  double squares = 0;
  for (int i = 0; i <= std::max(2, static_cast<int>(std::ceil(3 * psf_sigma_px))); ++i) {
    const double scale = std::numbers::sqrt2 * psf_sigma_px;
    taps.push_back((std::erf((i + 0.5) / scale) - std::erf((i - 0.5) / scale)) / 2);
    squares += (i == 0 ? 1 : 2) * taps.back() * taps.back();
  }
  std::vector<float> out(taps.size());
  std::transform(taps.begin(), taps.end(), out.begin(),
                 [&](double tap) { return static_cast<float>(tap / std::sqrt(squares)); });
  return out;
}

std::vector<Candidate> find_candidates(const CandidateSearch& search, Executor& executor) {
  const std::vector<float> taps = matched_filter_taps(search.psf_sigma_px);
  const Limits limits(search, taps);
  std::vector<std::vector<Candidate>> found(static_cast<std::size_t>(executor.width()));
  for_each_band(executor, search.frame.signal_e.height, [&](RowBand band, int index) {
    BandSearch(search, taps, limits).run(band, found[static_cast<std::size_t>(index)]);
  });
  std::vector<Candidate> out;
  for (const std::vector<Candidate>& band : found) out.insert(out.end(), band.begin(), band.end());
  std::sort(out.begin(), out.end(), [](const Candidate& a, const Candidate& b) {
    return std::tuple(-a.snr, a.y, a.x) < std::tuple(-b.snr, b.y, b.x);
  });
  return out;
}

}  // namespace lowlux::merge
