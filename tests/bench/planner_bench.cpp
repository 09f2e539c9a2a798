// What the planner of developing rests on, and how well it keeps to what it says.
//   planner_bench levels   what levels of noise reduction change, beside what is predicted of the noise, on the tuning
//                          pictures: the figures of isp/pipeline/plan_effects.cpp
//   planner_bench truth    what they leave against the noise-free picture, likewise
//   planner_bench budget   40 frames and budgets: the plan's time against prediction and budget, its error against the
//                          best of all plans that fit
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "isp/base/random.h"
#include "isp/bench/bench_raw.h"
#include "isp/bench/cost_measurement.h"
#include "isp/bench/picture_metrics.h"
#include "isp/bench/seen_difference.h"
#include "isp/pipeline/develop.h"
#include "isp/pipeline/pipeline.h"
#include "isp/pipeline/plan.h"
#include "isp/pipeline/visible_noise.h"

namespace lowlux::isp {
namespace {

PoolExecutor executor(2);

struct Reduction {
  std::optional<denoise::Level> level;
  std::optional<int> start;
};

Encoded8 developed(const BenchRaw& raw, const Reduction& how) {
  DevelopOptions options;
  options.denoise.mode = how.level ? DenoiseChoice::Mode::level : DenoiseChoice::Mode::off;
  options.denoise.level = how.level.value_or(denoise::Level::draft);
  options.find_defects = false;
  options.denoise.line_noise = false;
  Result<DevelopPlan> plan = plan_develop(raw.frame, options, executor);
  plan->noise_reduction.options.chroma_start = how.start;
  Pipeline pipeline(executor);
  Picture picture = make_picture(*plan);
  pipeline.render(raw.frame, *plan, picture);
  return std::get<Encoded8>(std::move(picture));
}

double predicted(const BenchRaw& raw, double& snr) {
  DevelopOptions options;
  options.denoise.mode = DenoiseChoice::Mode::level;
  options.denoise.level = denoise::Level::draft;
  options.find_defects = false;
  const Result<DevelopPlan> plan = plan_develop(raw.frame, options, executor);
  const Thumbnail thumbnail = make_thumbnail(raw.frame, plan->black, executor);
  const auto blocks = seen_blocks(raw.frame, *plan, plan->noise_reduction.noise, thumbnail);
  std::vector<float> rms;
  for (const SeenBlock& b : blocks) rms.push_back(b.noise_delta_e);
  snr = *plan->noise_reduction.snr;
  return seen_percentile(rms);
}

/// The same camera without noise.
BenchRaw noise_free(const DenoiseShot& shot) {
  DenoiseShot mean{shot.light, shot.white_e, shot.signal_e.clone(), shot.signal_e.clone()};
  for (std::size_t i = 0; i < mean.raw_e.size(); ++i) mean.raw_e.data()[i] += static_cast<float>(shot.light.dark_e);
  return raw_of(mean, {}, 7);
}

int against_truth(PictureSet set) {
  using denoise::Level;
  std::printf("picture e-/dark pred | none draft standard high best: p95 and mean against the noise-free, over pred\n");
  for (const std::string_view name : files_of(set)) {
    const auto path = (std::filesystem::path(LOWLUX_TESTDATA) / "pictures" / name).string();
    const auto picture = read_bench_picture(path, 384, 256, executor);
    for (const DenoiseLight light :
         {DenoiseLight{2000, 2, 1.5}, DenoiseLight{200, 2, 1.5}, DenoiseLight{60, 2, 1.5}, DenoiseLight{20, 2, 1.5},
          DenoiseLight{6, 2, 1.5}, DenoiseLight{2, 2, 1.5}, DenoiseLight{4, 200, 4}}) {
      const DenoiseShot shot = take(*picture, light, 7);
      const BenchRaw raw = raw_of(shot, {}, 7);
      double snr = 0;
      const double expected = predicted(raw, snr);
      const Encoded8 truth = developed(noise_free(shot), {});
      std::printf("%-12s %8s %6.2f | %6.2f", std::string(name).c_str(), name_of(light).c_str(), snr, expected);
      for (const Reduction& way : {Reduction{}, Reduction{Level::draft, {}}, Reduction{Level::standard, {}},
                                   Reduction{Level::high, {}}, Reduction{Level::best, {}}}) {
        const SeenDifference seen = seen_difference(developed(raw, way), truth, executor);
        std::printf(" %5.3f %5.3f,", seen.percentile95 / expected, seen.mean / expected);
      }
      std::printf("\n");
    }
  }
  return 0;
}

int levels(PictureSet set) {
  using denoise::Level;
  const std::array<Reduction, 9> ways{{{{}, {}},
                                       {Level::draft, {}},
                                       {Level::draft, 1},
                                       {Level::draft, 2},
                                       {Level::standard, {}},
                                       {Level::standard, 1},
                                       {Level::high, 1},
                                       {Level::high, 2},
                                       {Level::high, 0}}};
  std::printf("%-12s %8s %6s | %6s %6s | none draft d1 d2 standard s1 h1 h2 h0 (p95 against high, over predicted)\n",
              "picture", "e-/dark", "snr", "pred", "none");
  for (const std::string_view name : files_of(set)) {
    const auto path = (std::filesystem::path(LOWLUX_TESTDATA) / "pictures" / name).string();
    const auto picture = read_bench_picture(path, 512, 384, executor);
    for (const DenoiseLight light : {DenoiseLight{2000, 2, 1.5}, DenoiseLight{600, 2, 1.5}, DenoiseLight{200, 2, 1.5},
                                     DenoiseLight{60, 2, 1.5}, DenoiseLight{20, 2, 1.5}, DenoiseLight{6, 2, 1.5},
                                     DenoiseLight{2, 2, 1.5}, DenoiseLight{20, 200, 4}, DenoiseLight{4, 200, 4}}) {
      const BenchRaw raw = raw_of(take(*picture, light, 7), {}, 7);
      double snr = 0;
      const double expected = predicted(raw, snr);
      const Encoded8 best = developed(raw, {Level::high, {}});
      std::printf("%-12s %8s %6.2f | %6.2f", std::string(name).c_str(), name_of(light).c_str(), snr, expected);
      for (const Reduction& way : ways) {
        const double seen = seen_difference(developed(raw, way), best, executor).percentile95;
        if (!way.level) std::printf(" %6.2f |", seen);
        std::printf(" %5.3f", seen / expected);
      }
      std::printf("\n");
    }
  }
  return 0;
}

/// Numbers in 0..1, the same in each run.
class Draws {
 public:
  explicit Draws(std::uint32_t scene) : scene_(scene) {}
  double uniform() { return (words_at({20261123, 0, 79}, scene_, next_++)[0] + 0.5) * 0x1p-32; }
  double log_uniform(double low, double high) { return low * std::pow(high / low, uniform()); }

 private:
  std::uint32_t scene_;
  std::uint32_t next_ = 0;
};

/// One way of developing by hand, measured.
struct Way {
  std::optional<denoise::Level> level;
  bool defects;
  bool lines;
  double seconds = 0;
  double error = 0;
};

DevelopOptions by_hand(const Way& way) {
  DevelopOptions options;
  options.denoise.mode = way.level ? DenoiseChoice::Mode::level : DenoiseChoice::Mode::off;
  options.denoise.level = way.level.value_or(denoise::Level::draft);
  options.find_defects = way.defects;
  options.denoise.line_noise = way.lines;
  options.effects.emplace().all = true;
  return options;
}

struct Measured {
  double seconds = 0;  // median of three
  Encoded8 picture;
  std::optional<double> predicted_s;
};

Result<Measured> measured(const RawFrame& frame, const DevelopOptions& options) {
  Measured out;
  std::vector<double> taken;
  for (int i = 0; i < 3; ++i) {
    const auto start = std::chrono::steady_clock::now();
    Result<Developed> developed = develop(frame, options, executor);
    if (!developed) return tl::make_unexpected(developed.error());
    taken.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    if (i < 2) continue;
    out.picture = std::get<Encoded8>(std::move(developed->picture));
    if (developed->plan.effects) out.predicted_s = developed->plan.effects->predicted_s;
  }
  std::ranges::sort(taken);
  out.seconds = taken[1];
  return out;
}

double error_of(const Encoded8& picture, const PictureTruth& truth) {
  RenderedPicture rendered{light_of_codes(picture), light_of_codes(picture)};
  return picture_error(rendered, truth, executor).ciede2000;
}

/// Everything there is to choose from, measured.
std::vector<Way> exhaustive(const RawFrame& frame, const PictureTruth& truth) {
  std::vector<Way> out;
  for (int level = 0; level <= 4; ++level) {
    for (const bool defects : {false, true}) {
      for (const bool lines : {false, true}) {
        if (level == 0 && lines) continue;
        Way way{level == 0 ? std::nullopt : std::optional(static_cast<denoise::Level>(level - 1)), defects, lines};
        const auto done = measured(frame, by_hand(way));
        way.seconds = done->seconds;
        way.error = error_of(done->picture, truth);
        out.push_back(way);
      }
    }
  }
  return out;
}

int budgets() {
  const auto cost =
      measure_cost(executor, [](double, const std::string& what) { std::fprintf(stderr, "%s\n", what.c_str()); });
  const auto shared = std::make_shared<const CostModel>(*cost);
  int over = 0, off = 0, worse = 0;
  std::printf("  # picture        light    MP  budget predicted measured [ms]  error  best  level\n");
  for (std::uint32_t i = 0; i < 40; ++i) {
    Draws draws(i);
    const auto names = files_of(PictureSet::held_out);
    const std::string_view name = names[static_cast<std::size_t>(draws.uniform() * 4)];
    const auto path = (std::filesystem::path(LOWLUX_TESTDATA) / "pictures" / name).string();
    const double size = draws.log_uniform(0.5, 1);
    const auto picture = read_bench_picture(path, static_cast<int>(768 * size), static_cast<int>(512 * size), executor);
    const DenoiseLight light{draws.log_uniform(1, 2000), draws.log_uniform(0.1, 100), draws.log_uniform(1, 5)};
    const SensorFlaws flaws{draws.log_uniform(0.01, 3), draws.log_uniform(0.01, 3), draws.log_uniform(1e-6, 1e-3),
                            1000};
    const DenoiseShot shot = take(*picture, light, i);
    const BenchRaw raw = raw_of(shot, flaws, i);
    const auto truth_codes = developed(noise_free(shot), {});
    const SceneLinear truth_light = light_of_codes(truth_codes);
    const PictureTruth truth(truth_light.view(), executor);
    const std::vector<Way> ways = exhaustive(raw.frame, truth);
    const auto [least, most] = std::ranges::minmax(ways, {}, &Way::seconds);
    DevelopOptions options;
    options.denoise.mode = DenoiseChoice::Mode::automatic;
    options.effects.emplace().cost = shared;
    options.effects->tolerance_delta_e.reset();
    options.effects->budget_s = draws.log_uniform(1.3 * least.seconds, 1.3 * most.seconds);
    const auto planned = measured(raw.frame, options);
    if (!planned) {
      std::printf("%3u refused: %s\n", i, planned.error().message.c_str());
      continue;
    }
    const double error = error_of(planned->picture, truth);
    double best = std::numeric_limits<double>::infinity();
    for (const Way& way : ways) {
      if (way.seconds <= *options.effects->budget_s) best = std::min(best, way.error);
    }
    const bool too_long = planned->seconds > 1.2 * *options.effects->budget_s;
    const bool wrong = std::fabs(*planned->predicted_s / planned->seconds - 1) > 0.2;
    const bool bad = error > 1.05 * best;
    over += too_long ? 1 : 0;
    off += wrong ? 1 : 0;
    worse += bad ? 1 : 0;
    std::printf("%3u %-12s %9s %5.2f %7.1f %8.1f %8.1f %12.3f %6.3f %s%s%s\n", i, std::string(name).c_str(),
                name_of(DenoiseLight{std::round(light.mean_e), std::round(light.dark_e), 0}).c_str(),
                1e-6 * picture->linear.width() * picture->linear.height(), 1e3 * *options.effects->budget_s,
                1e3 * *planned->predicted_s, 1e3 * planned->seconds, error, best, too_long ? " over" : "",
                wrong ? " prediction" : "", bad ? " error" : "");
  }
  std::printf(
      "of 40: %d more than 20 %% over the budget, %d predicted more than 20 %% wrong, %d more than 5 %% worse than "
      "the best that fits\n",
      over, off, worse);
  return 0;
}

}  // namespace
}  // namespace lowlux::isp

int main(int argc, char** argv) {
  using lowlux::isp::PictureSet;
  const std::string what = argc > 1 ? argv[1] : "";
  if (what == "levels") return lowlux::isp::levels(PictureSet::tuning);
  if (what == "truth") return lowlux::isp::against_truth(PictureSet::tuning);
  if (what == "budget") return lowlux::isp::budgets();
  std::fprintf(stderr, "usage: planner_bench levels|truth|budget\n");
  return 2;
}
