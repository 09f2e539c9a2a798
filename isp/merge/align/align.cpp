#include "isp/merge/align/align.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <optional>

#include "isp/merge/align/global_fit.h"
#include "isp/merge/align/global_motion.h"
#include "isp/merge/align/local_motion.h"
#include "isp/merge/align/motion_search.h"
#include "isp/merge/align/tiles.h"

namespace lowlux::merge {
namespace {

constexpr int min_side_px = 16;
constexpr int max_search_side = 256;               // cells of the finest level that all motions are compared on
constexpr int max_candidates = 12;                 // motions that are refined
constexpr double significant_log_likelihood = 30;  // chance reaches it with a probability below exp(-30) for a motion
constexpr int max_passes = 4;                      // of one level
constexpr double converged_cells = 0.02;
constexpr double nearly_converged_cells = 0.15;  // from which on departures are looked for
constexpr double finest_converged_cells = 0.05;
constexpr double unconverged = 0.3;  // part of a step that the next one may have
/// Standard deviation of what aliasing and interpolation displace all tiles by: it depends on the fractions of the
/// displacement, which without a rotation are the same everywhere, and so no number of tiles makes it smaller.
constexpr double common_error_cells = 0.01;
constexpr double first_warp_error_cells = 0.3;
constexpr double warp_error_cells = 0.1;  // what interpolation and aliasing leave

/// State of one alignment.
struct Alignment {
  const LumaPyramid& reference;
  const LumaPyramid& frame;
  const AlignOptions& options;
  SearchRange range;
  double expected_light;
  Executor& executor;

  double light = 1;
  std::optional<GlobalMotion> motion;
  bool is_rigid = true;
  LocalMotion local;
  double variance_px2 = 0;
  double search_variance_px2 = 0;  // variance of the motion that the search has found

  LevelPair pair(std::size_t level) const {
    return {&reference.levels[level], &frame.levels[level], reference.variance_e2, frame.variance_e2, light};
  }
};

/// Returns the sum of global motion and departures at the nodes of the departures.
Motion total_motion(const GlobalMotion& global, const LocalMotion& local) {
  Motion out;
  out.spacing_px = local.departure.spacing_px;
  out.dx_px = local.departure.dx_px.clone();
  out.dy_px = local.departure.dy_px.clone();
  for (int row = 0; row < out.dx_px.height(); ++row) {
    for (int column = 0; column < out.dx_px.width(); ++column) {
      const Shift shift = global.at(column * out.spacing_px, row * out.spacing_px);
      out.dx_px.at(column, row) += shift.dx_px;
      out.dy_px.at(column, row) += shift.dy_px;
    }
  }
  return out;
}

/// Returns the motions, of which the first and best is refined once more on its level.
std::vector<RatedMotion> refined_first(const MotionComparison& comparison, std::vector<RatedMotion> motions,
                                       const Alignment& a) {
  const std::vector<RatedMotion> again = comparison.refine({motions.front()}, a.range, 1, a.executor);
  motions.front() = again.front();
  return motions;
}

/// Compares motions on the coarse levels, refines the best on the next finer ones until noise leaves less to decide on,
/// and goes on to finer levels only if nothing was found. Returns the level of the best motion, which is within about a
/// cell of it; nullopt if the frames are not more likely with any motion than with nothing in common.
std::optional<std::size_t> search_motion(Alignment& a) {
  std::vector<RatedMotion> motions;
  std::optional<std::size_t> found;
  double best_likelihood = significant_log_likelihood;
  for (std::size_t level = a.reference.levels.size(); level-- > 0;) {
    const LumaLevel& cells = a.reference.levels[level];
    if (found && std::max(cells.width(), cells.height()) > max_search_side) break;
    const SearchLevel reference = make_search_level(cells);
    const SearchLevel frame = make_search_level(a.frame.levels[level]);
    const MotionComparison comparison(reference, frame, a.pair(level));
    const bool is_first = level + 1 == a.reference.levels.size();
    if (!is_first) motions.push_back({});  // no motion: a pattern that repeats may have left it out
    motions = is_first ? comparison.search(a.range, max_candidates, a.executor)
                       : comparison.refine(motions, a.range, max_candidates / 2, a.executor);
    // The steps of all finer levels, 1/2 + 1/4 + ..., do not make up for an error of one step on the coarsest.
    if (!is_first) motions = refined_first(comparison, std::move(motions), a);
    const RatedMotion best = comparison.smallest_near_best(motions, a.range);
    if (best.log_likelihood > best_likelihood) {
      best_likelihood = best.log_likelihood;
      a.motion = best.motion.in(a.range.width, a.range.height);
      a.search_variance_px2 = static_cast<double>(cells.cell_px()) * cells.cell_px() / 3;  // one cell either way
      found = level;
    } else if (found && best.log_likelihood < best_likelihood / 2) {
      break;
    }
  }
  return found;
}

/// Fits the motion on one level. Returns false, and changes nothing, if the level determines nothing or adds nothing to
/// what is known from coarser ones.
bool fit_level(Alignment& a, std::size_t level, bool is_first) {
  TileGrid grid = tile_grid(a.reference.levels[level], a.options.spacing_px);
  LocalMotion local = a.local.departure.dx_px.empty() ? no_departure(grid) : resampled(a.local, grid);
  GlobalMotion motion = *a.motion;
  bool is_rigid = a.is_rigid, has_converged = !is_first;
  double light = a.light, variance = 0;
  const double common = std::pow(common_error_cells * grid.cell_px, 2);
  for (int pass = 0; pass < max_passes; ++pass) {
    LevelPair pair = a.pair(level);
    pair.light = light;
    measure_tiles(pair, total_motion(motion, local), has_converged ? warp_error_cells : first_warp_error_cells, grid,
                  a.executor);
    std::vector<TileFit> fits;
    fits.reserve(grid.tiles.size());
    for (const auto& tile : grid.tiles) fits.push_back(fit_of(tile, grid.cell_px));
    refer_to_global(local, grid, fits);
    const MotionModel model = !is_rigid       ? MotionModel::full
                              : has_converged ? MotionModel::significant
                                              : MotionModel::rigid;
    const GlobalFit fit = fit_global(motion, grid, fits, model, a.search_variance_px2, light, a.expected_light);
    if (fit.determined == 0) return false;
    const double steady = fit.variance_px2 + common;
    if (!is_first && steady > a.variance_px2) return false;
    variance = steady + unconverged * unconverged * fit.mean_square_px2;
    if (has_converged) local = find_departures(motion, fit.step, grid, fits);
    motion.add(fit.step);
    light += fit.light_change;
    is_rigid = is_rigid && fit.is_rigid;
    if (has_converged && fit.largest_px < (level == 0 ? finest_converged_cells : converged_cells) * grid.cell_px) break;
    has_converged = has_converged || fit.largest_px < nearly_converged_cells * grid.cell_px;
  }
  a.motion = motion;
  a.local = std::move(local);
  a.is_rigid = is_rigid;
  a.light = light;
  a.variance_px2 = variance;
  return true;
}

Motion not_found(const AlignReference& reference, const AlignOptions& options) {
  Motion motion = no_motion(reference.width(), reference.height(), options.spacing_px);
  motion.found = false;
  return motion;
}

/// Returns the motion at the nodes of the result.
Motion result_of(const Alignment& a) {
  Motion out = no_motion(a.range.width, a.range.height, a.options.spacing_px);
  const Motion& departure = a.local.departure;
  const double last_x = departure.spacing_px * (departure.dx_px.width() - 1);
  const double last_y = departure.spacing_px * (departure.dx_px.height() - 1);
  double variance = 0;
  for (int row = 0; row < out.dx_px.height(); ++row) {
    for (int column = 0; column < out.dx_px.width(); ++column) {
      const double x = column * out.spacing_px, y = row * out.spacing_px;
      const Shift global = a.motion->at(x, y);
      const auto near_x = static_cast<float>(std::min(x, last_x)), near_y = static_cast<float>(std::min(y, last_y));
      const Shift local = departure.at(near_x, near_y);
      out.dx_px.at(column, row) = global.dx_px + local.dx_px;
      out.dy_px.at(column, row) = global.dy_px + local.dy_px;
      const int i = static_cast<int>(near_x) / departure.spacing_px,
                j = static_cast<int>(near_y) / departure.spacing_px;
      variance += static_cast<double>(a.local.variance_px2.at(i, j));
    }
  }
  out.standard_error_px = std::sqrt(a.variance_px2 + variance / static_cast<double>(out.dx_px.size()));
  return out;
}

}  // namespace

AlignReference::AlignReference(const FrameView& reference, Executor& executor)
    : width_(reference.signal_e.width),
      height_(reference.signal_e.height),
      pyramid_(make_luma_pyramid(reference, executor)) {}

Motion find_motion(const AlignReference& reference, const FrameView& frame, double light, const AlignOptions& options,
                   Executor& executor) {
  assert(frame.signal_e.width == reference.width() && frame.signal_e.height == reference.height());
  assert(light > 0 && options.spacing_px >= 16 && options.spacing_px % 16 == 0);
  if (std::min(reference.width(), reference.height()) < min_side_px) return not_found(reference, options);
  const LumaPyramid pyramid = make_luma_pyramid(frame, executor);
  const SearchRange range{reference.width(), reference.height(), static_cast<double>(options.max_shift_px),
                          options.max_rotation_deg * std::numbers::pi / 180};
  Alignment a{reference.pyramid(), pyramid, options, range, light, executor};
  a.light = light;
  const std::optional<std::size_t> start = search_motion(a);
  if (!start) return not_found(reference, options);
  bool is_known = false;
  for (std::size_t level = *start + 1; level-- > 0;) {
    const bool is_better = fit_level(a, level, !is_known);
    if (is_known && !is_better) break;
    is_known = is_known || is_better;
  }
  return is_known ? result_of(a) : not_found(reference, options);
}

}  // namespace lowlux::merge
