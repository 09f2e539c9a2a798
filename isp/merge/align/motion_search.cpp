#include "isp/merge/align/motion_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

namespace lowlux::merge {
namespace {

constexpr int mean_reach = 3;                    // cells on each side over which the local mean is formed
constexpr float max_loss = 4.5F;                 // of a cell: 3 standard deviations
constexpr double motion_variance_cells = 0.125;  // 1/12 for half a cell of shift, 1/24 for half a step of rotation

/// Returns the best motions of which no two are neighbours. Those that are as good are in order of their places.
std::vector<RatedMotion> best_of(const std::vector<std::vector<RatedMotion>>& found, int count, double cell_px,
                                 double turn_step) {
  std::vector<RatedMotion> all, out;
  for (const auto& some : found) all.insert(all.end(), some.begin(), some.end());
  std::stable_sort(all.begin(), all.end(),
                   [](const RatedMotion& a, const RatedMotion& b) { return a.log_likelihood > b.log_likelihood; });
  for (const RatedMotion& rated : all) {
    if (static_cast<int>(out.size()) >= count) break;
    const RigidMotion& m = rated.motion;
    const bool is_new = std::none_of(out.begin(), out.end(), [&](const RatedMotion& other) {
      const RigidMotion& o = other.motion;
      return std::fabs(o.dx_px - m.dx_px) < 1.5 * cell_px && std::fabs(o.dy_px - m.dy_px) < 1.5 * cell_px &&
             std::fabs(o.turn_rad - m.turn_rad) < 1.5 * turn_step;
    });
    if (is_new) out.push_back(rated);
  }
  return out;
}

/// Writes the sum and the number of the values within mean_reach of each element of a run.
void sum_along(const float* values, const float* counts, std::ptrdiff_t step, int size, float* sums, float* numbers) {
  for (int i = 0; i < size; ++i) {
    float sum = 0, number = 0;
    for (int k = std::max(0, i - mean_reach); k <= std::min(size - 1, i + mean_reach); ++k) {
      sum += values[k * step];
      number += counts[k * step];
    }
    sums[i * step] = sum;
    numbers[i * step] = number;
  }
}

/// Returns the means over squares of those values whose count is 1; the others must be 0.
Plane<float> local_mean(const Plane<float>& values, const Plane<float>& counts) {
  const int width = values.width(), height = values.height();
  Plane<float> sums(width, height), numbers(width, height), out(width, height), total(width, height);
  for (int y = 0; y < height; ++y) {
    sum_along(values.row(y), counts.row(y), 1, width, sums.row(y), numbers.row(y));
  }
  for (int x = 0; x < width; ++x) {
    sum_along(sums.data() + x, numbers.data() + x, width, height, out.data() + x, total.data() + x);
  }
  for (std::size_t i = 0; i < out.size(); ++i) out.data()[i] /= std::max(1.0F, total.data()[i]);
  return out;
}

/// Returns the square of the slope at the middle of three cells: of the central difference, or, where it is larger, the
/// mean of the squares of both one-sided differences without their noise. Of a pattern with a period of 2 cells the
/// central difference is 0.
float squared_slope(float before, float at, float after, float noise) {
  const float central = (after - before) / 2, first = at - before, last = after - at;
  return std::max(central * central, (first * first + last * last) / 2 - 2 * noise);
}

/// Returns the part of the variance of white noise that is left at a place between two samples, along one axis: the sum
/// of the squared weights of sample_row.
double noise_left_at(float place) {
  const double a = static_cast<double>(place - std::floor(place)), inner = a * (1 - a);
  const double outer = (1 + a) * (2 - a);
  return std::pow(inner / 6, 2) * (std::pow(2 - a, 2) + std::pow(1 + a, 2)) +
         std::pow(outer / 2, 2) * (std::pow(1 - a, 2) + a * a);
}

double size_of(const RigidMotion& m, const SearchRange& range) {
  return std::hypot(m.dx_px, m.dy_px, m.turn_rad * std::hypot(range.width, range.height) / 2);
}

}  // namespace

SearchLevel make_search_level(const LumaLevel& level) {
  const int width = level.width(), height = level.height();
  Plane<float> values(width, height), counts(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const float v = level.row(y)[x];
      values.at(x, y) = std::isnan(v) ? 0 : v;
      counts.at(x, y) = std::isnan(v) ? 0 : 1;
    }
  }
  SearchLevel out{LumaLevel(width, height, level.cell_px()), local_mean(values, counts)};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) out.structure_e.row(y)[x] = level.row(y)[x] - out.mean_e.at(x, y);
  }
  return out;
}

MotionComparison::MotionComparison(const SearchLevel& reference, const SearchLevel& frame, const LevelPair& pair)
    : frame_(frame.structure_e), cell_px_(pair.reference->cell_px()) {
  const int width = reference.mean_e.width(), height = reference.mean_e.height();
  const rows::CellNoise noise = cell_noise(pair, 0);
  const auto value = [&](int x, int y) {
    const float v = reference.structure_e.row(std::clamp(y, 0, height - 1))[std::clamp(x, 0, width - 1)];
    return std::isnan(v) ? 0 : noise.light * v;
  };
  // M and N, and S of each cell before it is averaged.
  Plane<float> of_reference(width, height), of_frame(width, height), excess(width, height), counts(width, height);
  noise_loss_ = Plane<float>(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const float mean = std::max(reference.mean_e.at(x, y), noise.min_mean_e);
      const float own = noise.reference_slope * mean + noise.reference_steady_e2;
      const float all = noise.slope * mean + noise.steady_e2;
      const float across = squared_slope(value(x - 1, y), value(x, y), value(x + 1, y), own);
      const float down = squared_slope(value(x, y - 1), value(x, y), value(x, y + 1), own);
      const bool is_there = !std::isnan(reference.structure_e.row(y)[x]);
      counts.at(x, y) = is_there ? 1 : 0;
      excess.at(x, y) = is_there ? value(x, y) * value(x, y) - own : 0;
      of_reference.at(x, y) = own;
      noise_loss_.at(x, y) = is_there ? all - own : 0;
      of_frame.at(x, y) = all - own + static_cast<float>(motion_variance_cells) * (across + down);
    }
  }
  const Plane<float> structure = local_mean(excess, counts);
  for (Plane<float>* plane : {&constant_, &linear_, &square_}) *plane = Plane<float>(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double s = counts.at(x, y) > 0 ? std::max(0.0, static_cast<double>(structure.at(x, y))) : 0;
      const double m = s + static_cast<double>(of_reference.at(x, y)), n = s + static_cast<double>(of_frame.at(x, y));
      const double d = m * n - s * s, r = static_cast<double>(value(x, y));
      constant_.at(x, y) = static_cast<float>((n / d - 1 / m) / 2 * r * r - std::log(m * n / d) / 2);
      linear_.at(x, y) = static_cast<float>(s / d * r);
      square_.at(x, y) = static_cast<float>((m / d - 1 / n) / 2);
      noise_loss_.at(x, y) *= square_.at(x, y);
      sum_of_noise_loss_ += static_cast<double>(noise_loss_.at(x, y));
    }
  }
}

double MotionComparison::turn_step(const SearchRange& range) const {
  return 2 * cell_px_ / std::hypot(range.width, range.height);
}

/// Returns the frame at the displaced cells of the reference, with so many more on each side.
MotionComparison::Displaced MotionComparison::displaced(const RigidMotion& motion, const SearchRange& range,
                                                        int margin) const {
  Plane<float> out(constant_.width() + 2 * margin, constant_.height() + 2 * margin);
  double noise_left = 0;
  const rows::Samples source{frame_.row(0), frame_.stride(), frame_.width(), frame_.height()};
  const double centre = (cell_px_ - 1) / 2.0, cell = cell_px_;
  const GlobalMotion global = motion.in(range.width, range.height);
  std::vector<float> dx(static_cast<std::size_t>(out.width())), dy(dx.size());
  for (int y = 0; y < out.height(); ++y) {
    // The displacement is a linear function of the column.
    const double at_y = cell * (y - margin) + centre, at_x = centre - cell * margin;
    const Shift first = global.at(at_x, at_y), last = global.at(at_x + cell * out.width(), at_y);
    const float step_x = (last.dx_px - first.dx_px) / static_cast<float>(out.width());
    const float step_y = (last.dy_px - first.dy_px) / static_cast<float>(out.width());
    for (int x = 0; x < out.width(); ++x) {
      const auto i = static_cast<std::size_t>(x);
      dx[i] = (first.dx_px + static_cast<float>(x) * step_x) / static_cast<float>(cell);
      dy[i] = (first.dy_px + static_cast<float>(x) * step_y) / static_cast<float>(cell);
    }
    rows::sample_row(source, -margin, y - margin, dx.data(), dy.data(), out.width(), out.row(y));
    for (std::size_t i = 0; i < dx.size(); ++i) noise_left += noise_left_at(dx[i]) * noise_left_at(dy[i]);
  }
  const auto count = static_cast<double>(out.size());
  return {std::move(out), noise_left / count};
}

double MotionComparison::gain_of(const Displaced& displaced, int margin, int dx, int dy) const {
  double loss = (1 - displaced.noise_left) * sum_of_noise_loss_;
  for (int y = 0; y < constant_.height(); ++y) {
    const rows::CostRow cost{constant_.row(y), linear_.row(y), square_.row(y)};
    const float* const frame = displaced.cells.row(y + margin + dy) + margin + dx;
    loss += static_cast<double>(rows::capped_cost(frame, cost, max_loss, constant_.width()));
  }
  return -loss;
}

std::vector<RatedMotion> MotionComparison::search(const SearchRange& range, int count, Executor& executor) const {
  // Half of the frame must stay; a rotation moves a corner by no more than half of the shorter side.
  const double step = turn_step(range);
  const int max_x = static_cast<int>(std::min(range.max_shift_px, range.width / 2.0) / cell_px_ + 0.999);
  const int max_y = static_cast<int>(std::min(range.max_shift_px, range.height / 2.0) / cell_px_ + 0.999);
  const double max_turn =
      std::min(range.max_turn_rad, std::min(range.width, range.height) / std::hypot(range.width, range.height));
  const int turns = static_cast<int>(std::lround(max_turn / step)), margin = std::max(max_x, max_y);
  std::vector<std::vector<RatedMotion>> found(static_cast<std::size_t>(2 * turns + 1));
  for_each_index(executor, 2 * turns + 1, [&](int i) {
    const double turn = (i - turns) * step;
    const Displaced frame = displaced({0, 0, turn}, range, margin);
    for (int dy = -max_y; dy <= max_y; ++dy) {
      for (int dx = -max_x; dx <= max_x; ++dx) {
        const RigidMotion motion{static_cast<double>(cell_px_) * dx, static_cast<double>(cell_px_) * dy, turn};
        found[static_cast<std::size_t>(i)].push_back({motion, gain_of(frame, margin, dx, dy)});
      }
    }
  });
  return best_of(found, count, cell_px_, step);
}

std::vector<RatedMotion> MotionComparison::refine(const std::vector<RatedMotion>& motions, const SearchRange& range,
                                                  int count, Executor& executor) const {
  const double step = turn_step(range);
  const int tasks = 3 * static_cast<int>(motions.size());
  std::vector<std::vector<RatedMotion>> found(static_cast<std::size_t>(tasks));
  for_each_index(executor, tasks, [&](int task) {
    const RigidMotion& start = motions[static_cast<std::size_t>(task / 3)].motion;
    const double turn = start.turn_rad + (task % 3 - 1) * step;
    const Displaced frame = displaced({start.dx_px, start.dy_px, turn}, range, 1);
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const RigidMotion motion{start.dx_px + cell_px_ * dx, start.dy_px + cell_px_ * dy, turn};
        found[static_cast<std::size_t>(task)].push_back({motion, gain_of(frame, 1, dx, dy)});
      }
    }
  });
  return best_of(found, count, cell_px_, step);
}

Plane<float> MotionComparison::losses(const RigidMotion& motion, const SearchRange& range) const {
  Displaced out = displaced(motion, range, 0);
  const auto noise_taken = static_cast<float>(1 - out.noise_left);
  for (std::size_t i = 0; i < out.cells.size(); ++i) {
    const float f = out.cells.data()[i], loss = constant_.data()[i] + f * (square_.data()[i] * f - linear_.data()[i]);
    out.cells.data()[i] = std::isnan(f) ? 0 : std::min(loss + noise_taken * noise_loss_.data()[i], max_loss);
  }
  return std::move(out.cells);
}

RatedMotion MotionComparison::smallest_near_best(const std::vector<RatedMotion>& motions,
                                                 const SearchRange& range) const {
  const Plane<float> best = losses(motions.front().motion, range);
  RatedMotion out = motions.front();
  for (const RatedMotion& m : motions) {
    if (size_of(m.motion, range) >= size_of(out.motion, range)) continue;
    const Plane<float> other = losses(m.motion, range);
    double sum = 0, squares = 0;
    for (std::size_t i = 0; i < other.size(); ++i) {
      const auto worse = static_cast<double>(other.data()[i] - best.data()[i]);
      sum += worse;
      squares += worse * worse;
    }
    if (sum <= 3 * std::sqrt(squares)) out = m;
  }
  return out;
}

}  // namespace lowlux::merge
