#include "isp/merge/stars/match_stars.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>

#include "isp/merge/stars/consensus.h"

namespace lowlux::merge {
namespace {

constexpr double significance_z = 3.09;      // normal quantile of 0.999
constexpr double max_deviation = 5;          // standard deviations of one axis
constexpr double median_chi_square = 1.386;  // of two degrees of freedom
constexpr int max_match_rounds = 10;
constexpr double max_rival = 0.8;  // logarithm of its false match probability over that of the best

std::vector<Point> places_of(const std::vector<Star>& stars) {
  std::vector<Point> out;
  out.reserve(stars.size());
  for (const Star& star : stars) out.push_back({star.x_px.value, star.y_px.value});
  return out;
}

double variance_of(const Star& star) {
  const double x = star.x_px.standard_error, y = star.y_px.standard_error;
  return (x * x + y * y) / 2;
}

/// Returns the quantile of 0.999 of chi-square (Wilson and Hilferty, PNAS 17, 1931).
double significant_chi_square(int degrees) {
  const double part = 2.0 / (9 * degrees);
  return degrees * std::pow(1 - part + significance_z * std::sqrt(part), 3);
}

struct ChosenModel {
  TransformFit fit;
  double chi_square_ratio = 0;
};

/// Fits the smallest model that the pairs do not contradict: step 3 of match_stars.h.
std::optional<ChosenModel> choose_model(const std::vector<StarPair>& pairs, const Point& centre, double unit_px) {
  std::vector<TransformFit> fits;
  const auto coordinates = 2 * static_cast<int>(pairs.size());
  for (const TransformModel model : transform_models) {
    if (coordinates < 2 * parameters_of(model) && model != TransformModel::similarity) break;
    std::optional<TransformFit> fit = fit_transform(model, pairs, centre, unit_px);
    if (fit) fits.push_back(*std::move(fit));
  }
  if (fits.empty()) return std::nullopt;
  const auto degrees = [&](const TransformFit& fit) { return coordinates - parameters_of(fit.transform.model); };
  const TransformFit& largest = fits.back();
  const double ratio = std::max(1.0, largest.chi_square / std::max(degrees(largest), 1));
  // The lens model has one parameter more and extrapolates well: the choice of Akaike. Polynomials have to be needed.
  const bool is_radial = fits.size() > 1 && fits[0].chi_square - fits[1].chi_square > 2 * ratio;
  for (std::size_t k = is_radial ? 1 : 0; k < fits.size(); ++k) {
    if (k == 1 && !is_radial) continue;
    const int fewer = degrees(fits[k]) - degrees(largest);
    if (fewer > 0 && fits[k].chi_square - largest.chi_square > ratio * significant_chi_square(fewer)) continue;
    const double own = fits[k].chi_square / std::max(degrees(fits[k]), 1);
    return ChosenModel{std::move(fits[k]), own};
  }
  return std::nullopt;
}

/// Refines a consensus with the models.
class Refinement {
 public:
  Refinement(const StarField& reference, const StarField& frame)
      : reference_(reference),
        frame_(frame),
        places_(places_of(reference.stars)),
        grid_(places_of(frame.stars), 8),
        centre_{(reference.width - 1) / 2.0, (reference.height - 1) / 2.0},
        unit_px_(std::max({reference.width, reference.height, 2}) / 2.0) {}

  /// Returns whether a model could be fitted.
  bool run(const Consensus& consensus) {
    std::vector<Point> mapped;
    for (const Point& p : places_) mapped.push_back(consensus.similarity.at(p));
    std::vector<double> limits(places_.size(), 2 * consensus.radius_px);
    std::vector<IndexPair> found = pair_nearest(mapped, limits, grid_);
    for (int round = 0; round < max_match_rounds; ++round) {
      set_pairs(found);
      std::optional<ChosenModel> chosen = choose_model(pairs_, centre_, unit_px_);
      if (!chosen) return false;
      chosen_ = *std::move(chosen);
      const double limit = max_deviation * std::sqrt(std::max(1.0, median_ratio()));
      for (std::size_t k = 0; k < places_.size(); ++k) mapped[k] = chosen_.fit.transform.at(places_[k]);
      const std::vector<IndexPair> again = within(mapped, limit);
      if (again.size() < 2) return false;
      const bool same = again.size() == found.size() &&
                        std::equal(again.begin(), again.end(), found.begin(), [](const auto& a, const auto& b) {
                          return a.reference == b.reference && a.frame == b.frame;
                        });
      if (same) break;
      found = again;
    }
    return true;
  }

  StarMatch result() const {
    StarMatch out{.transform = chosen_.fit.transform, .matched = static_cast<int>(pairs_.size())};
    out.chi_square_ratio = chosen_.chi_square_ratio;
    for (double& covariance : out.transform.covariance) covariance *= std::max(1.0, out.chi_square_ratio);
    double squares = 0;
    for (const StarPair& pair : pairs_) squares += square_of(pair);
    out.rms_px = std::sqrt(squares / (2 * static_cast<double>(pairs_.size())));
    for (const Point& p : places_) {
      const Point q = out.transform.at(p);
      out.in_view += q.x >= 0 && q.y >= 0 && q.x <= frame_.width - 1 && q.y <= frame_.height - 1 ? 1 : 0;
    }
    return out;
  }

 private:
  void set_pairs(const std::vector<IndexPair>& found) {
    pairs_.clear();
    for (const IndexPair& pair : found) {
      const Star& first = reference_.stars[static_cast<std::size_t>(pair.reference)];
      const Star& second = frame_.stars[static_cast<std::size_t>(pair.frame)];
      pairs_.push_back({{first.x_px.value, first.y_px.value},
                        {second.x_px.value, second.y_px.value},
                        std::max(variance_of(first) + variance_of(second), 1e-8)});
    }
  }

  double square_of(const StarPair& pair) const {
    const Point p = chosen_.fit.transform.at(pair.reference);
    return (p.x - pair.frame.x) * (p.x - pair.frame.x) + (p.y - pair.frame.y) * (p.y - pair.frame.y);
  }

  /// Returns the ratio of the median squared deviation to that of normal errors.
  double median_ratio() const {
    std::vector<double> ratios;
    for (const StarPair& pair : pairs_) ratios.push_back(square_of(pair) / pair.variance_px2);
    const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
    std::nth_element(ratios.begin(), middle, ratios.end());
    return *middle / median_chi_square;
  }

  /// Pairs stars that are no further apart than so many standard deviations.
  std::vector<IndexPair> within(const std::vector<Point>& mapped, double limit) const {
    constexpr double search_px = 12;
    const std::vector<double> limits(mapped.size(), search_px);
    std::vector<IndexPair> out;
    for (const IndexPair& pair : pair_nearest(mapped, limits, grid_)) {
      const Star& other = frame_.stars[static_cast<std::size_t>(pair.frame)];
      const Point& p = mapped[static_cast<std::size_t>(pair.reference)];
      const double variance =
          variance_of(reference_.stars[static_cast<std::size_t>(pair.reference)]) + variance_of(other);
      const double distance = std::hypot(p.x - other.x_px.value, p.y - other.y_px.value);
      if (distance <= limit * std::sqrt(std::max(variance, 1e-8))) out.push_back(pair);
    }
    return out;
  }

  const StarField& reference_;
  const StarField& frame_;
  std::vector<Point> places_;
  PointGrid grid_;
  Point centre_;
  double unit_px_;
  std::vector<StarPair> pairs_;
  ChosenModel chosen_;
};

tl::unexpected<Error> too_few(const StarField& reference, const StarField& frame, int matched) {
  return fail(
      ErrorCode::insufficient,
      fmt::format("{} of {} stars match the {} of the reference: too few to determine the displacement of the frame",
                  matched, frame.stars.size(), reference.stars.size()));
}

}  // namespace

Result<StarMatch> match_stars(const StarField& reference, const StarField& frame, const MatchOptions& options) {
  assert(options.max_scale_change >= 0 && options.max_scale_change <= 0.1);
  assert(options.max_false_match_probability >= 1e-30 && options.max_false_match_probability <= 0.1);
  const PointLists lists{places_of(reference.stars), places_of(frame.stars), static_cast<double>(frame.width),
                         static_cast<double>(frame.height)};
  if (lists.reference.size() < 3 || lists.frame.size() < 3) return too_few(reference, frame, 0);
  const double limit = std::log10(options.max_false_match_probability);
  const std::optional<Consensus> consensus = find_consensus(lists, options.max_scale_change, limit);
  if (!consensus || consensus->log10_false_probability > limit)
    return too_few(reference, frame, consensus ? consensus->matched : 0);
  if (consensus->log10_rival_probability < max_rival * consensus->log10_false_probability) {
    return fail(ErrorCode::insufficient,
                fmt::format("{} of {} stars match the reference at one displacement, and about as many at another: the "
                            "pattern of stars repeats and does not determine the displacement",
                            consensus->matched, frame.stars.size()));
  }
  Refinement refinement(reference, frame);
  if (!refinement.run(*consensus)) return too_few(reference, frame, consensus->matched);
  StarMatch out = refinement.result();
  out.log10_false_match_probability = consensus->log10_false_probability;
  return out;
}

}  // namespace lowlux::merge
