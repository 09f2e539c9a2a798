#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string_view>
#include <utility>
#include <variant>

#include "isp/pipeline/develop.h"
#include "isp/pipeline/plan/plan_develop.h"
#include "isp/pipeline/render/frame_tiles.h"
#include "isp/pipeline/render/pipeline.h"
#include "tests/hard_cases/rendering.h"
#include "tests/pipeline/night_frames.h"

// Frames above 25 megapixels, which are developed piece by piece. What large ones hold repeats itself, so that a small
// frame, developed whole, is the truth for each of their parts.
namespace lowlux::hard_cases {
namespace {

using denoise::Level;

constexpr std::string_view pieces_group = "Other cases";
constexpr int period = 512;  // px, a multiple of tile_lattice_px
constexpr double mean_e = 20, read_noise_e = 1.5;

/// Waves, an edge, a lamp, a star; its own noise, the same in every frame.
RawFrame one_period() {
  const auto scene = [](int x, int y) {
    auto light = denoise_testing::waves(mean_e)(x, y);
    const bool star = x / 2 == 127 && y / 2 == 60, lamp = std::hypot(x - 300, y - 200) < 9;
    for (double& e : light) e = lamp ? 5000 : e + (star ? 150 : 0);
    return light;
  };
  return test::night_frame({.read_noise_e = read_noise_e}, scene, period, period);
}

/// So many periods, a defect in each.
RawFrame repeated(int columns, int rows) {
  RawFrame frame = one_period();
  const Plane<std::uint16_t> part = std::move(frame.raw.dn);
  frame.raw.dn = Plane<std::uint16_t>(columns * period, rows * period);
  frame.raw.active = frame.raw.default_crop = {0, 0, columns * period, rows * period};
  for (int y = 0; y < rows * period; ++y) {
    for (int i = 0; i < columns; ++i) {
      std::copy_n(part.row(y % period), period, frame.raw.dn.row(y) + std::ptrdiff_t{i} * period);
    }
  }
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) frame.corrections.defects.push_back({i * period + 255, j * period + 256, 1, 1});
  }
  return frame;
}

isp::DevelopOptions options_for(const isp::DenoiseChoice& denoise, SampleType samples) {
  isp::DevelopOptions options{.exposure_ev = 0, .samples = samples, .find_defects = false, .denoise = denoise};
  if (samples == SampleType::f32) {
    options.tone = isp::ToneCurve::none;
    options.space = OutputSpace::camera;
  }
  return options;
}

isp::DenoiseChoice level_choice(Level level) {
  return {.mode = isp::DenoiseChoice::Mode::level, .level = level, .line_noise = false};
}

struct FewAndMany {
  isp::Developed few;
  isp::Developed many;
};
/// 3 x 3 periods, developed whole, and so many that they go by pieces; nothing if either fails.
std::optional<FewAndMany> few_and_many_periods(int columns, int rows, const isp::DevelopOptions& options,
                                               Denormals mode) {
  PoolExecutor pool(2);
  test::ExecutorInMode executor(pool, mode);
  const RawFrame many_periods = repeated(columns, rows);
  auto few = in_mode(mode, [&] { return isp::develop(repeated(3, 3), options, executor); });
  auto many = in_mode(mode, [&] { return isp::develop(many_periods, options, executor); });
  EXPECT_TRUE(few && many);
  if (!few || !many) return {};
  EXPECT_TRUE(isp::is_tiled(many_periods.raw, many->plan, {}));
  return FewAndMany{std::move(*few), std::move(*many)};
}

/// Of a large frame, the rows of each inner period that differ from those of the middle of a small one.
double rows_of_100_megapixels(Denormals mode) {
  constexpr int columns = 20, rows = 19;
  const auto both = few_and_many_periods(columns, rows, options_for({}, SampleType::u8), mode);
  if (!both) return NAN;
  const auto &few = std::get<Encoded8>(both->few.picture).codes, &all = std::get<Encoded8>(both->many.picture).codes;
  double wrong = 0;
  for (int y = period; y < (rows - 1) * period; ++y) {
    const std::uint8_t* const expected = few.row(period + y % period) + 3 * period;
    for (int i = 1; i < columns - 1; ++i) {
      wrong += std::memcmp(all.row(y) + std::ptrdiff_t{3} * i * period, expected, 3 * period) == 0 ? 0 : 1;
    }
  }
  return wrong;
}

TEST(HardCaseExtreme, AHundredMegapixelsAtOnce) {
  HardCase row({pieces_group, "100 megapixels: rendered in one call, in tiles (file)", "the same rows of a small image",
                "rows that differ"});
  row.none(Path::reference, "the reference consists of plain loops")
      .none(levels, "frames above 25 megapixels: see the next row");
  row.on_each_set(0, codes_of_100_megapixels);
  row.on(Path::file, 0, rows_of_100_megapixels);
  row.none(Path::live, "the frame needs 200 MB");
}

/// Largest difference of parts of two float pictures, over the noise of a raw value of the same light.
struct Part {
  const SceneLinear& picture;
  int x;
  int y;
};
double difference(const Part& a, const Part& b, int width, int height, const isp::DevelopPlan& plan) {
  double worst = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const double electrons = (*plan.levels.electrons_at_white)[0] / plan.rendering.white_gain[c];
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const auto one = static_cast<double>(a.picture.plane[c].at(a.x + x, a.y + y));
        const auto other = static_cast<double>(b.picture.plane[c].at(b.x + x, b.y + y));
        const double noise_e = std::sqrt(std::max(electrons * other, 0.0) + read_noise_e * read_noise_e);
        keep_worst(worst, electrons * std::abs(one - other) / noise_e);
      }
    }
  }
  return worst;
}

/// A frame of 1.5 periods in cores of 256 px against the same as a whole.
double error_of_pieces(Level level, Denormals mode) {
  RawFrame frame = repeated(2, 1);
  frame.raw.active = frame.raw.default_crop = {0, 0, 768, 256};
  frame.corrections.defects.clear();
  PoolExecutor pool(2);
  test::ExecutorInMode executor(pool, mode);
  return in_mode(mode, [&] {
    const auto plan = isp::plan_develop(frame, options_for(level_choice(level), SampleType::f32), executor);
    EXPECT_TRUE(plan);
    if (!plan) return double{NAN};
    const auto rendered = [&](const isp::TileLimits& limits) {
      EXPECT_EQ(isp::is_tiled(frame.raw, *plan, limits), limits.max_whole_px == 0);
      Picture out = isp::make_picture(*plan);
      isp::Pipeline(executor, limits).render(frame, *plan, out);
      return std::get<SceneLinear>(std::move(out));
    };
    const SceneLinear pieces = rendered({.max_whole_px = 0, .side_px = 256}), whole = rendered({});
    return difference({pieces, 0, 0}, {whole, 0, 0}, 768, 256, *plan);
  });
}

/// Inner periods of 26 megapixels against the middle of 2.4.
double error_of_26_megapixels(Denormals mode) {
  constexpr int columns = 11, rows = 9;
  const auto options = options_for(level_choice(Level::standard), SampleType::f32);
  const auto both = few_and_many_periods(columns, rows, options, mode);
  if (!both) return NAN;
  const auto &few = std::get<SceneLinear>(both->few.picture), &all = std::get<SceneLinear>(both->many.picture);
  double worst = 0;
  for (int j = 1; j < rows - 1; ++j) {
    for (int i = 1; i < columns - 1; ++i) {
      keep_worst(worst,
                 difference({all, i * period, j * period}, {few, period, period}, period, period, both->many.plan));
    }
  }
  return worst;
}

// At most 3 % of the noise of a raw value (frame_tiles.h), of which the levels leave 5 % and more.
TEST(HardCaseExtreme, AQuarterOfAHundredMegapixelsByPieces) {
  HardCase row({pieces_group, "frames above 25 megapixels: 26 (file), cores of 256 px (others), denoised",
                "the same frame developed without tiles: interior of 2.4 megapixels (file), everything (others)",
                "noise of a raw value"});
  row.none(Path::reference, "has no tiles");
  constexpr Bound bound{0.03, "the bound is that of any scene (frame_tiles.h)"};
  for (std::size_t i = 0; i < levels.size(); ++i) {
    row.on(levels[i], bound, [&](Denormals m) { return error_of_pieces(denoise::all_levels[i], m); });
  }
  row.on_each_set(bound, [](Denormals m) { return error_of_pieces(Level::standard, m); });
  row.on(Path::file, bound, error_of_26_megapixels).none(Path::live, "streams are processed without tiles");
}

}  // namespace
}  // namespace lowlux::hard_cases
