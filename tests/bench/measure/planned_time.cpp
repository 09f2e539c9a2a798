// Compares what the planner predicts of time with the clock.
//   measure planned-time budget [DRAW [FRAMES]]
//       FRAMES (default 40) of 0.3 to 4 MP and budgets, others for each number DRAW (default: the day, so that it is
//       not chosen): the plan's time against prediction and budget by the wall clock, its error against the best of all
//       plans that fit; exit code 1 if fewer than 95 % keep all three
//   measure planned-time saved
//       the 300 of the promise's scenes in 6.3 MP: the plan's time against everything's, and what is seen of the
//       difference over the tolerance; exit code 1 if one exceeds it. These frames are sampled and go by regions
// Each frame is planned and developed five times as the command line does it, by the machine's pace of that moment:
// "wall/pred" is the median of what the wall clock says over what was predicted, and the verdict goes by that clock.
// The times in the table are for the comparison of plans: a fixed piece of work (isp/cost/speed_probe.h) is timed
// before each run, and a time is the median of its ratio to that work, in milliseconds of the moment the frame was
// planned.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "isp/cost/cost_measurement.h"
#include "isp/cost/speed_probe.h"
#include "isp/metrics/picture_metrics.h"
#include "isp/pipeline/develop.h"
#include "isp/pipeline/plan.h"
#include "tests/bench/measure/measure.h"
#include "tests/scenarios/bench_raw.h"
#include "tests/scenarios/planner_scene.h"
#include "tests/scenarios/seen_difference.h"
#include "tests/support/executors.h"

namespace lowlux::isp {
namespace {

using test::two_threads;

constexpr double min_kept = 0.95;  // of the frames

double seconds_of(const RawFrame& frame, const DevelopOptions& options, Encoded8* picture = nullptr) {
  const double start_ms = test::wall_ms();
  Result<Developed> done = develop(frame, options, two_threads);
  const double seconds = 1e-3 * (test::wall_ms() - start_ms);
  if (!done) std::printf("failed: %s\n", done.error().message.c_str());
  if (done && picture != nullptr) *picture = std::get<Encoded8>(std::move(done->picture));
  return seconds;
}

/// The machine when it is calibrated, and after.
class Clock {
 public:
  Clock() : cost_(*measure_cost(two_threads, [](double, const std::string&) {})) {
    std::printf("calibrated at a pace of %.1f ms\n", 1e3 * cost_.pace_s);
  }

  /// What things cost at the moment, as the command line takes it before each file.
  std::shared_ptr<const CostModel> now() {
    auto cost = std::make_shared<CostModel>(cost_);
    cost->pace = *pace_now(pace_, two_threads) / cost_.pace_s;
    return cost;
  }
  /// @param cost    of the moment whose pace is meant
  /// @param rounds  how often @param picture  as developed
  /// @return seconds at that pace
  double time(const CostModel& cost, const RawFrame& frame, const DevelopOptions& options, int rounds,
              Encoded8& picture) {
    std::vector<double> ratios;
    for (int i = 0; i < rounds; ++i) {
      const double unit_s = *pace_.seconds(two_threads);
      ratios.push_back(seconds_of(frame, options, &picture) / unit_s);
    }
    return median(ratios) * cost.pace * cost_.pace_s;
  }

 private:
  SpeedProbe pace_;
  CostModel cost_;
};

struct Way {
  std::optional<denoise::Level> level;
  bool lines = false;
  double seconds = 0;
  double error = 0;
};

DevelopOptions by_hand(const Way& way) {
  DevelopOptions options;
  options.denoise.mode = way.level ? DenoiseChoice::Mode::level : DenoiseChoice::Mode::off;
  options.denoise.level = way.level.value_or(denoise::Level::draft);
  options.denoise.line_noise = way.lines;
  options.effects.emplace().all = true;
  return options;
}

/// The least that the planner has to do.
DevelopOptions min_work() {
  DevelopOptions options;
  options.denoise.mode = DenoiseChoice::Mode::automatic;
  options.effects.emplace().tolerance_delta_e = 1000;
  return options;
}

double error_of(const Encoded8& picture, const PictureTruth& truth) {
  RenderedPicture rendered{light_of_codes(picture), light_of_codes(picture)};
  return picture_error(rendered, truth, two_threads).ciede2000;
}

/// The same camera without noise.
SceneLinear truth_of(const DenoiseShot& shot) {
  DenoiseShot mean{shot.light, shot.white_e, shot.signal_e.clone(), shot.signal_e.clone()};
  for (std::size_t i = 0; i < mean.raw_e.size(); ++i) mean.raw_e.data()[i] += static_cast<float>(shot.light.dark_e);
  Encoded8 picture;
  DevelopOptions options = by_hand({});
  options.find_defects = false;
  seconds_of(raw_of(mean, {}, 7).frame, options, &picture);
  return light_of_codes(picture);
}

/// Everything there is to choose from, measured.
std::vector<Way> exhaustive(Clock& clock, const CostModel& cost, const RawFrame& frame, const PictureTruth& truth) {
  std::vector<Way> out;
  for (int level = 0; level <= 4; ++level) {
    for (const bool lines : {false, true}) {
      if (level == 0 && lines) continue;
      Way way{level == 0 ? std::nullopt : std::optional(static_cast<denoise::Level>(level - 1)), lines};
      Encoded8 picture;
      const int rounds = way.level == denoise::Level::best ? 1 : 5;
      way.seconds = clock.time(cost, frame, by_hand(way), rounds, picture);
      way.error = error_of(picture, truth);
      out.push_back(way);
    }
  }
  return out;
}

std::string words_of(const StepPlan& plan) {
  std::string out(plan.level ? name_of(*plan.level) : "none");
  if (plan.lines && plan.level) out += ", lines";
  return out;
}

/// What is wrong with a plan's time.
struct Misses {
  bool over = false, off = false;
};

Misses misses(double taken_s, double predicted_s, double budget_s) {
  return {taken_s > 1.2 * budget_s, std::fabs(predicted_s / taken_s - 1) > 0.2};
}

/// As the command line does it, by the wall clock: the machine's pace is taken, then the frame is planned and
/// developed. Medians of the shares of budget and prediction that were taken.
struct WallShares {
  double of_budget = 0, of_prediction = 0;
  int refused = 0;  // of five rounds, at the pace of that moment
};

WallShares by_the_wall(Clock& clock, const RawFrame& frame, DevelopOptions options) {
  std::vector<double> of_budget, of_prediction;
  int refused = 0;
  for (int round = 0; round < 5; ++round) {
    options.effects->cost = clock.now();
    const double start_ms = test::wall_ms();
    const Result<Developed> done = develop(frame, options, two_threads);
    const double seconds = 1e-3 * (test::wall_ms() - start_ms);
    if (!done) {
      ++refused;
      continue;
    }
    of_budget.push_back(seconds / *options.effects->budget_s);
    of_prediction.push_back(seconds / *done->plan.effects->predicted_s);
  }
  return {median(of_budget), median(of_prediction), refused};
}

/// The day of today in UTC, as 20261123.
std::uint64_t draw_of_today() {
  const std::chrono::year_month_day day(std::chrono::floor<std::chrono::days>(std::chrono::system_clock::now()));
  return static_cast<std::uint64_t>(int{day.year()}) * 10000 + unsigned{day.month()} * 100 + unsigned{day.day()};
}

int budgets(std::uint64_t draw, std::uint32_t frames) {
  std::printf("draw %llu\n", static_cast<unsigned long long>(draw));
  Clock clock;
  int over = 0, off = 0, worse = 0, kept = 0, refused = 0, wall_over = 0, wall_off = 0;
  std::printf("  # picture            light   MP   budget predicted  taken wall/pred  error   best  plan\n");
  for (std::uint32_t i = 0; i < frames; ++i) {
    test::Draws draws(20261123 + draw, 79, i);
    const BenchPicture& whole = test::held_out_picture(draws.below(4), two_threads);
    const double megapixels = draws.log_uniform(0.3, 4);
    const int width = 2 * static_cast<int>(std::sqrt(1.5e6 * megapixels) / 2), height = 2 * (width / 3);
    const BenchPicture picture = test::drawn_part(whole, draws, width, height);
    const DenoiseLight light{draws.log_uniform(1, 2000), draws.log_uniform(0.1, 100), draws.log_uniform(1, 5)};
    const SensorFlaws flaws{draws.log_uniform(0.01, 3), draws.log_uniform(0.01, 3), draws.log_uniform(1e-6, 1e-3),
                            1000};
    const DenoiseShot shot = take(picture, light, i);
    const BenchRaw raw = raw_of(shot, flaws, i);
    const SceneLinear truth_light = truth_of(shot);
    const PictureTruth truth(truth_light.view(), two_threads);
    const auto cost = clock.now();
    const std::vector<Way> ways = exhaustive(clock, *cost, raw.frame, truth);
    Encoded8 made;
    const double min_s = clock.time(*cost, raw.frame, min_work(), 5, made);
    const double max_s = std::ranges::max(ways, {}, &Way::seconds).seconds;
    DevelopOptions options;
    options.denoise.mode = DenoiseChoice::Mode::automatic;
    options.effects.emplace().cost = cost;
    options.effects->tolerance_delta_e.reset();
    const double budget_s = draws.log_uniform(1.3 * min_s, 1.3 * max_s);
    options.effects->budget_s = budget_s;
    const Result<Developed> planned = develop(raw.frame, options, two_threads);
    if (!planned) {
      ++refused;
      std::printf("%3u %.1f MP, refused: %s\n", i, 1e-6 * width * height, planned.error().message.c_str());
      continue;
    }
    const StepPlan& plan = *planned->plan.effects;
    const double taken_s = clock.time(*cost, raw.frame, options, 9, made);
    const double error = error_of(made, truth);
    double best = std::numeric_limits<double>::infinity();
    for (const Way& way : ways) {
      if (way.seconds <= budget_s) best = std::min(best, way.error);
    }
    const auto [too_long, wrong] = misses(taken_s, *plan.predicted_s, budget_s);
    const WallShares wall = by_the_wall(clock, raw.frame, options);
    const Misses by_wall =
        wall.refused > 2 ? Misses{true, false} : misses(wall.of_budget, wall.of_budget / wall.of_prediction, 1);
    const bool bad = error > 1.05 * best;
    over += too_long ? 1 : 0;
    off += wrong ? 1 : 0;
    wall_over += by_wall.over ? 1 : 0;
    wall_off += by_wall.off ? 1 : 0;
    worse += bad ? 1 : 0;
    kept += by_wall.over || by_wall.off || bad ? 0 : 1;
    std::printf("%3u %-14s %9s %4.1f %8.1f %9.1f %6.1f %9.2f %6.3f %6.3f  %s%s%s%s\n", i, picture.name.c_str(),
                name_of(DenoiseLight{std::round(light.mean_e), std::round(light.dark_e), 0}).c_str(),
                1e-6 * width * height, 1e3 * budget_s, 1e3 * *plan.predicted_s, 1e3 * taken_s, wall.of_prediction,
                error, best, words_of(plan).c_str(), by_wall.over ? "; OVER" : "", by_wall.off ? "; PREDICTION" : "",
                bad ? "; ERROR" : "");
    std::fflush(stdout);
  }
  std::printf(
      "draw %llu, of %u by the wall clock: %d more than 20 %% over the budget or refused, %d predicted more than 20 %% "
      "wrong; %d more than 5 %% worse than the best that fits; %d without any of it. In units of the fixed work: %d "
      "over, %d predicted wrong\n",
      static_cast<unsigned long long>(draw), frames, wall_over + refused, wall_off, worse, kept, over, off);
  return kept < min_kept * frames ? 1 : 0;
}

void print_quantiles(const char* what, std::vector<double> values) {
  std::ranges::sort(values);
  std::printf("%s, %zu scenes of 6.3 MP: ", what, values.size());
  for (const int percent : {0, 10, 25, 50, 75, 90, 100}) {
    std::printf(" %d %% %.2f", percent, values[(values.size() - 1) * static_cast<std::size_t>(percent) / 100]);
  }
  std::printf("\n");
}

int saved() {
  std::vector<double> shares, of_tolerance;
  for (std::uint32_t i = 0; i < 300; ++i) {
    const test::PlannerScene scene = test::planner_scene(i, 3072, 2048, two_threads);
    const Result<Developed> done = develop(scene.raw.frame, scene.ways(false), two_threads);
    if (!done) {
      std::printf("%3u not developed: %s\n", i, done.error().message.c_str());
      return 1;
    }
    const StepPlan& plan = *done->plan.effects;
    std::vector<double> planned, everything;
    Encoded8 by_plan, with_everything;
    for (int round = 0; round < 3; ++round) {
      planned.push_back(seconds_of(scene.raw.frame, scene.ways(false), &by_plan));
      everything.push_back(seconds_of(scene.raw.frame, scene.ways(true), &with_everything));
    }
    shares.push_back(1 - median(planned) / median(everything));
    of_tolerance.push_back(seen_difference(by_plan, with_everything, two_threads).percentile95 / scene.tolerance);
    std::printf("%3u %9s tolerance %4.2f%s  %6.1f of %6.1f ms: %5.2f; seen over tolerance %.2f  %s%s\n", i,
                name_of(DenoiseLight{std::round(scene.light.mean_e), std::round(scene.light.dark_e), 0}).c_str(),
                scene.tolerance, scene.options.look.look == Look::eye ? ", eye" : "     ", 1e3 * median(planned),
                1e3 * median(everything), shares.back(), of_tolerance.back(), words_of(plan).c_str(),
                plan.regions ? ", by regions" : "");
  }
  print_quantiles("time saved", shares);
  print_quantiles("seen over tolerance", of_tolerance);
  return std::ranges::max(of_tolerance) < 1 ? 0 : 1;
}

}  // namespace
}  // namespace lowlux::isp

int lowlux::test::measure_planned_time(Arguments& arguments) {
  const bool saved = arguments.one_of({"budget", "saved"}) == "saved";
  const std::uint64_t draw = saved ? 0 : arguments.next(isp::draw_of_today(), std::uint64_t{0});
  const std::uint32_t frames = saved ? 0 : arguments.next(std::uint32_t{40}, std::uint32_t{1});
  arguments.end();
  return saved ? isp::saved() : isp::budgets(draw, frames);
}
