#include "isp/pipeline/budget/step_sizes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "denoise/lines/line_noise.h"
#include "isp/pipeline/budget/frame_sample.h"
#include "isp/pipeline/plan/plan_noise.h"
#include "isp/pipeline/render/electron_mosaic.h"
#include "isp/raw/black_point.h"

namespace lowlux::isp {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double only_how_much = std::numeric_limits<double>::infinity();  // only the amount, no offset of any line

/// Returns how far a pixel differs from its nearest neighbours of the same colour [DN]; negative where it is darker.
double excess_dn(const RawDn& raw, const Pixel& p) {
  const Rect& active = raw.active;
  const auto code = [&](int x, int y) {
    return with_samples(raw, [&](const auto& dn) { return static_cast<double>(dn.at(active.x + x, active.y + y)); });
  };
  double sum = 0;
  int neighbours = 0;
  for (const auto [dx, dy] : {std::array{-2, 0}, {2, 0}, {0, -2}, {0, 2}}) {
    const int x = p.x + dx, y = p.y + dy;
    if (x < 0 || x >= active.width || y < 0 || y >= active.height) continue;
    sum += code(x, y);
    ++neighbours;
  }
  return neighbours == 0 ? 0 : code(p.x, p.y) - sum / neighbours;
}

/// Returns the value that 5 % of the blocks exceed.
double percentile_of(std::span<const VisibilityBlock> blocks, float VisibilityBlock::*figure) {
  if (blocks.empty()) return 0;
  std::vector<float> values;
  values.reserve(blocks.size());
  for (const VisibilityBlock& block : blocks) values.push_back(block.*figure);
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(seen_fraction * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return static_cast<double>(*at);
}

double size_of_defects(const RawFrame& frame, const DevelopOptions& options, const RawLevels& levels,
                       const SizeRequest& request) {
  if (levels.defects.empty()) return 0;
  const auto strength = [&](const Pixel& p) { return std::fabs(excess_dn(frame.raw, p)); };
  const Pixel strongest = *std::ranges::max_element(levels.defects, {}, strength);
  const double excess = excess_dn(frame.raw, strongest) / mean_range_dn(frame.raw, levels.black);
  return pixel_delta_e(frame.raw, options, request.rendering, request.light, {strongest, excess}).value_or(nan);
}

/// Holds the parts of a frame in which line noise is measured.
struct MeasuredCharge {
  RawElectrons charge;
  std::vector<PlaneView<const float>> parts;
};

MeasuredCharge sampled_charge(const RawFrame& frame, const RawLevels& levels, std::span<const Rect> squares,
                              Executor& executor) {
  MeasuredCharge out{sample_electrons(frame, levels, squares, executor), {}};
  const PlaneView<const float> sample = std::as_const(out.charge).value.view();
  for (int i = 0; i < static_cast<int>(squares.size()); ++i) {
    out.parts.push_back(sample.crop(0, i * sample_side_px, sample_side_px, sample_side_px));
  }
  return out;
}

MeasuredCharge whole_charge(const RawFrame& frame, const RawLevels& levels, Executor& executor) {
  MeasuredCharge out{raw_electrons(frame, levels, executor), {}};
  out.parts.push_back(std::as_const(out.charge).value.view());
  return out;
}

/// Returns the lines of one kind of each part; absent where they cannot be measured.
std::vector<std::optional<denoise::LineOffsets>> lines_of_parts(std::span<const PlaneView<const float>> parts,
                                                                denoise::Lines kind, Executor& executor) {
  std::vector<std::optional<denoise::LineOffsets>> out(parts.size());
  for_each_index(executor, static_cast<int>(parts.size()), [&](int i) {
    const auto part = static_cast<std::size_t>(i);
    auto found = denoise::line_offsets_of_frame(parts[part], kind, {.min_std_e = only_how_much});
    if (found) out[part] = *std::move(found);
  });
  return out;
}

/// Returns the standard deviation of line noise, over the parts; 0 where it would not be significant for whole lines
/// either, whose offsets are measured better than a part's.
/// @param active  size of the whole frame
double line_std_e(std::span<const PlaneView<const float>> parts, denoise::Lines kind, const Rect& active,
                  const denoise::RawNoise& noise, Executor& executor) {
  const bool rows = kind == denoise::Lines::rows;
  double sum_e2 = 0;
  int measured = 0;
  denoise::LineOffsets mean;
  for (auto& found : lines_of_parts(parts, kind, executor)) {
    if (!found) continue;
    sum_e2 += found->line_std_e * found->line_std_e;
    ++measured;
    mean = *std::move(found);
  }
  if (measured == 0) return 0;
  const double part_length = rows ? parts.front().width : parts.front().height;
  mean.line_std_e = std::sqrt(sum_e2 / measured);
  mean.unevenness = 0;  // only whole lines show whether strong ones are noise
  mean.measured_std_e *= std::sqrt(part_length / (rows ? active.width : active.height));
  mean.gain = sum_e2 / (sum_e2 + measured * mean.measured_std_e * mean.measured_std_e);
  return lines_are_visible(mean, noise) ? mean.line_std_e : 0;
}

void set_lines(const RawFrame& frame, const RawLevels& levels, const SizeRequest& request, StepSizes& out,
               Executor& executor) {
  const std::vector<Rect> squares = sample_squares(frame, levels);
  if (squares.empty() && !request.lines_may_remain) {
    out.lines = nan;
    out.lines_text = "searched in the whole frame";
    return;
  }
  const MeasuredCharge measured =
      squares.empty() ? whole_charge(frame, levels, executor) : sampled_charge(frame, levels, squares, executor);
  const Rect& active = frame.raw.active;
  const double rows_e = line_std_e(measured.parts, denoise::Lines::rows, active, *request.noise, executor);
  const double columns_e = line_std_e(measured.parts, denoise::Lines::columns, active, *request.noise, executor);
  const double line_e = std::hypot(rows_e, columns_e);
  std::vector<float> rms;
  rms.reserve(request.blocks.size());
  for (const VisibilityBlock& block : request.blocks) rms.push_back(static_cast<float>(line_e) * block.line_delta_e);
  out.lines = visible_percentile(rms);
  out.measured_fraction = static_cast<double>(measured.charge.value.size()) /
                          (static_cast<double>(active.width) * static_cast<double>(active.height));
  out.lines_text = fmt::format("{:.2g} e- of rows and {:.2g} e- of columns in {:.0f} % of the frame", rows_e, columns_e,
                               100 * out.measured_fraction);
}

}  // namespace

StepSizes step_sizes(const RawFrame& frame, const DevelopOptions& options, const RawLevels& levels,
                     const SizeRequest& request, Executor& executor) {
  StepSizes out;
  out.defects = size_of_defects(frame, options, levels, request);
  if (options.display)
    out.display = request.noise ? percentile_of(request.blocks, &VisibilityBlock::display_delta_e) : nan;
  if (levels.black.dark_mean_e != PerSite<double>{}) {
    out.dark = request.blocks.empty() ? nan : percentile_of(request.blocks, &VisibilityBlock::dark_delta_e);
  }
  if (request.noise && options.denoise.line_noise) set_lines(frame, levels, request, out, executor);
  return out;
}

}  // namespace lowlux::isp
