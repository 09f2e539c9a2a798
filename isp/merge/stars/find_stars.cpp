#include "isp/merge/stars/find_stars.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "isp/merge/stars/background.h"
#include "isp/merge/stars/candidates.h"
#include "isp/merge/stars/psf_fit.h"

namespace lowlux::merge {
namespace {

constexpr std::size_t candidates_per_star = 3;  // so many are fitted at most for each star that is asked for
constexpr double min_rest_snr = 3;              // without the brightest site
constexpr double min_fit_significance = 4;      // with the local background, which is noisier
constexpr int candidates_of_task = 16;
constexpr double bright_snr = 10;  // of stars that show the width of the PSF
constexpr int max_bright = 100;
constexpr int min_bright = 5;

enum class Verdict : std::uint8_t { star, single_site, extended, sharp, missing };

struct Judged {
  Verdict verdict = Verdict::extended;
  Star star;
};

/// Judges candidates one by one.
struct Judge {
  const FrameView& frame;
  const Background& background;
  double psf_sigma_px;
  std::vector<float> taps;

  /// Returns the snr that is left of a candidate without its brightest site.
  double rest_snr(const Candidate& candidate, const PerSite<double>& level) const {
    const int radius = static_cast<int>(taps.size()) - 1;
    double sum = 0, norm = 0, brightest = -1e30, part = 0, part_norm = 0;
    for (int j = -radius; j <= radius; ++j) {
      for (int i = -radius; i <= radius; ++i) {
        const int x = candidate.x + i, y = candidate.y + j;
        if (x < 0 || y < 0 || x >= frame.signal_e.width || y >= frame.signal_e.height) continue;
        const auto signal = static_cast<double>(frame.signal_e.at(x, y));
        if (std::isnan(signal)) continue;
        const auto s = static_cast<std::size_t>(site_of(x, y));
        const double variance = std::max(std::max(level[s], 0.0) + frame.variance_e2[s], min_variance_e2);
        const double z = (signal - level[s]) / std::sqrt(variance);
        const double tap = static_cast<double>(taps[static_cast<std::size_t>(std::abs(i))]) *
                           static_cast<double>(taps[static_cast<std::size_t>(std::abs(j))]);
        sum += tap * z;
        norm += tap * tap;
        if (std::max(std::abs(i), std::abs(j)) <= 1 && z > brightest) {
          brightest = z;
          part = tap * z;
          part_norm = tap * tap;
        }
      }
    }
    return norm > part_norm ? (sum - part) / std::sqrt(norm - part_norm) : 0;
  }

  Judged judge(const Candidate& candidate) const {
    const PerSite<double> level = level_at(background, candidate.x, candidate.y);
    if (rest_snr(candidate, level) < min_rest_snr) return {Verdict::single_site, {}};
    const std::optional<PsfFit> fit = fit_psf(frame, {.x_px = candidate.x + static_cast<double>(candidate.dx_px),
                                                      .y_px = candidate.y + static_cast<double>(candidate.dy_px),
                                                      .sigma_px = psf_sigma_px,
                                                      .background_e = level});
    if (!fit) return {Verdict::missing, {}};
    if (fit->chi_square > fit->chi_square_limit || fit->significance < min_fit_significance)
      return {Verdict::extended, {}};
    Judged out{Verdict::star, {}};
    out.star.x_px = {fit->x_px, std::sqrt(fit->covariance[0][0])};
    out.star.y_px = {fit->y_px, std::sqrt(fit->covariance[1][1])};
    out.star.sigma_px = {fit->sigma_px, fit->sigma_px * std::sqrt(fit->covariance[2][2])};
    for (std::size_t c = 0; c < 3; ++c) out.star.flux_e[c] = {fit->flux_e[c], std::sqrt(fit->flux_variance_e2[c])};
    out.star.snr = static_cast<double>(candidate.snr);
    const bool inside = fit->x_px >= 0 && fit->y_px >= 0 && fit->x_px <= frame.signal_e.width - 1 &&
                        fit->y_px <= frame.signal_e.height - 1;
    if (!inside) out.verdict = Verdict::missing;
    return out;
  }
};

/// Returns the median width of the stars.
double median_sigma(const std::vector<Judged>& judged) {
  std::vector<double> sigmas;
  for (const Judged& one : judged) {
    if (one.verdict == Verdict::star) sigmas.push_back(one.star.sigma_px.value);
  }
  if (sigmas.empty()) return 0;
  const auto middle = sigmas.begin() + static_cast<std::ptrdiff_t>(sigmas.size() / 2);
  std::nth_element(sigmas.begin(), middle, sigmas.end());
  return *middle;
}

void judge_width(double psf_sigma_px, Judged& one) {
  const Estimate& sigma = one.star.sigma_px;
  const double doubt = 3 * sigma.standard_error;
  if (one.verdict != Verdict::star) return;
  if (sigma.value - doubt > 2 * psf_sigma_px) one.verdict = Verdict::extended;
  if (sigma.value + doubt < psf_sigma_px / 2) one.verdict = Verdict::sharp;
}

/// Returns whether a star of higher snr was measured at the same place.
bool is_repeated(const Star& star, const std::vector<Star>& before, double distance_px) {
  return std::any_of(before.begin(), before.end(), [&](const Star& other) {
    const double dx = star.x_px.value - other.x_px.value, dy = star.y_px.value - other.y_px.value;
    return dx * dx + dy * dy < distance_px * distance_px;
  });
}

/// Judges candidates first .. last - 1.
std::vector<Judged> judge_all(const Judge& judge, const std::vector<Candidate>& candidates, std::size_t first,
                              std::size_t last, Executor& executor) {
  std::vector<Judged> judged(last - first);
  const int tasks = (static_cast<int>(judged.size()) + candidates_of_task - 1) / candidates_of_task;
  for_each_index(executor, tasks, [&](int task) {
    const std::size_t begin = static_cast<std::size_t>(task) * candidates_of_task;
    for (std::size_t k = begin; k < std::min(begin + candidates_of_task, judged.size()); ++k)
      judged[k] = judge.judge(candidates[first + k]);
  });
  return judged;
}

/// Returns the width of the brightest stars, or what was expected where there are few.
double measure_width(const Judge& judge, const std::vector<Candidate>& candidates, Executor& executor) {
  std::size_t bright = 0;
  while (bright < std::min<std::size_t>(candidates.size(), max_bright) &&
         static_cast<double>(candidates[bright].snr) > bright_snr)
    ++bright;
  const std::vector<Judged> judged = judge_all(judge, candidates, 0, bright, executor);
  const auto stars =
      std::count_if(judged.begin(), judged.end(), [](const Judged& j) { return j.verdict == Verdict::star; });
  return stars < min_bright ? judge.psf_sigma_px : std::clamp(median_sigma(judged), 0.5, 4.0);
}

void count(Verdict verdict, NotStars& counts) {
  switch (verdict) {
    case Verdict::star:
      break;
    case Verdict::single_site:
      ++counts.single_sites;
      break;
    case Verdict::extended:
      ++counts.extended;
      break;
    case Verdict::sharp:
      ++counts.sharp;
      break;
    case Verdict::missing:
      ++counts.missing;
      break;
  }
}

}  // namespace

StarField find_stars(const FrameView& frame, const StarOptions& options, Executor& executor) {
  assert(options.psf_sigma_px >= 0.5 && options.psf_sigma_px <= 4 && options.max_stars >= 1);
  assert(options.false_stars_per_mp >= 1e-3 && options.false_stars_per_mp <= 1e3);
  StarField out{.width = frame.signal_e.width, .height = frame.signal_e.height};
  const std::optional<Background> background = measure_background(frame, options.psf_sigma_px, executor);
  if (!background) return out;
  out.background_e = median_level(*background);
  const std::vector<Candidate> candidates =
      find_candidates({frame, *background, options.psf_sigma_px, options.false_stars_per_mp * 1e-6}, executor);
  Judge judge{frame, *background, options.psf_sigma_px, matched_filter_taps(options.psf_sigma_px)};
  for (int round = 0; round < 2; ++round) judge.psf_sigma_px = measure_width(judge, candidates, executor);
  const auto batch = static_cast<std::size_t>(options.max_stars);
  std::vector<Judged> judged;
  std::size_t stars = 0, last = 0;
  while (stars < batch && last < std::min(candidates.size(), candidates_per_star * batch)) {
    const std::size_t first = std::exchange(last, std::min(last + batch, candidates.size()));
    for (Judged& one : judge_all(judge, candidates, first, last, executor)) {
      stars += one.verdict == Verdict::star ? 1 : 0;
      judged.push_back(one);
    }
  }
  out.psf_sigma_px = median_sigma(judged);
  for (Judged& one : judged) {
    judge_width(out.psf_sigma_px, one);
    count(one.verdict, out.not_stars);
    if (one.verdict != Verdict::star || out.stars.size() == batch) continue;
    if (!is_repeated(one.star, out.stars, out.psf_sigma_px)) out.stars.push_back(one.star);
  }
  return out;
}

}  // namespace lowlux::merge
