// Times RawToRgb against memcpy of 60 MB in the same run; see docs/kernels.md.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "isp/base/executor.h"
#include "isp/base/image.h"
#include "isp/raw/kernel/raw_to_rgb.h"
#include "tests/bench/measure/measure.h"
#include "tests/reference/raw_to_rgb_ref.h"

namespace {

using namespace lowlux;

constexpr std::size_t memcpy_bytes = 60'000'000;
constexpr float black_dn = 512, white_dn = 16383;

struct Settings {
  int width;
  int height;
  int rounds;
  bool json;
};

/// White-balanced camera RGB to linear sRGB, typical of a consumer sensor; rows sum to 1.
constexpr std::array<float, 9> camera_to_srgb{1.70f, -0.60f, -0.10f, -0.20f, 1.55f, -0.35f, 0.02f, -0.52f, 1.50f};
constexpr std::array<float, 3> white_balance{2.0f, 1.0f, 1.6f};

isp::RgbTransform transform(bool move) { return {camera_to_srgb, {0.2126f, 0.7152f, 0.0722f}, 1.0f, move}; }

isp::SiteLevels levels() {
  isp::SiteLevels out;
  const float scale = 1 / (white_dn - black_dn);
  out.black = {black_dn, black_dn, black_dn, black_dn};
  out.gain = {scale * white_balance[0], scale * white_balance[1], scale * white_balance[1], scale * white_balance[2]};
  return out;
}

/// Camera RGB of a smooth scene: brightness over 8 stops, chroma varying by `saturation` around neutral.
std::array<double, 3> scene_colour(double x, double y, double saturation) {
  const double stops = 3.5 * std::sin(3 * x + 2 * y) + 0.5 * std::sin(61 * x) * std::sin(47 * y);
  const double brightness = 0.18 * std::exp2(0.55 * stops - 0.4);
  const double hue = 5 * std::sin(2.1 * x - 1.3 * y) + 3 * y;
  std::array<double, 3> out{};
  for (int c = 0; c < 3; ++c) out[c] = brightness * std::exp(saturation * std::cos(hue + 2.0944 * c));
  return out;
}

/// An RGGB mosaic of that scene with shot and read noise.
Plane<std::uint16_t> scene_mosaic(const Settings& settings, double saturation) {
  Plane<std::uint16_t> dn(settings.width, settings.height);
  std::minstd_rand random(1);
  std::normal_distribution<double> normal;
  std::vector<double> noise(1 << 16);
  for (double& n : noise) n = normal(random);
  for (int y = 0; y < settings.height; ++y) {
    std::uint32_t draw = random();
    for (int x = 0; x < settings.width; ++x) {
      const auto colour = scene_colour(x / 1000.0, y / 1000.0, saturation);
      const int c = static_cast<int>(colour_at(BayerPhase::rggb, x, y));
      const double signal_dn = colour[c] / white_balance[c] * (white_dn - black_dn);
      draw = draw * 1664525U + 1013904223U;
      const double value = black_dn + signal_dn + std::sqrt(0.6 * signal_dn + 30) * noise[draw >> 16];
      dn.at(x, y) = static_cast<std::uint16_t>(std::clamp(std::lround(value), 0L, static_cast<long>(white_dn)));
    }
  }
  return dn;
}

/// Share of pixels that the gamut move has to change.
double fraction_outside(isp::RawToRgb& kernel, const isp::RgbInput& in, SceneLinear& scratch) {
  InlineExecutor one;
  kernel.linear(in, transform(false), scratch.view(), one);
  std::size_t outside = 0;
  for (int y = 0; y < scratch.height(); ++y) {
    for (int x = 0; x < scratch.width(); ++x) {
      bool is_outside = false;
      for (const auto& plane : scratch.plane) is_outside |= plane.at(x, y) < 0 || plane.at(x, y) > 1;
      outside += is_outside;
    }
  }
  return static_cast<double>(outside) / (static_cast<double>(scratch.width()) * scratch.height());
}

/// Everything the tasks work on, made once and touched before timing.
struct Stage {
  Settings settings;
  Plane<std::uint16_t> natural, saturated;
  Plane<float> signed_natural;
  SceneLinear planes, half;
  Encoded8 codes8;
  Encoded16 codes16;
  ToneTable tone = reference::srgb_tone_table();
  std::vector<unsigned char> copy_from = std::vector<unsigned char>(memcpy_bytes, 1);
  std::vector<unsigned char> copy_to = std::vector<unsigned char>(memcpy_bytes, 2);
  isp::RawToRgb kernel;
  InlineExecutor one;
  PoolExecutor two{2};

  explicit Stage(const Settings& s)
      : settings(s),
        natural(scene_mosaic(s, 0.5)),
        saturated(scene_mosaic(s, 1.3)),
        signed_natural(s.width, s.height),
        planes(s.width, s.height),
        half(s.width / 2, s.height / 2),
        codes8{Plane<std::uint8_t>(3 * s.width, s.height)},
        codes16{Plane<std::uint16_t>(3 * s.width, s.height)},
        kernel(s.width, 2) {
    for (int y = 0; y < s.height; ++y) {
      for (int x = 0; x < s.width; ++x) {
        signed_natural.at(x, y) = (static_cast<float>(natural.at(x, y)) - black_dn) / (white_dn - black_dn);
      }
    }
  }

  static isp::DnMosaic dn(const Plane<std::uint16_t>& mosaic) { return {mosaic.view(), BayerPhase::rggb, levels()}; }
  isp::SignedMosaic floats() const {
    const auto& w = white_balance;
    return {signed_natural.view(), BayerPhase::rggb, {w[0], w[1], w[1], w[2]}};
  }
};

std::vector<test::Task> tasks_of(Stage& s) {
  std::vector<test::Task> tasks;
  tasks.push_back({"memcpy 60 MB", [&s] { std::memcpy(s.copy_to.data(), s.copy_from.data(), memcpy_bytes); }});
  for (const int threads : {1, 2}) {
    Executor& executor = threads == 1 ? static_cast<Executor&>(s.one) : s.two;
    const auto add = [&](std::string name, std::function<void()> run) {
      tasks.push_back({.name = std::move(name), .run = std::move(run), .threads = threads});
    };
    const auto to8 = [&s, &executor](const isp::RgbInput& in, bool move) {
      return [&s, &executor, in, move] { s.kernel.rgb8(in, transform(move), s.tone, s.codes8.codes.view(), executor); };
    };
    add("u16 to rgb8, gamut move, natural", to8(Stage::dn(s.natural), true));
    add("u16 to rgb8, gamut move, saturated", to8(Stage::dn(s.saturated), true));
    add("u16 to rgb8, no gamut move", to8(Stage::dn(s.natural), false));
    for (const isp::DemosaicMethod method : isp::all_demosaic_methods) {
      if (method == isp::DemosaicMethod::malvar) continue;
      isp::DnMosaic in = Stage::dn(s.natural);
      in.demosaic = {.method = method, .noise_std = 0.005f};
      add(fmt::format("the same, {}", name_of(method)), to8(in, false));
    }
    add("float to rgb8, gamut move, natural", to8(s.floats(), true));
    add("planes to rgb8, gamut move", to8(isp::CameraPlanes{std::as_const(s.planes).view()}, true));
    add("u16 to rgb16, gamut move, natural", [&s, &executor] {
      s.kernel.rgb16(Stage::dn(s.natural), transform(true), s.tone, s.codes16.codes.view(), executor);
    });
    add("bin 2x2, u16", [&s, &executor] { s.kernel.bin2x2(Stage::dn(s.natural), s.half.view(), executor); });
  }
  return tasks;
}

double minimum_ms(const test::Task& task) { return std::ranges::min(task.wall_times_ms); }

struct Shares {
  double natural;
  double saturated;
};

void print_table(const Stage& s, const std::vector<test::Task>& tasks, const Shares& outside) {
  const test::Task& copy = tasks[0];
  std::printf("target %s, %d x %d, %d rounds\n", isp::raw_to_rgb_target(), s.settings.width, s.settings.height,
              s.settings.rounds);
  std::printf("pixels outside the gamut: natural %.1f %%, saturated %.1f %%\n\n", 100 * outside.natural,
              100 * outside.saturated);
  std::printf("%-36s %7s | %8s %8s %8s | %8s %8s\n", "task", "threads", "median", "x memcpy", "minimum", "CPU",
              "x memcpy");
  for (const test::Task& t : tasks) {
    std::printf("%-36s %7d | %8.2f %8.2f %8.2f | %8.2f %8.2f\n", t.name.c_str(), t.threads, t.median_wall_ms(),
                t.median_wall_ms() / copy.median_wall_ms(), minimum_ms(t), t.median_cpu_ms(),
                t.median_cpu_ms() / copy.median_cpu_ms());
  }
  std::printf("\nms; CPU is the median of all threads together, and the ratio to trust where cores are shared\n");
}

void print_json(const Stage& s, const std::vector<test::Task>& tasks, const Shares& outside) {
  const test::Task& copy = tasks[0];
  std::printf("{\"target\": \"%s\", \"width\": %d, \"height\": %d, \"rounds\": %d,\n", isp::raw_to_rgb_target(),
              s.settings.width, s.settings.height, s.settings.rounds);
  std::printf(" \"natural_outside_gamut\": %.4f, \"saturated_outside_gamut\": %.4f,\n \"tasks\": [\n", outside.natural,
              outside.saturated);
  for (const test::Task& t : tasks) {
    std::printf(R"(  {"name": "%s", "threads": %d, "median_ms": %.3f, "min_ms": %.3f, "cpu_median_ms": %.3f,)",
                t.name.c_str(), t.threads, t.median_wall_ms(), minimum_ms(t), t.median_cpu_ms());
    std::printf(R"( "median_per_memcpy": %.3f, "min_per_memcpy": %.3f, "cpu_per_memcpy": %.3f}%s)",
                t.median_wall_ms() / copy.median_wall_ms(), minimum_ms(t) / minimum_ms(copy),
                t.median_cpu_ms() / copy.median_cpu_ms(), &t == &tasks.back() ? "\n" : ",\n");
  }
  std::printf(" ]}\n");
}

}  // namespace

int lowlux::test::measure_raw_to_rgb(Arguments& arguments) {
  const Settings settings{arguments.option("--width", 4000, 2), arguments.option("--height", 3000, 2),
                          arguments.option("--rounds", 31, 15), arguments.flag("--json")};
  arguments.end();
  const auto stage = std::make_unique<Stage>(settings);
  Shares outside{};
  outside.saturated = fraction_outside(stage->kernel, Stage::dn(stage->saturated), stage->planes);
  outside.natural = fraction_outside(stage->kernel, Stage::dn(stage->natural), stage->planes);  // planes stay natural
  std::vector<Task> tasks = tasks_of(*stage);
  time_in_turn(tasks, settings.rounds);
  (settings.json ? print_json : print_table)(*stage, tasks, outside);
  return 0;
}
