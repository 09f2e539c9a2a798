#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "denoise/check/noise_check.h"
#include "denoise/lines/line_noise.h"
#include "isp/base/executor.h"
#include "tests/denoise/frames.h"
#include "tests/properties/draws.h"

namespace lowlux::denoise {
namespace {

using namespace properties;

Plane<float> turned(const Plane<float>& in) {
  Plane<float> out(in.height(), in.width());
  for (int y = 0; y < in.height(); ++y) {
    for (int x = 0; x < in.width(); ++x) out.at(y, x) = in.at(x, y);
  }
  return out;
}

Result<LineOffsets> offsets_of(const Plane<float>& pixels, Lines lines, bool masked) {
  return masked ? line_offsets_of_masked(pixels.view(), lines) : line_offsets_of_frame(pixels.view(), lines);
}

RC_GTEST_PROP(LineNoiseProperty, OfAnythingIsFiniteAndColumnsAreRowsOfTheTurnedFrame, ()) {
  const auto pixels = any_plane(size_between(1, 60), size_between(1, 60), -20, 200, *rc::gen::element(0, 2, 9));
  const bool masked = *rc::gen::arbitrary<bool>();
  const auto rows = offsets_of(pixels, Lines::rows, masked);
  const auto columns = offsets_of(turned(pixels), Lines::columns, masked);
  RC_ASSERT(rows.has_value() == columns.has_value());
  if (!rows) return;
  RC_ASSERT(rows->gain >= 0 && rows->gain <= 1);
  RC_ASSERT(rows->line_std_e >= 0 && rows->measured_std_e >= 0 && std::isfinite(rows->line_std_e));
  RC_ASSERT(rows->residual_std_e <= rows->line_std_e);
  RC_ASSERT(rows->offset_e == columns->offset_e);
  for (const double offset : rows->offset_e) RC_ASSERT(std::isfinite(offset));
}

/// Pixels of a row that all have its offset, and nothing else but a pedestal.
struct PureLines {
  std::vector<double> offset_e;
  Plane<float> pixels;
};
PureLines any_lines(float pedestal_e) {
  PureLines out{{}, Plane<float>(size_between(4, 40), 2 * size_between(8, 40))};
  auto random = any_random();
  for (int y = 0; y < out.pixels.height(); ++y) {
    const int eighths = static_cast<int>(random() % 161) - 80;  // exact in floats
    out.offset_e.push_back(eighths / 8.0);
    std::fill_n(out.pixels.row(y), out.pixels.width(), pedestal_e + static_cast<float>(eighths) / 8);
  }
  return out;
}

// Lines of even and odd number have a middle of their own, which stays.
RC_GTEST_PROP(LineNoiseProperty, OffsetsWithoutNoiseAreFoundAndTakenOffWhole, ()) {
  PureLines lines = any_lines(static_cast<float>(size_between(0, 1000)));
  const auto found = line_offsets_of_masked(lines.pixels.view(), Lines::rows);
  RC_ASSERT(found.has_value());
  const bool any = std::ranges::any_of(found->offset_e, [](double offset) { return offset != 0; });
  RC_ASSERT(found->gain == (any ? 1 : 0));
  RC_ASSERT(found->residual_std_e == 0);
  subtract_lines(*found, lines.pixels.view());
  for (std::size_t y = 0; y < lines.offset_e.size(); ++y) {
    const std::size_t first = y % 2;
    const double truth = lines.offset_e[y] - lines.offset_e[first];
    RC_ASSERT(std::abs(found->offset_e[y] - found->offset_e[first] - truth) < 1e-9);
    for (int x = 0; x < lines.pixels.width(); ++x) {
      const float left = lines.pixels.at(x, static_cast<int>(y)) - lines.pixels.at(x, static_cast<int>(first));
      RC_ASSERT(std::abs(left) < 2e-4F);  // two roundings of floats up to 1010
    }
  }
}

RC_GTEST_PROP(LineNoiseProperty, PiecesOfAFrameLoseWhatTheFrameLoses, ()) {
  LineOffsets offsets;
  offsets.lines = *rc::gen::element(Lines::rows, Lines::columns);
  auto whole = any_plane(size_between(1, 50), size_between(2, 50), -10, 100);
  const int lines = offsets.lines == Lines::rows ? whole.height() : whole.width();
  for (int i = 0; i < lines; ++i) offsets.offset_e.push_back(any_between(-5, 5));
  auto pieces = whole.clone();
  const int cut = size_between(1, whole.height() - 1);
  subtract_lines(offsets, whole.view());
  const auto view = pieces.view();
  subtract_lines(offsets, view.crop(0, 0, view.width, cut));
  subtract_lines(offsets, view.crop(0, cut, view.width, view.height - cut), offsets.lines == Lines::rows ? cut : 0);
  RC_ASSERT(largest_difference(whole, pieces) == 0);
}

RC_GTEST_PROP(NoiseCheckProperty, OfAnythingIsWithinItsRangesAndTheSameForAnyThreads, ()) {
  const auto raw = any_plane(size_between(2, 300), size_between(2, 200), -10, 100, *rc::gen::element(0, 2, 1000));
  RawNoise noise;
  noise.dark_mean_e.fill(any_between(0, 50));
  noise.variance_e2.fill(any_between(0, 40));
  noise.saturation_e.fill(*rc::gen::element(80.0, 1e6));
  const RawElectronsView view{raw.view(), any_phase()};
  InlineExecutor one;
  PoolExecutor three(3);
  const NoiseCheck check = check_noise(view, noise, one), other = check_noise(view, noise, three);
  RC_ASSERT(check.measured_over_model == other.measured_over_model);
  RC_ASSERT(check.across_over_model == other.across_over_model);
  RC_ASSERT(check.fraction_negative == other.fraction_negative && check.windows == other.windows);
  for (const double share : check.fraction_negative) RC_ASSERT(share >= 0 && share <= 1);
  RC_ASSERT(check.fraction_without_signal >= 0 && check.fraction_without_signal <= 1);
  RC_ASSERT(check.fraction_saturated >= 0 && check.fraction_saturated <= 1 && check.windows >= 0);
  for (const auto& ratio : check.measured_over_model) RC_ASSERT(!ratio || (*ratio >= 0 && std::isfinite(*ratio)));
  for (const double scale : variance_scale_of(check)) RC_ASSERT(scale >= 0.01 && scale <= 1);
}

RC_GTEST_PROP(NoiseCheckProperty, SitesThatAreNoNumbersTakeTheirWindowsOut, ()) {
  auto raw = any_plane(size_between(18, 300), size_between(18, 200), 0, 100);
  const RawElectronsView view{raw.view(), any_phase()};
  const RawNoise noise{.variance_e2 = {4, 4, 4}};
  InlineExecutor one;
  const long all = check_noise(view, noise, one).windows;
  raw.at(size_between(0, raw.width() - 1), size_between(0, raw.height() - 1)) = std::nanf("");
  const long left = check_noise(view, noise, one).windows;
  RC_ASSERT(all > 0);
  RC_ASSERT(left == all || left == all - 1);  // parts of 128 cells hold 14 windows of 9 and two cells more
  std::fill_n(raw.data(), raw.size(), std::nanf(""));
  const NoiseCheck none = check_noise(view, noise, one);
  RC_ASSERT(none.windows == 0 && !none.measured_over_model[0]);
}

// Read noise alone: what the model adds for the light of a block is little beside it, 2 % at 3 electrons.
RC_GTEST_PROP(NoiseCheckProperty, TheRatioIsThatOfWhatThereIsOverWhatIsSaid, ()) {
  const denoise_testing::Camera camera{.phase = any_phase(), .read_noise_e = any_between(3, 30)};
  constexpr int width = 512, height = 384, sixteenths = width / 16 * (height / 16);
  const auto raw = denoise_testing::exposed(camera, denoise_testing::flat(0, 0, 0), width, height,
                                            *rc::gen::arbitrary<std::uint32_t>());
  RawNoise said = camera.noise();
  const double factor = any_decade(-0.5, 2);
  for (double& variance : said.variance_e2) variance *= factor;
  InlineExecutor one;
  const auto check = check_noise({raw.view(), camera.phase}, said, one);
  const double error = std::sqrt(2 / (48 * std::floor(sixteenths / 10.0)));  // 48 details in each of those blocks
  // 0.06: the light's 2 % beside a variance that is said to be a third.
  RC_ASSERT(std::abs(check.measured_over_model[0].value() * factor - 1) < 6 * error + 0.06);
}

}  // namespace
}  // namespace lowlux::denoise
