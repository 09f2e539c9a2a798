// The planner's promise: what `--effects auto` leaves out changes the picture by less than the tolerance, as 95 % of it
// is seen in means over 8 x 8 pixels, against the picture with everything done.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "isp/base/random.h"
#include "isp/bench/bench_raw.h"
#include "isp/bench/seen_difference.h"
#include "isp/pipeline/develop.h"
#include "tests/support/reference_cost.h"

namespace lowlux::isp {
namespace {

PoolExecutor executor(2);

/// Numbers in 0..1 that depend on the scene's index alone.
class Draws {
 public:
  explicit Draws(std::uint32_t scene) : scene_(scene) {}
  double uniform() { return (words_at({20261122, 0, 78}, scene_, next_++)[0] + 0.5) * 0x1p-32; }
  double log_uniform(double low, double high) { return low * std::pow(high / low, uniform()); }
  int below(int count) { return static_cast<int>(uniform() * count); }

 private:
  std::uint32_t scene_;
  std::uint32_t next_ = 0;
};

/// A part of a picture behind the lens.
BenchPicture part_of(const BenchPicture& picture, Draws& draws, int width, int height) {
  const int x0 = draws.below(picture.linear.width() - width + 1),
            y0 = draws.below(picture.linear.height() - height + 1);
  BenchPicture out{picture.name, SceneLinear(width, height)};
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < height; ++y) {
      std::copy_n(picture.linear.plane[c].row(y0 + y) + x0, width, out.linear.plane[c].row(y));
    }
  }
  return out;
}

const std::vector<BenchPicture>& pictures() {
  static const std::vector<BenchPicture> all = [] {
    std::vector<BenchPicture> out;
    for (const std::string_view name : files_of(PictureSet::held_out)) {
      const auto path = (std::filesystem::path(LOWLUX_TESTDATA) / "pictures" / name).string();
      auto picture = read_bench_picture(path, 0, 0, executor);
      EXPECT_TRUE(picture) << name;
      if (picture) out.push_back(*std::move(picture));
    }
    return out;
  }();
  return all;
}

/// One scene, with the ranges everything is drawn from.
struct Drawn {
  BenchRaw raw;
  DevelopOptions options;
  double tolerance;
  DenoiseLight light;
};

Drawn draw(std::uint32_t index) {
  Draws draws(index);
  const BenchPicture picture = part_of(pictures()[static_cast<std::size_t>(draws.below(4))], draws, 256, 192);
  Drawn out;
  out.light = {draws.log_uniform(1, 1e4), draws.log_uniform(0.01, 200), draws.log_uniform(0.5, 8)};
  SensorFlaws flaws;
  flaws.row_noise_e = draws.log_uniform(0.01, 3);
  flaws.column_noise_e = draws.log_uniform(0.01, 3);
  flaws.hot_pixel_fraction = draws.log_uniform(1e-6, 1e-3);
  flaws.hot_pixel_e = draws.log_uniform(10, 1e4);
  out.raw = raw_of(take(picture, out.light, index), flaws, index);
  out.tolerance = draws.log_uniform(0.25, 4);
  if (draws.uniform() < 0.5) {
    out.options.look.look = Look::eye;
    out.options.look.scene_luminance_cd_m2 = draws.log_uniform(1e-3, 1e3);
  }
  if (draws.uniform() < 0.5) {  // a profile knows the dark charge
    out.options.black.choice = BlackChoice::measured;
    out.options.black.measured = out.raw.black;
  }
  out.options.denoise.mode = DenoiseChoice::Mode::automatic;
  return out;
}

Developed developed(const Drawn& scene, bool all) {
  DevelopOptions options = scene.options;
  options.effects.emplace().all = all;
  options.effects->tolerance_delta_e = scene.tolerance;
  options.effects->cost = test::reference_cost();
  options.look.tolerance = scene.tolerance;
  // Glare and the eye's own noise are a matter of taste: no tolerance calls for them.
  if (all && options.look.look == Look::eye) {
    options.look.which = LookChoice::Which::listed;
    options.look.listed = {true, true, true, true, false, false};
  }
  Result<Developed> out = develop(scene.raw.frame, options, executor);
  EXPECT_TRUE(out) << (out ? "" : out.error().message);
  return *std::move(out);
}

double quantile(std::vector<double> values, double share) {
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

// 300 scenes; 3000 in scripts/nightly.
TEST(PlannerPromise, WhatIsLeftOutStaysBelowTheToleranceOver300Scenes) {
  const std::uint32_t scenes = std::getenv("LOWLUX_NIGHTLY") == nullptr ? 300 : 3000;
  std::vector<double> saved, of_tolerance;
  std::array<int, 4> levels{};
  for (std::uint32_t i = 0; i < scenes; ++i) {
    const Drawn scene = draw(i);
    const Developed planned = developed(scene, false), everything = developed(scene, true);
    const double seen =
        seen_difference(std::get<Encoded8>(planned.picture), std::get<Encoded8>(everything.picture), executor)
            .percentile95;
    EXPECT_LT(seen, scene.tolerance) << "scene " << i << ": " << name_of(scene.light) << " e-, read noise "
                                     << scene.light.read_noise_e << (planned.plan.look ? ", eye" : "") << ", level "
                                     << (planned.plan.effects->level ? name_of(*planned.plan.effects->level)
                                                                     : std::string_view("none"));
    of_tolerance.push_back(seen / scene.tolerance);
    saved.push_back(1 - *planned.plan.effects->predicted_s / *everything.plan.effects->predicted_s);
    ++levels[planned.plan.effects->level ? 1 + static_cast<std::size_t>(*planned.plan.effects->level) : 0];
  }
  std::printf("  seen over tolerance: median %.2f, 95 %% %.2f, largest %.2f\n", quantile(of_tolerance, 0.5),
              quantile(of_tolerance, 0.95), quantile(of_tolerance, 1));
  std::printf("  time saved: 10 %% %.2f, 25 %% %.2f, median %.2f, 75 %% %.2f, 90 %% %.2f\n", quantile(saved, 0.1),
              quantile(saved, 0.25), quantile(saved, 0.5), quantile(saved, 0.75), quantile(saved, 0.9));
  std::printf("  noise left %d, draft %d, standard %d, high %d\n", levels[0], levels[1], levels[2], levels[3]);
  EXPECT_GE(quantile(saved, 0.5), 0.25);
  for (const int count : levels) EXPECT_GT(count, 0) << "every level is called for by some scene";
}

}  // namespace
}  // namespace lowlux::isp
