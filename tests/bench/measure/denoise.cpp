// Times the denoiser against memcpy and against its reference: see denoise/README.md.
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

#include "denoise/denoiser.h"
#include "tests/bench/measure/measure.h"
#include "tests/denoise/frames.h"
#include "tests/reference/denoise_ref.h"

namespace {

using namespace lowlux;
using denoise::all_levels;
using denoise::DenoiseOptions;
using denoise::Level;
using denoise_testing::Camera;
using denoise_testing::exposed;

/// The reference, which leaves nothing out, takes the same time for every chroma start.
void print_table(const std::vector<test::Task>& tasks) {
  std::printf("%-26s %8s %10s %14s\n", "", "ms/MP", "x memcpy", "reference is x");
  double reference_ms = 0;
  for (const test::Task& task : tasks) {
    const double ms = task.median_cpu_ms();
    if (task.name == "reference") {
      reference_ms = ms;
    } else {
      std::printf("%-26s %8.2f %10.1f", task.name.c_str(), ms, ms / tasks[0].median_cpu_ms());
      std::printf(reference_ms > 0 ? " %14.0f\n" : "\n", reference_ms / ms);
    }
  }
}

void print_times(int rounds) {
  constexpr int width = 2000, height = 1500, small = 256;
  const Camera camera{.dark_e = {2, 2, 2, 2}};
  const auto raw = exposed(camera, denoise_testing::waves(50), width, height, 1);
  const auto part = exposed(camera, denoise_testing::waves(50), small, small, 1);
  Plane<float> out(width, height);
  denoise::Denoiser denoiser(width, height, 1, Level::best);
  InlineExecutor one;
  std::vector<test::Task> tasks;
  tasks.reserve(1 + 4 * all_levels.size());
  tasks.push_back({"memcpy", [&] { std::memcpy(out.data(), raw.data(), raw.size() * sizeof(float)); }, 3});
  for (const Level level : all_levels) {
    const DenoiseOptions options{.level = level, .chroma_start = 0};
    tasks.push_back({"reference",
                     [&, options] {
                       reference::denoise({part.view(), camera.phase}, camera.noise(), options);
                     },
                     small * small * 1e-6});
    for (const int start : {0, 1, 2}) {
      const DenoiseOptions with{.level = level, .chroma_start = start};
      tasks.push_back({std::string(denoise::name_of(level)) + ", chroma from " + std::to_string(start),
                       [&, with] {
                         denoiser.run({raw.view(), camera.phase}, camera.noise(), with, out.view(), {}, one);
                       },
                       3});
    }
  }
  test::time_in_turn(tasks, rounds);
  std::printf("target %s, one thread, %d rounds, median CPU time\n\n", denoise::denoiser_target(), rounds);
  print_table(tasks);
}

}  // namespace

int lowlux::test::measure_denoise(Arguments& arguments) {
  const int rounds = arguments.option("--rounds", 5, 5);
  arguments.end();
  print_times(rounds);
  return 0;
}
