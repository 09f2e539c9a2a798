// Times the temporal mean against memcpy, and measures what it gains on a still scene, how often it takes one to move,
// and what moving things leave behind: see denoise/README.md.
#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <span>

#include "denoise/temporal/temporal.h"
#include "tests/bench/measure/measure.h"
#include "tests/denoise/frames.h"

namespace {

using namespace lowlux;
using denoise_testing::Camera;
using denoise_testing::exposed;

/// Still frames, the same with light that changes a little from frame to frame, and frames that move there and back.
void print_temporal_times(int rounds) {
  constexpr int width = 2000, height = 1500;
  const Camera camera{.dark_e = {2, 2, 2, 2}};
  const auto scene = denoise_testing::waves(50);
  const auto displaced = [&](int x, int y) { return scene(x + 6, y + 4); };
  const std::array raw{exposed(camera, scene, width, height, 1), exposed(camera, scene, width, height, 2),
                       exposed(camera, displaced, width, height, 3)};
  Plane<float> out(width, height), share(width / 2, height / 2);
  denoise::TemporalMean still(width, height, 1), moving(width, height, 1);
  InlineExecutor one;
  int round = 0;
  const auto run = [&](denoise::TemporalMean& temporal, int frame, double light) {
    temporal.run({raw[frame].view(), camera.phase}, camera.noise(), light, {}, out.view(), share.view(), one);
  };
  constexpr double pixels = static_cast<double>(width) * height;
  std::array tasks{
      test::Task{"memcpy", [&] { std::memcpy(out.data(), raw[round % 2].data(), out.size() * sizeof(float)); }, pixels},
      test::Task{"light as before", [&] { run(still, round % 2, 1); }, pixels},
      test::Task{"light that changes", [&] { ++round, run(still, round % 2, round % 2 == 0 ? 1.01 : 1 / 1.01); },
                 pixels},
      test::Task{"scene that moves", [&] { run(moving, 2 * (round % 2), 1); }, pixels}};
  test::time_in_turn(tasks, rounds);
  const double copy = 1e6 * tasks[0].median_cpu_ms();
  std::printf("one thread, %d rounds, median CPU time [ns/pixel], and of memcpy's\n", rounds);
  std::printf("%-22s %5.2f\n", "memcpy", copy);
  for (const test::Task& task : std::span(tasks).subspan(1)) {
    const double ns = 1e6 * task.median_cpu_ms();
    std::printf("%-22s %5.2f %5.1f\n", task.name.c_str(), ns, ns / copy);
  }
}

/// PSNR gained on a still scene of waves.
void print_gain() {
  constexpr int width = 512, height = 512;
  const Camera camera{.read_noise_e = 2};
  const auto scene = denoise_testing::waves(20);
  denoise::TemporalMean temporal(width, height, 1);
  Plane<float> out(width, height);
  InlineExecutor one;
  double first = 0;
  std::printf("\nstill scene, 20 e-, read noise 2 e-: PSNR gained [dB], and of a plain mean\n");
  for (int n = 1; n <= 64; ++n) {
    const auto raw = exposed(camera, scene, width, height, 100 + static_cast<std::uint64_t>(n));
    temporal.run({raw.view(), camera.phase}, camera.noise(), 1, {}, out.view(), {}, one);
    double sum = 0;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        sum += std::pow(static_cast<double>(out.at(x, y)) - denoise_testing::mean_e(camera, scene, x, y), 2);
      }
    }
    if (n == 1) first = sum;
    if ((n & (n - 1)) == 0)
      std::printf("%4d frames %6.2f %6.2f\n", n, 10 * std::log10(first / sum), 10 * std::log10(n));
  }
}

/// Share of blocks of a flat scene that move, of what was asked for, in the second frame and in the eighth.
void print_alarms() {
  constexpr int side = 1024, runs = 6;
  constexpr std::array rates{1e-4, 1e-3, 1e-2};
  InlineExecutor one;
  std::printf("\nstill blocks that move, of what was asked for: second frame, eighth; read noise / light [e-]\n%-10s",
              "");
  for (const double rate : rates) std::printf(" %12g", rate);
  std::printf("\n");
  for (const double read_e : {1.0, 2.0}) {
    for (const double mean_e : {0.1, 0.5, 4.0, 100.0, 1e4}) {
      const Camera camera{.read_noise_e = read_e};
      std::array<std::array<double, 8>, rates.size()> moved{};
      Plane<float> out(side, side);
      for (std::size_t k = 0; k < rates.size(); ++k) {
        denoise::TemporalMean mean(side, side, 1);
        for (std::uint64_t i = 0; i < 8 * runs; ++i) {
          const auto raw = exposed(camera, denoise_testing::flat(mean_e, mean_e, mean_e), side, side, 1000 + i);
          if (i % 8 == 0) mean.reset();
          moved[k][i % 8] +=
              mean.run({raw.view(), camera.phase}, camera.noise(), 1, {.false_alarm = rates[k]}, out.view(), {}, one) /
              runs;
        }
      }
      std::printf("%3g / %-5g", read_e, mean_e);
      for (std::size_t k = 0; k < rates.size(); ++k)
        std::printf("   %4.2f  %4.2f", moved[k][1] / rates[k], moved[k][7] / rates[k]);
      std::printf("\n");
    }
  }
}

/// Squares of fourfold light, and lamps of one site that are 20 and 200 times brighter than what is around them.
void print_alarms_of_structure() {
  constexpr int width = 1600, height = 1200, frames = 8;
  const Camera camera{.read_noise_e = 2};
  Plane<float> out(width, height);
  InlineExecutor one;
  std::printf("\nthe same of a scene of small squares and lamps, at 0.001, mean of frames 2 to 8\n");
  for (const double dark_e : {2.0, 20.0, 200.0}) {
    const auto scene = [dark_e](int x, int y) {
      const double lamp = x % 37 != 5 ? 0 : y % 41 == 7 ? 200 : y % 41 == 9 ? 20 : 0;
      const double e = dark_e * (lamp + ((x / 13 + y / 17) % 2 == 0 ? 1 : 4));
      return std::array{0.5 * e, e, 0.7 * e};
    };
    denoise::TemporalMean temporal(width, height, 1);
    double moved = 0;
    for (int n = 0; n < frames; ++n) {
      const auto raw = exposed(camera, scene, width, height, 300 + static_cast<std::uint64_t>(n));
      const double share = temporal.run({raw.view(), camera.phase}, camera.noise(), 1, {}, out.view(), {}, one);
      if (n > 0) moved += share / (frames - 1);
    }
    std::printf("%6g e- %5.2f\n", dark_e, moved / 1e-3);
  }
}

/// What a bar of 60 sites that moves by 3 for each frame leaves behind, over the deviation of a raw value.
void print_trails() {
  constexpr int width = 640, height = 480, first = 40, frames = 80;
  constexpr std::array behind{1, 6, 11, 21};
  const Camera camera{.read_noise_e = 2};
  Plane<float> out(width, height);
  InlineExecutor one;
  std::printf(
      "\nleft behind a moving bar, over the standard deviation of a raw value; light, contrast over the same\n%-12s",
      "");
  for (const int sites : behind) std::printf(" %6d", sites);
  std::printf(" sites behind\n");
  for (const double mean_e : {4.0, 100.0}) {
    for (const double contrast : {0.5, 1.0, 2.0, 4.0}) {
      const double deviation_e = std::sqrt(mean_e + 4);
      denoise::TemporalMean temporal(width, height, 1);
      std::array<double, behind.size()> left{};
      for (int n = 0; n < frames; ++n) {
        const int right = 100 + 3 * n;
        const auto scene = [&](int x, int) {
          const double e = mean_e + (x >= right - 60 && x < right ? contrast * deviation_e : 0);
          return std::array{e, e, e};
        };
        const auto raw = exposed(camera, scene, width, height, 500 + static_cast<std::uint64_t>(n));
        temporal.run({raw.view(), camera.phase}, camera.noise(), 1, {}, out.view(), {}, one);
        for (std::size_t i = 0; n >= first && i < behind.size(); ++i) {
          for (int y = 0; y < height; ++y) left[i] += static_cast<double>(out.at(right - 60 - behind[i], y)) - mean_e;
        }
      }
      std::printf("%3g e-, %-4g", mean_e, contrast);
      for (const double sum : left) std::printf(" %6.2f", sum / (height * (frames - first)) / deviation_e);
      std::printf("\n");
    }
  }
}

}  // namespace

int lowlux::test::measure_temporal(Arguments& arguments) {
  const int rounds = arguments.next(21, 5);
  arguments.end();
  print_temporal_times(rounds);
  print_gain();
  print_alarms();
  print_alarms_of_structure();
  print_trails();
  return 0;
}
