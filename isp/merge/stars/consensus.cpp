#include "isp/merge/stars/consensus.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "isp/merge/stars/triangles.h"

namespace lowlux::merge {
namespace {

constexpr std::array<std::size_t, 4> depths{25, 70, 200, 500};  // numbers of the brightest stars
constexpr std::array<double, 6> radii_px{0.25, 0.5, 1, 2, 4, 8};
constexpr double around_px = 24;  // where the density of stars is counted
constexpr double max_start_radius_px = 12;
constexpr int min_near = 12;                  // stars near a triangle, of which more than its own have to agree
constexpr std::size_t max_hypotheses = 4000;  // tried at each depth
constexpr double same_px = 16;                // similarities that differ by less anywhere are the same
constexpr double number_of_tests = depths.size() * radii_px.size() * 2;

/// Returns log10 P(binomial(n, q) >= m).
double log10_binomial_tail(int n, double q, int m) {
  if (m <= 0) return 0;
  if (m > n) return -1e3;
  double sum = 0;  // sum of terms relative to the first
  const auto log_factorial = [](int k) {
    int sign = 0;  // sign of the gamma function: lgamma_r is the thread-safe form
    return ::lgamma_r(k + 1.0, &sign);
  };
  const double first =
      log_factorial(n) - log_factorial(m) - log_factorial(n - m) + m * std::log(q) + (n - m) * std::log1p(-q);
  double term = 1;
  for (int k = m; k <= n; ++k) {
    sum += term;
    term *= (n - k) / (k + 1.0) * q / (1 - q);
    if (term < 1e-12 * sum) break;
  }
  return std::min(0.0, (first + std::log(sum)) / std::numbers::ln10);
}

/// Two lists with a grid of the second.
struct PointScene {
  const std::vector<Point>& reference;
  const std::vector<Point>& frame;
  double width;
  double height;
  PointGrid grid;

  PointScene(const PointLists& lists, const std::vector<Point>& of_reference, const std::vector<Point>& of_frame)
      : reference(of_reference),
        frame(of_frame),
        width(lists.frame_width),
        height(lists.frame_height),
        grid(of_frame, std::max(8.0, std::sqrt(width * height / static_cast<double>(of_frame.size() + 1)) / 2)) {}

  bool in_view(const Point& p) const { return p.x >= -0.5 && p.y >= -0.5 && p.x < width && p.y < height; }
};

/// Returns the log10 of the expected number of chance similarities that as many stars agree with.
Consensus weigh(const PointScene& scene, const Similarity& similarity, double log10_hypotheses) {
  std::vector<Point> places;
  for (const Point& p : scene.reference) {
    const Point place = similarity.at(p);
    if (scene.in_view(place)) places.push_back(place);
  }
  Consensus best{.similarity = similarity, .in_view = static_cast<int>(places.size())};
  double around = 0;
  for (const Point& place : places) around += scene.grid.count(place, around_px);
  for (const double radius : radii_px) {
    const std::vector<double> limits(places.size(), radius);
    const int matched = static_cast<int>(pair_nearest(places, limits, scene.grid).size());
    const double area =
        std::numbers::pi * (around_px * around_px - radius * radius) * static_cast<double>(places.size());
    const double overall = static_cast<double>(scene.frame.size()) / (scene.width * scene.height);
    const double density = std::max(overall, (around - matched) / std::max(area, 1.0));
    const double q = std::min(-std::expm1(-density * std::numbers::pi * radius * radius), 0.5);
    const double found = log10_hypotheses + log10_binomial_tail(best.in_view - 2, q, matched - 2);
    if (found >= best.log10_false_probability && best.matched > 0) continue;
    best.log10_false_probability = found;
    best.matched = matched;
    best.radius_px = radius;
  }
  return best;
}

/// A pair of triangles as a start: a similarity is trusted within a distance of some sizes of the triangle.
struct TriangleStart {
  std::vector<StarPair> pairs;
  Point centre;
  double size = 0;

  TriangleStart(const PointScene& scene, const TrianglePair& triangle) {
    for (std::size_t i = 0; i < 3; ++i) {
      const Point& p = scene.reference[static_cast<std::size_t>(triangle.first[i])];
      pairs.push_back({p, scene.frame[static_cast<std::size_t>(triangle.second[i])]});
      centre = {centre.x + p.x / 3, centre.y + p.y / 3};
    }
    for (const StarPair& pair : pairs) size += std::hypot(pair.reference.x - centre.x, pair.reference.y - centre.y) / 3;
  }

  /// Returns how far a star may be from its place [px]; 0 far away.
  double radius_px(const Point& reference) const {
    const double radius = 2 + 2 * std::hypot(reference.x - centre.x, reference.y - centre.y) / size;
    return radius < max_start_radius_px ? radius : 0;
  }

  bool agrees_with(const Similarity& similarity) const {
    return std::all_of(pairs.begin(), pairs.end(), [&](const StarPair& pair) {
      const Point p = similarity.at(pair.reference);
      return std::hypot(p.x - pair.frame.x, p.y - pair.frame.y) < radii_px.back();
    });
  }
};

/// Refits a similarity to the stars that agree with it: near its triangle at first, then everywhere.
std::optional<Similarity> refit(const PointScene& scene, const TriangleStart& start, double max_scale_change) {
  std::vector<StarPair> pairs = start.pairs;
  std::optional<Similarity> similarity = fit_similarity(pairs);
  for (const double limit : {0.0, 8.0, 6.0}) {  // 0: by the start
    if (!similarity) return std::nullopt;
    const double scale = std::hypot(similarity->a, similarity->b);
    if (std::fabs(std::log(scale)) > max_scale_change + 0.01) return std::nullopt;
    std::vector<Point> places;
    std::vector<double> limits;
    for (const Point& p : scene.reference) {
      places.push_back(similarity->at(p));
      limits.push_back(limit > 0 ? limit : scene.in_view(places.back()) ? start.radius_px(p) : 0);
    }
    const std::vector<IndexPair> found = pair_nearest(places, limits, scene.grid);
    const auto near = std::count_if(limits.begin(), limits.end(), [](double radius) { return radius > 0; });
    if (limit == 0 && near >= min_near && found.size() <= 3) return std::nullopt;
    if (found.size() < 3) break;
    pairs.clear();
    for (const IndexPair& pair : found) {
      pairs.push_back({scene.reference[static_cast<std::size_t>(pair.reference)],
                       scene.frame[static_cast<std::size_t>(pair.frame)]});
    }
    similarity = fit_similarity(pairs);
  }
  if (similarity && std::fabs(std::log(std::hypot(similarity->a, similarity->b))) > max_scale_change)
    return std::nullopt;
  return similarity;
}

std::vector<Point> brightest(const std::vector<Point>& points, std::size_t count) {
  return {points.begin(), points.begin() + static_cast<std::ptrdiff_t>(std::min(count, points.size()))};
}

/// Returns the log10 of the number of similarities through two points of each list, for all tests.
double log10_hypotheses_of(const PointScene& scene) {
  const auto n = static_cast<double>(scene.reference.size()), m = static_cast<double>(scene.frame.size());
  return std::log10(number_of_tests * n * (n - 1) * m * (m - 1) / 2);
}

/// Returns the smallest log10 false match probability of those that differ from the best; 0 if there are none.
double log10_of_rival(const Consensus& best, const std::vector<Consensus>& known, const PointLists& lists) {
  double rival = 0;
  for (const Consensus& other : known) {
    const bool differs = std::any_of(lists.reference.begin(), lists.reference.end(), [&](const Point& p) {
      const Point q = best.similarity.at(p), r = other.similarity.at(p);
      return std::hypot(q.x - r.x, q.y - r.y) > same_px;
    });
    if (differs) rival = std::min(rival, other.log10_false_probability);
  }
  return rival;
}

}  // namespace

std::vector<IndexPair> pair_nearest(const std::vector<Point>& places, const std::vector<double>& radius_px,
                                    const PointGrid& frame) {
  struct Found {
    int frame;
    double square;
    int reference;
  };
  std::vector<Found> found;
  for (std::size_t k = 0; k < places.size(); ++k) {
    const int other = frame.nearest(places[k], radius_px[k]);
    if (other < 0) continue;
    const Point& p = frame.at(other);
    const double dx = p.x - places[k].x, dy = p.y - places[k].y;
    found.push_back({other, dx * dx + dy * dy, static_cast<int>(k)});
  }
  std::sort(found.begin(), found.end(), [](const Found& a, const Found& b) {
    if (a.frame != b.frame) return a.frame < b.frame;
    return a.square != b.square ? a.square < b.square : a.reference < b.reference;
  });
  std::vector<IndexPair> out;
  for (const Found& f : found) {
    if (out.empty() || out.back().frame != f.frame) out.push_back({f.reference, f.frame});
  }
  return out;
}

std::optional<Consensus> find_consensus(const PointLists& lists, double max_scale_change,
                                        double log10_max_false_probability) {
  std::optional<Consensus> best;
  std::vector<Consensus> known;  // that are no chance: triangles that agree with them are not tried again
  const PointScene all(lists, lists.reference, lists.frame);
  for (const std::size_t depth : depths) {
    const std::vector<Point> reference = brightest(lists.reference, depth), frame = brightest(lists.frame, depth);
    const PointScene scene(lists, reference, frame);
    const double hypotheses = log10_hypotheses_of(scene);
    const std::vector<TrianglePair> triangles =
        matching_triangles(reference, frame, {.max_scale_change = max_scale_change});
    std::size_t tried = 0;
    for (const TrianglePair& triangle : triangles) {
      const TriangleStart start(scene, triangle);
      const auto agrees = [&](const Consensus& other) { return start.agrees_with(other.similarity); };
      if (std::any_of(known.begin(), known.end(), agrees)) continue;
      if (++tried > max_hypotheses) break;
      const std::optional<Similarity> similarity = refit(scene, start, max_scale_change);
      if (!similarity) continue;
      const double bright = weigh(scene, *similarity, hypotheses).log10_false_probability;
      if (bright > 0) continue;
      Consensus found = weigh(all, *similarity, hypotheses);
      found.log10_false_probability = std::min(found.log10_false_probability, bright);
      if (!best || found.log10_false_probability < best->log10_false_probability) best = found;
      if (found.log10_false_probability < log10_max_false_probability) known.push_back(found);
    }
    const bool found = best && best->log10_false_probability < log10_max_false_probability;
    if (found) best->log10_rival_probability = log10_of_rival(*best, known, lists);
    if (found && 3 * best->matched >= best->in_view) return best;  // else others may be matched by more stars
    if (depth >= std::max(lists.reference.size(), lists.frame.size())) break;
  }
  return best;
}

}  // namespace lowlux::merge
