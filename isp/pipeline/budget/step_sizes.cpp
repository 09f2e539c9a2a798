#include "isp/pipeline/budget/step_sizes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include <fmt/format.h>

#include "denoise/lines/line_noise.h"
#include "isp/pipeline/budget/frame_sample.h"
#include "isp/pipeline/plan/plan_noise.h"
#include "isp/raw/black_point.h"
#include "isp/raw/repair.h"

namespace lowlux::isp {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double largest_delta_e = 100;
constexpr double only_how_much = std::numeric_limits<double>::infinity();  // only the amount, no offset of any line

double share_of(const RawFrame& frame, std::span<const Rect> squares) {
  const Rect& active = frame.raw.active;
  return static_cast<double>(squares.size()) * sample_side_px * sample_side_px /
         (static_cast<double>(active.width) * active.height);
}

/// Returns how far a pixel differs from its four neighbours of the same colour [DN].
double excess_dn(const RawDn& raw, const Pixel& p) {
  const auto code = [&](int x, int y) { return static_cast<double>(raw.dn.at(x, y)); };
  const double around = (code(p.x - 2, p.y) + code(p.x + 2, p.y) + code(p.x, p.y - 2) + code(p.x, p.y + 2)) / 4;
  return std::fabs(code(p.x, p.y) - around);
}

template <class Figure>
double median_of(std::span<const SeenBlock> blocks, const Figure& figure) {
  if (blocks.empty()) return 0;
  std::vector<double> values;
  values.reserve(blocks.size());
  for (const SeenBlock& block : blocks) values.push_back(static_cast<double>(figure(block)));
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Returns the value that 5 % of the blocks exceed.
double percentile_of(std::span<const SeenBlock> blocks, float SeenBlock::*figure) {
  if (blocks.empty()) return 0;
  std::vector<float> values;
  values.reserve(blocks.size());
  for (const SeenBlock& block : blocks) values.push_back(block.*figure);
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(seen_fraction * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return static_cast<double>(*at);
}

void set_defects(const RawFrame& frame, const RawLevels& levels, const DefectNoise& noise,
                 std::span<const Rect> squares, std::span<const SeenBlock> blocks, StepSizes& out, Executor& executor) {
  if (squares.empty()) {
    out.defects = nan;
    out.has_defects = true;
    out.defects_words = "the whole frame is searched: a sample would save nothing";
    return;
  }
  std::size_t found = 0;
  double strongest_dn = 0;
  for (const Rect& square : squares) {
    const RawDn codes = square_codes(frame.raw, square);
    const std::vector<Pixel> defects = find_defects(codes, levels.black, noise, executor);
    found += defects.size();
    for (const Pixel& p : defects) strongest_dn = std::max(strongest_dn, excess_dn(codes, p));
  }
  out.has_defects = found > 0;
  out.defects_words = fmt::format("{} in a sample of {:.0f} % of the frame", found, 100 * share_of(frame, squares));
  if (found == 0) return;
  if (blocks.empty() || !levels.electrons_at_white) {
    out.defects = nan;
    return;
  }
  const double electrons = strongest_dn / mean_range_dn(frame.raw, levels.black) * (*levels.electrons_at_white)[0];
  const double each = median_of(blocks, [](const SeenBlock& block) { return block.point_delta_e; });
  out.defects = std::min(electrons * each, largest_delta_e);
}

/// Returns the lines of one kind of each square; absent where they cannot be measured.
std::vector<std::optional<denoise::LineOffsets>> lines_of_squares(const RawElectrons& sample, int squares,
                                                                  denoise::Lines kind, Executor& executor) {
  std::vector<std::optional<denoise::LineOffsets>> of_square(static_cast<std::size_t>(squares));
  for_each_index(executor, squares, [&](int i) {
    const auto square = sample.value.view().crop(0, i * sample_side_px, sample_side_px, sample_side_px);
    auto found = denoise::line_offsets_of_frame(square, kind, {.min_std_e = only_how_much});
    if (found) of_square[static_cast<std::size_t>(i)] = *std::move(found);
  });
  return of_square;
}

/// Returns the standard deviation of line noise, over the squares; 0 where it would not be significant for whole lines
/// either, whose offsets are measured better than a square's.
/// @param length_px  of whole lines
double line_std_e(const RawElectrons& sample, int squares, denoise::Lines kind, int length_px,
                  const denoise::RawNoise& noise, Executor& executor) {
  double squares_e2 = 0;
  int measured = 0;
  denoise::LineOffsets mean;
  for (auto& found : lines_of_squares(sample, squares, kind, executor)) {
    if (!found) continue;
    squares_e2 += found->line_std_e * found->line_std_e;
    ++measured;
    mean = *std::move(found);
  }
  if (measured == 0) return 0;
  mean.line_std_e = std::sqrt(squares_e2 / measured);
  mean.measured_std_e *= std::sqrt(static_cast<double>(sample_side_px) / length_px);
  mean.gain = squares_e2 / (squares_e2 + measured * mean.measured_std_e * mean.measured_std_e);
  return lines_stand_out(mean, noise) ? mean.line_std_e : 0;
}

void set_lines(const RawFrame& frame, const RawLevels& levels, const denoise::RawNoise& noise,
               std::span<const Rect> squares, std::span<const SeenBlock> blocks, StepSizes& out, Executor& executor) {
  if (squares.empty()) {
    out.lines = nan;
    out.lines_words = "looked for in the whole frame: a sample would save nothing";
    return;
  }
  const RawElectrons sample = sample_electrons(frame, levels, squares, executor);
  const int count = static_cast<int>(squares.size());
  const Rect& active = frame.raw.active;
  const double rows_e = line_std_e(sample, count, denoise::Lines::rows, active.width, noise, executor);
  const double columns_e = line_std_e(sample, count, denoise::Lines::columns, active.height, noise, executor);
  // A block of 8 x 8 pixels averages eight rows and eight columns.
  const double seen_e = std::sqrt((rows_e * rows_e + columns_e * columns_e) / seen_box_px);
  std::vector<float> rms;
  rms.reserve(blocks.size());
  for (const SeenBlock& block : blocks) rms.push_back(static_cast<float>(seen_e) * block.line_delta_e);
  out.lines = seen_percentile(rms);
  out.lines_words = fmt::format("{:.2g} e- of rows and {:.2g} e- of columns in a sample of {:.0f} % of the frame",
                                rows_e, columns_e, 100 * share_of(frame, squares));
}

}  // namespace

DefectNoise defect_noise(const RawFrame& frame, const BlackPoint& black, const Thumbnail& thumbnail) {
  DefectNoise noise{thumbnail.black_noise_std * mean_range_dn(frame.raw, black)};
  // A variance of scale * x at the fraction x of white is scale * range for each DN.
  if (frame.noise) {
    noise.shot_dn = *std::ranges::max_element(frame.noise->scale) * mean_range_dn(frame.raw, black);
  }
  return noise;
}

StepSizes step_sizes(const RawFrame& frame, const DevelopOptions& options, const RawLevels& levels,
                     const Thumbnail& thumbnail, const denoise::RawNoise* noise, std::span<const SeenBlock> blocks,
                     Executor& executor) {
  StepSizes out;
  const std::vector<Rect> squares =
      frame.raw.layout == SensorLayout::bayer ? sample_squares(frame, levels) : std::vector<Rect>{};
  const bool lines_asked = noise != nullptr && options.denoise.line_noise;
  if (options.find_defects || lines_asked) out.sampled_fraction = share_of(frame, squares);
  if (options.find_defects) {
    set_defects(frame, levels, defect_noise(frame, levels.black, thumbnail), squares, blocks, out, executor);
  }
  if (options.display) out.display = noise == nullptr ? nan : percentile_of(blocks, &SeenBlock::display_delta_e);
  if (noise == nullptr) return out;
  if (lines_asked) set_lines(frame, levels, *noise, squares, blocks, out, executor);
  out.dark = percentile_of(blocks, &SeenBlock::dark_delta_e);
  return out;
}

}  // namespace lowlux::isp
