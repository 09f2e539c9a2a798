// The planner's promise: what `--effects auto` leaves out changes the picture by less than the tolerance, as 95 % of it
// is seen in means over 8 x 8 pixels, against the picture with everything done.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include "isp/pipeline/develop.h"
#include "tests/scenarios/planner_scene.h"
#include "tests/scenarios/seen_difference.h"

namespace lowlux::isp {
namespace {

PoolExecutor executor(2);

Developed developed(const test::PlannerScene& scene, bool all) {
  Result<Developed> out = develop(scene.raw.frame, scene.ways(all), executor);
  EXPECT_TRUE(out) << (out ? "" : out.error().message);
  return *std::move(out);
}

double quantile(std::vector<double> values, double share) {
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

// 300 scenes, 3000 in scripts/nightly, none above its tolerance: of the 3000 the nearest is at 0.93 of it. The time is
// that of large frames that are searched whole (reference_cost); planned_time_bench measures some.
TEST(PlannerPromise, WhatIsLeftOutStaysBelowTheToleranceOver300Scenes) {
  const std::uint32_t scenes = std::getenv("LOWLUX_NIGHTLY") == nullptr ? 300 : 3000;
  std::vector<double> saved, of_tolerance;
  std::array<int, 4> levels{};
  for (std::uint32_t i = 0; i < scenes; ++i) {
    const test::PlannerScene scene = test::planner_scene(i, 256, 192, executor);
    const Developed planned = developed(scene, false), everything = developed(scene, true);
    const double seen =
        seen_difference(std::get<Encoded8>(planned.picture), std::get<Encoded8>(everything.picture), executor)
            .percentile95;
    of_tolerance.push_back(seen / scene.tolerance);
    if (seen >= scene.tolerance) {
      const std::string_view level = planned.plan.effects->level ? name_of(*planned.plan.effects->level) : "none";
      std::printf("  scene %u: %.3f of its tolerance; %s e-, read noise %.2f, level %s%s\n", i, of_tolerance.back(),
                  name_of(scene.light).c_str(), scene.light.read_noise_e, std::string(level).c_str(),
                  planned.plan.rendering.look ? ", eye" : "");
    }
    saved.push_back(1 - *planned.plan.effects->predicted_s / *everything.plan.effects->predicted_s);
    ++levels[planned.plan.effects->level ? 1 + static_cast<std::size_t>(*planned.plan.effects->level) : 0];
  }
  std::printf("  seen over tolerance: median %.2f, 95 %% %.2f, largest %.2f\n", quantile(of_tolerance, 0.5),
              quantile(of_tolerance, 0.95), quantile(of_tolerance, 1));
  std::printf("  time saved: 10 %% %.2f, 25 %% %.2f, median %.2f, 75 %% %.2f, 90 %% %.2f\n", quantile(saved, 0.1),
              quantile(saved, 0.25), quantile(saved, 0.5), quantile(saved, 0.75), quantile(saved, 0.9));
  std::printf("  noise left %d, draft %d, standard %d, high %d\n", levels[0], levels[1], levels[2], levels[3]);
  EXPECT_LT(quantile(of_tolerance, 1), 1);
  EXPECT_GE(quantile(saved, 0.5), 0.25);
  for (const int count : levels) EXPECT_GT(count, 0) << "every level is called for by some scene";
}

}  // namespace
}  // namespace lowlux::isp
