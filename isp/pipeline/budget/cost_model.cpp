#include "isp/pipeline/budget/cost_model.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "denoise/spatial/layout.h"
#include "isp/pipeline/render/frame_tiles.h"
#include "isp/pipeline/render/pixel_cells.h"

namespace lowlux::isp {

std::string_view name_of(CostPart part) {
  static constexpr std::array<std::string_view, cost_parts> names{"planning",        "samples",
                                                                  "defects",         "lines",
                                                                  "offsets",         "check",
                                                                  "codes",           "floats",
                                                                  "draft-0",         "draft-1",
                                                                  "draft-2",         "standard-0",
                                                                  "standard-1",      "standard-2",
                                                                  "high-0",          "high-1",
                                                                  "high-2",          "best-0",
                                                                  "best-2",          "codes-16",
                                                                  "floats-32",       "look",
                                                                  "display",         "encoded-malvar",
                                                                  "residual",        "residual-median",
                                                                  "merge-frame",     "merge-mean",
                                                                  "merge-robust",    "merge-comparison",
                                                                  "merge-alignment", "merge-cells",
                                                                  "merge-subpixel",  "merge-prediction",
                                                                  "merge-codes"};
  return names[static_cast<std::size_t>(part)];
}

CostSize cost_size(int width, int height) {
  const int columns = (width + 1) / 2, rows = (height + 1) / 2, levels = denoise::levels_of(columns, rows);
  return {1e-6 * width * height, 4e-6 * denoise::padded(columns, levels) * denoise::padded(rows, levels)};
}

namespace {

/// Sets the denoised size of a mosaic of width x height sites that is processed in tiles.
void set_denoised(const TileGrid& grid, int width, int height, CostSize& out) {
  out.denoised_megapixels = 0;
  for (int i = 0; i < grid.count(); ++i) {
    const Rect core = grid.core(i);
    if (core.width <= 0 || core.height <= 0) continue;
    const auto denoised_megapixels = [&](denoise::Level level) {
      const Rect piece = with_margin(core, margin_of(level), width, height);
      return cost_size(piece.width, piece.height).denoised_megapixels;
    };
    const double usual = denoised_megapixels(denoise::Level::high);
    out.denoised_megapixels += usual;
    out.more_for_best_megapixels += denoised_megapixels(denoise::Level::best) - usual;
  }
}

}  // namespace

CostSize cost_size(const RawDn& raw) {
  constexpr TileLimits limits;
  const Rect& active = raw.active;
  CostSize out = cost_size(active.width, active.height);
  if (!is_mosaic(raw)) {  // PixelNoiseReducer: each pixel is a cell of 2 x 2 sites
    const int width = 2 * active.width, height = 2 * active.height;
    set_denoised(TileGrid({0, 0, width, height}, limits.side_px), width, height, out);
  } else if (static_cast<std::int64_t>(active.width) * active.height > limits.max_whole_px) {
    set_denoised(TileGrid(raw.default_crop, limits.side_px), active.width, active.height, out);
  }
  return out;
}

double CostSize::megapixels_of(CostPart part) const {
  if (!is_denoising(part)) return megapixels;
  return denoised_megapixels + (part >= CostPart::best_0 ? more_for_best_megapixels : 0);
}

double CostModel::seconds(CostPart part, const CostSize& size) const {
  const double megapixels = size.megapixels_of(part);
  assert(megapixels > 0);
  const std::vector<CostPoint>& at = points[static_cast<std::size_t>(part)];
  if (at.empty()) return 0;
  const auto per_mp = [](const CostPoint& point) { return point.seconds / point.megapixels; };
  const auto above = std::ranges::find_if(at, [&](const CostPoint& point) { return point.megapixels >= megapixels; });
  if (above == at.begin()) return pace * per_mp(at.front()) * megapixels;
  if (above == at.end()) return pace * per_mp(at.back()) * megapixels;
  const CostPoint &low = *(above - 1), &high = *above;
  const double way = (megapixels - low.megapixels) / (high.megapixels - low.megapixels);
  return pace * (low.seconds + way * (high.seconds - low.seconds));
}

double predicted_s(const CostModel& model, const CostSize& size, const std::vector<CostTerm>& work) {
  double sum = 0;
  for (const CostTerm& part : work) sum += part.share * model.seconds(part.part, size);
  return sum;
}

namespace {

/// States the time of the fixed workload of isp/cost/speed_probe.h, 0.79 MP at the level standard, by the table below:
/// 15 ms/MP. It was not recorded with the times.
constexpr double pace_s = 0.0118;

/// Returns the times of a part of merging from its time for each megapixel over the pace, which is higher for small
/// frames because much of the work is the same for any size. `measure merge-budget` prints these ratios. Stated are
/// those of two cores with AVX2, of frames at rest or displaced, whichever are higher, times 1.25: they were up to 1.3
/// times those with SSE4, so that wider vectors, which shorten the pace more than merging, may raise them again.
std::vector<CostPoint> merge_points(const std::array<double, 6>& ratios) {
  constexpr std::array<double, 6> megapixels{0.0123, 0.0983, 0.301, 1.12, 2.97, 9.01};
  std::vector<CostPoint> out;
  for (std::size_t i = 0; i < ratios.size(); ++i) {
    out.push_back({megapixels[i], ratios[i] * megapixels[i] * pace_s});
  }
  return out;
}

CostModel made() {
  const std::array<std::vector<CostPoint>, cost_parts> points{{
      {{9.009, 0.00689}},  // planning
      {{1.573, 0.00485}},  // samples
      {{9.009, 0.00332}},  // defects
      {{9.009, 0.01588}},  // lines
      {{9.009, 0.00749}},  // offsets
      {{9.009, 0.00286}},  // check
      {{9.009, 0.01073}},  // codes
      {{9.009, 0.01477}},  // floats
      {{9.503, 0.08840}},  // draft-0
      {{9.503, 0.06520}},  // draft-1
      {{9.503, 0.05710}},  // draft-2
      {{9.503, 0.12880}},  // standard-0
      {{9.503, 0.08250}},  // standard-1
      {{9.503, 0.07250}},  // standard-2
      {{9.503, 0.18300}},  // high-0
      {{9.503, 0.10330}},  // high-1
      {{9.503, 0.08990}},  // high-2
      // These two follow from the ratios of times in `bench --stage denoise`; draft to high were raised by those of
      // `measure denoise` when their blocks became closer.
      {{2.064, 0.30700}},  // best-0
      {{2.064, 0.17200}},  // best-2
      {{9.009, 0.00805}},  // codes-16
      {{9.009, 0.00000}},  // floats-32
      {{9.009, 0.01160}},  // look
      {{9.009, 0.02373}},  // display
      // These three follow from that of codes by the ratios that `measure raw-to-rgb` prints.
      {{9.009, 0.00416}},  // encoded-malvar
      {{9.009, 0.01505}},  // residual
      {{9.009, 0.01740}},  // residual-median
      // These follow from the pace.
      merge_points({1.56, 0.55, 0.35, 0.30, 0.28, 0.20}),  // merge-frame
      merge_points({0.26, 0.07, 0.05, 0.05, 0.06, 0.03}),  // merge-mean
      merge_points({11.5, 4.50, 4.00, 3.70, 3.70, 3.30}),  // merge-robust
      merge_points({1.00, 0.26, 0.20, 0.19, 0.16, 0.15}),  // merge-comparison
      merge_points({103., 8.75, 1.80, 0.58, 0.27, 0.25}),  // merge-alignment
      merge_points({0.66, 0.21, 0.15, 0.13, 0.16, 0.16}),  // merge-cells
      merge_points({1.15, 0.63, 0.63, 0.54, 0.56, 0.54}),  // merge-subpixel
      merge_points({9.60, 3.10, 2.20, 2.50, 2.40, 2.20}),  // merge-prediction
      merge_points({2.20, 0.69, 0.55, 0.51, 0.50, 0.45}),  // merge-codes
  }};
  return {.machine = std::string(reference_machine), .threads = 2, .pace_s = pace_s, .points = points};
}

}  // namespace

const CostModel& reference_cost() {
  static const CostModel model = made();
  return model;
}

}  // namespace lowlux::isp
