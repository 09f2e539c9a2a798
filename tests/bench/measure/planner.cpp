// Measures what the planner of developing rests on.
//   measure planner levels   what levels of noise reduction change, over what is predicted of the noise, on the tuning
//                            pictures: the figures of isp/pipeline/budget/step_plan.cpp
//   measure planner bounds   what they change over the bound that the planner has of it, in 300 drawn parts of the
//                            tuning pictures at drawn lights, and likewise of the held-out ones
//   measure planner truth    what they leave against the noise-free picture, on the tuning pictures
#include <algorithm>
#include <array>
#include <cstdio>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "isp/pipeline/budget/step_candidates.h"
#include "isp/pipeline/budget/visible_noise.h"
#include "isp/pipeline/develop.h"
#include "isp/pipeline/plan/plan_develop.h"
#include "isp/pipeline/render/pipeline.h"
#include "tests/bench/measure/measure.h"
#include "tests/scenarios/bench_raw.h"
#include "tests/scenarios/planner_scene.h"
#include "tests/scenarios/seen_difference.h"
#include "tests/support/executors.h"

namespace lowlux::isp {
namespace {

using test::two_threads;

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
  Result<DevelopPlan> plan = plan_develop(raw.frame, options, two_threads);
  plan->noise_reduction.options.chroma_start = how.start;
  Pipeline pipeline(two_threads);
  Picture picture = make_picture(*plan);
  pipeline.render(raw.frame, *plan, picture);
  return std::get<Encoded8>(std::move(picture));
}

struct Predicted {
  double snr = 0;
  LevelNoise noise;
};

Predicted predicted(const BenchRaw& raw) {
  DevelopOptions options;
  options.denoise.mode = DenoiseChoice::Mode::level;
  options.denoise.level = denoise::Level::draft;
  options.find_defects = false;
  const Result<DevelopPlan> plan = plan_develop(raw.frame, options, two_threads);
  const Thumbnail thumbnail = make_thumbnail(raw.frame, plan->levels.black, two_threads);
  const auto blocks = visibility_blocks(raw.frame, options, plan->levels, plan->rendering, plan->noise_reduction.noise,
                                        thumbnail, two_threads);
  return {*plan->noise_reduction.snr, level_noise(blocks)};
}

std::vector<BenchPicture> pictures_of(PictureSet set, const PicturePart& part) {
  return test::value_of(read_bench_pictures(LOWLUX_TESTDATA "/pictures", files_of(set), part, two_threads));
}

/// The same camera without noise.
BenchRaw noise_free(const DenoiseShot& shot) {
  DenoiseShot mean{shot.light, shot.white_e, shot.signal_e.clone(), shot.signal_e.clone()};
  for (std::size_t i = 0; i < mean.raw_e.size(); ++i) mean.raw_e.data()[i] += static_cast<float>(shot.light.dark_e);
  return raw_of(mean, {}, 7);
}

void against_truth(PictureSet set) {
  using denoise::Level;
  std::printf("picture e-/dark pred | none draft standard high best: p95 and mean against the noise-free, over pred\n");
  for (const BenchPicture& picture : pictures_of(set, {384, 256})) {
    for (const DenoiseLight light :
         {DenoiseLight{2000, 2, 1.5}, DenoiseLight{200, 2, 1.5}, DenoiseLight{60, 2, 1.5}, DenoiseLight{20, 2, 1.5},
          DenoiseLight{6, 2, 1.5}, DenoiseLight{2, 2, 1.5}, DenoiseLight{4, 200, 4}}) {
      const DenoiseShot shot = take(picture, light, 7);
      const BenchRaw raw = raw_of(shot, {}, 7);
      const auto [snr, noise] = predicted(raw);
      const double expected = noise.all;
      const Encoded8 truth = developed(noise_free(shot), {});
      std::printf("%-12s %8s %6.2f | %6.2f", picture.name.c_str(), name_of(light).c_str(), snr, expected);
      for (const Reduction& way : {Reduction{}, Reduction{Level::draft, {}}, Reduction{Level::standard, {}},
                                   Reduction{Level::high, {}}, Reduction{Level::best, {}}}) {
        const SeenDifference seen = seen_difference(developed(raw, way), truth, two_threads);
        std::printf(" %5.3f %5.3f,", seen.percentile95 / expected, seen.mean / expected);
      }
      std::printf("\n");
    }
  }
}

void levels(PictureSet set) {
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
  for (const BenchPicture& picture : pictures_of(set, {512, 384})) {
    for (const DenoiseLight light : {DenoiseLight{2000, 2, 1.5}, DenoiseLight{600, 2, 1.5}, DenoiseLight{200, 2, 1.5},
                                     DenoiseLight{60, 2, 1.5}, DenoiseLight{20, 2, 1.5}, DenoiseLight{6, 2, 1.5},
                                     DenoiseLight{2, 2, 1.5}, DenoiseLight{20, 200, 4}, DenoiseLight{4, 200, 4}}) {
      const BenchRaw raw = raw_of(take(picture, light, 7), {}, 7);
      const auto [snr, noise] = predicted(raw);
      const double expected = noise.all;
      const Encoded8 best = developed(raw, {Level::high, {}});
      std::printf("%-12s %8s %6.2f | %6.2f", picture.name.c_str(), name_of(light).c_str(), snr, expected);
      for (const Reduction& way : ways) {
        const double seen = seen_difference(developed(raw, way), best, two_threads).percentile95;
        if (!way.level) std::printf(" %6.2f |", seen);
        std::printf(" %5.3f", seen / expected);
      }
      std::printf("\n");
    }
  }
}

double quantile(std::vector<double>& values, double share) {
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

void bounds(PictureSet set) {
  using denoise::Level;
  constexpr double min_delta_e = 0.22;  // nine tenths of the least tolerance of the planner's promise
  constexpr std::array ways{std::optional<Level>(), std::optional(Level::draft), std::optional(Level::standard)};
  const std::vector<BenchPicture> pictures = pictures_of(set, {});
  std::map<std::pair<std::string, std::size_t>, std::vector<double>> found;
  for (std::uint32_t i = 0; i < 300; ++i) {
    test::Draws draws(set == PictureSet::tuning ? 777 : 778, 80, i);
    const BenchPicture part = test::drawn_part(pictures[static_cast<std::size_t>(draws.below(4))], draws, 384, 256);
    const DenoiseLight light{draws.log_uniform(1, 1e4), draws.log_uniform(0.01, 200), draws.log_uniform(0.5, 8)};
    const BenchRaw raw = raw_of(take(part, light, i), {}, i);
    const LevelNoise noise = predicted(raw).noise;
    const Encoded8 best = developed(raw, {Level::high, {}});
    for (std::size_t way = 0; way < ways.size(); ++way) {
      const double seen = seen_difference(developed(raw, {ways[way], {}}), best, two_threads).percentile95;
      if (seen >= min_delta_e) found[{part.name, way}].push_back(seen / noise.left_by(ways[way]));
    }
  }
  constexpr std::array names{"none", "draft", "standard"};
  for (auto& [of, ratios] : found) {
    std::printf("%-14s %-8s of %3zu parts: median %.2f, 95 %% %.2f, largest %.2f\n", of.first.c_str(), names[of.second],
                ratios.size(), quantile(ratios, 0.5), quantile(ratios, 0.95), quantile(ratios, 1));
  }
}

}  // namespace
}  // namespace lowlux::isp

int lowlux::test::measure_planner(Arguments& arguments) {
  using isp::PictureSet;
  const std::string what = arguments.one_of({"levels", "truth", "bounds"});
  arguments.end();
  if (what == "levels") isp::levels(PictureSet::tuning);
  if (what == "truth") isp::against_truth(PictureSet::tuning);
  if (what == "bounds") {
    isp::bounds(PictureSet::tuning);
    isp::bounds(PictureSet::held_out);
  }
  return 0;
}
