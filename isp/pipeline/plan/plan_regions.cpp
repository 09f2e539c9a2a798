#include "isp/pipeline/plan/plan_regions.h"

#include <algorithm>
#include <array>
#include <utility>

#include "isp/pipeline/render/frame_tiles.h"
#include "isp/pipeline/render/level_parts.h"

namespace lowlux::isp {
namespace {

using denoise::Level;

constexpr double min_saving = 0.1;

/// Returns the time of a level for each pixel, relative to draft: `lowlux bench --stage denoise`. Subtracting dark
/// charge takes next to nothing.
double work_of(std::optional<Level> level) {
  constexpr std::array work{1.0, 1.5, 2.1, 40.0};
  return level ? work[static_cast<std::size_t>(*level)] : 0.05;
}

std::optional<Level> cheapest(const std::vector<VisibilityBlock>& blocks, Level most, double tolerance_delta_e) {
  for (const std::optional<Level> level : {std::optional<Level>(), std::optional(Level::draft),
                                           std::optional(Level::standard), std::optional(Level::high)}) {
    if (level && *level >= most) break;
    std::vector<float> rms;
    rms.reserve(blocks.size());
    for (const VisibilityBlock& block : blocks) rms.push_back(residual_delta_e(level, block));
    if (visible_percentile(rms) < tolerance_delta_e) return level;
  }
  return most;
}

double work_of_parts(const NoiseRegions& regions, const Rect& active, Level most) {
  NoiseReduction how;
  how.level = most;
  how.regions = regions;
  std::vector<LevelPart> parts;
  split_by_level(how, {0, 0, active.width, active.height}, TileLimits{}.side_px, parts);
  double sum = 0;
  for (const LevelPart& part : parts) {
    const Rect whole =
        part.level ? with_margin(part.core, margin_of(*part.level), active.width, active.height) : part.core;
    sum += work_of(part.level) * whole.width * whole.height;
  }
  return sum;
}

}  // namespace

std::optional<NoiseRegions> plan_regions(const Rect& active, const std::vector<VisibilityBlock>& blocks, Level most,
                                         double tolerance_delta_e) {
  const auto count = [](int size) { return (size + region_px - 1) / region_px; };
  NoiseRegions out{region_px, count(active.width), count(active.height), {}};
  const auto regions = static_cast<std::size_t>(out.columns) * static_cast<std::size_t>(out.rows);
  if (regions < 2) return std::nullopt;
  std::vector<std::vector<VisibilityBlock>> in_region(regions);
  for (const VisibilityBlock& block : blocks) {
    const int x = static_cast<int>(block.x * static_cast<float>(active.width)) / region_px;
    const int y = static_cast<int>(block.y * static_cast<float>(active.height)) / region_px;
    in_region[static_cast<std::size_t>(y) * static_cast<std::size_t>(out.columns) + static_cast<std::size_t>(x)]
        .push_back(block);
  }
  out.level.reserve(regions);
  for (const std::vector<VisibilityBlock>& region : in_region) {
    out.level.push_back(region.empty() ? std::optional(most) : cheapest(region, most, tolerance_delta_e));
  }
  const double whole = work_of(most) * active.width * active.height;
  if (work_of_parts(out, active, most) > (1 - min_saving) * whole) return std::nullopt;
  return out;
}

}  // namespace lowlux::isp
