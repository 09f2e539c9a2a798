// Measures how well the times of merging are predicted and budgets kept:
//     measure merge-budget [DRAW] [MERGES]
// Frames of 0.4 to 9 MP, 2 to 12 of them, at rest or hand-held, with budgets between the cheapest and the best method.
// DRAW is the seed (default 1). The machine is measured first.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "isp/base/executor.h"
#include "isp/cost/merge_cost.h"
#include "isp/cost/speed_probe.h"
#include "isp/cost/timing_frame.h"
#include "isp/pipeline/merge/merge_budget.h"
#include "isp/pipeline/merge/merge_frames.h"
#include "tests/bench/measure/measure.h"

namespace lowlux::isp {
namespace {

constexpr double tolerance = 0.2;  // of budget and prediction

const char* name_of_alignment(MergeAlignment alignment) {
  return alignment == MergeAlignment::none ? "none" : alignment == MergeAlignment::cells ? "cells" : "subpixel";
}

/// Returns the codes of a frame displaced by whole cells.
RawFrame displaced(const RawFrame& frame, int cells) {
  RawFrame out = copy_of(frame);
  const int width = out.raw.dn.width(), height = out.raw.dn.height(), px = 2 * cells;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      out.raw.dn.at(x, y) =
          frame.raw.dn.at(std::min(x + px, width - 2 + (x & 1)), std::min(y + px, height - 2 + (y & 1)));
    }
  }
  return out;
}

struct Draw {
  int frames;
  FrameSize size;
  bool moves;
  double place;  // of the budget between the times of the cheapest and the best method, logarithmic
};

/// Returns whether budget and prediction were kept.
bool run(const Draw& draw, std::shared_ptr<CostModel> cost, SpeedProbe& pace, Executor& executor) {
  std::vector<RawFrame> frames;
  frames.reserve(static_cast<std::size_t>(draw.frames));
  for (int i = 0; i < draw.frames; ++i) {
    const RawFrame frame = timing_frame(draw.size, {20, 5}, 0, static_cast<std::uint32_t>(i));
    frames.push_back(displaced(frame, draw.moves ? i : 0));
  }
  const double now_s = test::value_of(pace_now(pace, executor));
  cost->pace = now_s / cost->pace_s;
  const MergeWork work{.frames = draw.frames, .size = cost_size(draw.size.width, draw.size.height)};
  const double min_s = predicted_merge_s(*cost, work, {MergeAlignment::none, false}, false);
  const double most_s = predicted_merge_s(*cost, work, {MergeAlignment::subpixel, true}, true);
  const double budget_s = 1.05 * min_s * std::pow(most_s / min_s, draw.place);
  const FrameReader read = [&](int index, bool) {
    DevelopOptions options;
    options.denoise.mode = DenoiseChoice::Mode::automatic;
    options.effects = ProcessingGoal{.budget_s = budget_s, .cost = cost};
    return Result<FrameToMerge>({copy_of(frames[static_cast<std::size_t>(index)]), options, {}});
  };
  const auto merged = merge_frames(draw.frames, read, {}, executor);
  if (!merged) {
    std::printf("%s\n", merged.error().message.c_str());
    return false;
  }
  const MergePlan& plan = *merged->plan;
  const double ratio = plan.taken_s / plan.predicted_s;
  std::printf("%4.1f MP  %2d frames %-9s budget %6.0f ms  %-6s %-8s  predicted %6.0f  taken %6.0f  ratio %.2f\n",
              work.size.megapixels, draw.frames, draw.moves ? "hand-held" : "at rest", 1e3 * budget_s,
              plan.method.robust ? "robust" : "plain", name_of_alignment(plan.method.alignment), 1e3 * plan.predicted_s,
              1e3 * plan.taken_s, ratio);
  return std::fabs(ratio - 1) <= tolerance && plan.taken_s <= (1 + tolerance) * budget_s;
}

}  // namespace
}  // namespace lowlux::isp

int lowlux::test::measure_merge_budget(Arguments& arguments) {
  using namespace isp;
  const unsigned seed = arguments.next(1U, 0U);
  const int merges = arguments.next(30, 1);
  arguments.end();
  PoolExecutor executor(std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 8));
  SpeedProbe pace;
  auto cost = std::make_shared<CostModel>();
  cost->pace_s = value_of(pace_now(pace, executor));
  if (const auto measured = measure_merge_cost(pace, cost->pace_s, executor, *cost); !measured) return 1;
  std::printf(
      "time for each megapixel over that of the fixed workload, and as it is without calibration (), of frames of");
  for (const CostPoint& point : cost->points[static_cast<std::size_t>(CostPart::merge_frame)]) {
    std::printf(" %.2f", point.megapixels);
  }
  std::printf(" MP\n");
  for (int i = static_cast<int>(CostPart::merge_frame); i < cost_parts; ++i) {
    const auto part = static_cast<CostPart>(i);
    std::printf("%-18s", std::string(name_of(part)).c_str());
    for (const CostPoint& point : cost->points[static_cast<std::size_t>(part)]) {
      const double shipped_s = reference_cost().seconds(part, {.megapixels = point.megapixels});
      std::printf("  %6.3f (%.3f)", point.seconds / cost->pace_s / point.megapixels,
                  shipped_s / reference_cost().pace_s / point.megapixels);
    }
    std::printf("\n");
  }
  std::mt19937 random(seed);
  const auto whole = [&](int least, int most) { return std::uniform_int_distribution<>(least, most)(random); };
  int kept = 0;
  for (int i = 0; i < merges; ++i) {
    const int width = 2 * whole(400, 1840);
    const Draw draw{whole(2, 12),
                    {width, width * 2 / 3 / 2 * 2},
                    whole(0, 1) == 1,
                    std::uniform_real_distribution<>(0, 1.2)(random)};
    kept += run(draw, cost, pace, executor) ? 1 : 0;
  }
  std::printf("%d of %d within %.0f %% of budget and prediction\n", kept, merges, 100 * tolerance);
  return kept >= 0.9 * merges ? 0 : 1;
}
