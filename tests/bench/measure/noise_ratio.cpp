// Compares noise that differs from place to place with noise that is the same everywhere: see denoise/README.md.
#include <array>
#include <cmath>
#include <cstdio>
#include <string>

#include "denoise/denoiser.h"
#include "isp/base/random/random.h"
#include "isp/bench/scenes/denoise_scene.h"
#include "isp/reproduce/bench_picture.h"
#include "tests/bench/measure/measure.h"

namespace {

using namespace lowlux;
using denoise::Level;
using isp::DenoiseLight;
using isp::DenoiseShot;

constexpr int frames = 8;

constexpr int block_px = 8;

/// Holds which squares of 64 pixels, or of one block, hold a single frame; the others are means.
struct Pattern {
  const char* name;
  bool (*single)(int x, int y, int width);
};

constexpr std::array patterns{
    Pattern{"halves", [](int x, int, int width) { return 2 * x >= width; }},
    Pattern{"1 of 16", [](int x, int y, int) { return x / 64 % 4 == 1 && y / 64 % 4 == 2; }},
    Pattern{"64 px", [](int x, int y, int) { return (x / 64 + y / 64) % 2 == 0; }},
    Pattern{"8 px", [](int x, int y, int) { return (x / block_px + y / block_px) % 2 == 0; }}};

Plane<float> mean_of_frames(const isp::BenchPicture& picture, const DenoiseLight& light, DenoiseShot& last) {
  Plane<float> sum;
  for (int i = 0; i < frames; ++i) {
    last = isp::take(picture, light, isp::seed_of(picture, light) + 7000 * static_cast<std::uint64_t>(i));
    if (i == 0) {
      sum = last.raw_e.clone();
      continue;
    }
    for (std::size_t k = 0; k < sum.size(); ++k) sum.data()[k] += last.raw_e.data()[k];
  }
  for (std::size_t k = 0; k < sum.size(); ++k) sum.data()[k] /= static_cast<float>(frames);
  return sum;
}

/// Sums squared errors of white-balanced values where a frame is single, and where it is a mean.
struct SquaredErrors {
  std::array<double, 2> squared{};
  std::array<double, 2> count{};
  double db(int single) const { return -10 * std::log10(squared[single] / count[single]); }
};

struct Scene {
  const DenoiseShot& shot;
  const Plane<float>& mean_e;
  const Pattern& pattern;

  bool single(int x, int y) const {
    return pattern.single(x / block_px * block_px, y / block_px * block_px, mean_e.width());
  }
  NoiseRatio ratio() const {
    const int columns = ratio_blocks(mean_e.width(), block_px), rows = ratio_blocks(mean_e.height(), block_px);
    NoiseRatio out{.block_px = block_px, .ratio = Plane<float>(columns, rows)};
    for (int j = 0; j < rows; ++j) {
      for (int i = 0; i < columns; ++i) out.ratio.at(i, j) = single(i * block_px, j * block_px) ? 1 : 1.0f / frames;
    }
    return out;
  }
  Plane<float> mixed() const {
    Plane<float> out = mean_e.clone();
    for (int y = 0; y < out.height(); ++y) {
      for (int x = 0; x < out.width(); ++x) {
        if (single(x, y)) out.at(x, y) = shot.raw_e.at(x, y);
      }
    }
    return out;
  }
  void add(const Plane<float>& got_e, SquaredErrors& error) const {
    for (int y = 0; y < got_e.height(); ++y) {
      for (int x = 0; x < got_e.width(); ++x) {
        const int which = single(x, y) ? 1 : 0;
        const double gain = isp::bench_white_gain[static_cast<std::size_t>(colour_at(BayerPhase::rggb, x, y))];
        const double e = gain * static_cast<double>(got_e.at(x, y) - shot.signal_e.at(x, y)) / shot.white_e;
        error.squared[which] += e * e;
        error.count[which] += 1;
      }
    }
  }
};

Plane<float> denoised(const Plane<float>& raw_e, const NoiseRatioView& ratio, const denoise::RawNoise& noise,
                      Level level) {
  Plane<float> out(raw_e.width(), raw_e.height());
  InlineExecutor one;
  denoise::Denoiser denoiser(raw_e.width(), raw_e.height(), 1, level);
  denoiser.run({raw_e.view(), BayerPhase::rggb, ratio}, noise, {.level = level, .white_gain = isp::bench_white_gain},
               out.view(), {}, one);
  return out;
}

/// Sums how much worse a mosaic of both is denoised than mosaics that are all of one kind [dB].
struct Difference {
  double single = 0;
  double mean = 0;
  int count = 0;
};

void add(const isp::BenchPicture& picture, const DenoiseLight& light, Level level,
         std::array<Difference, patterns.size()>& out) {
  DenoiseShot shot;
  const Plane<float> mean_e = mean_of_frames(picture, light, shot);
  NoiseRatio everywhere{.ratio = Plane<float>(1, 1)};
  everywhere.ratio.at(0, 0) = 1.0f / frames;
  const Plane<float> from_means = denoised(mean_e, view_of(&everywhere), shot.noise(), level);
  const Plane<float> from_single = denoised(shot.raw_e, {}, shot.noise(), level);
  for (std::size_t i = 0; i < patterns.size(); ++i) {
    const Scene scene{shot, mean_e, patterns[i]};
    const NoiseRatio ratio = scene.ratio();
    SquaredErrors both, means, single;
    scene.add(denoised(scene.mixed(), view_of(&ratio), shot.noise(), level), both);
    scene.add(from_means, means);
    scene.add(from_single, single);
    out[i].single += both.db(1) - single.db(1);
    out[i].mean += both.db(0) - means.db(0);
    ++out[i].count;
  }
}

void print_ratio_quality() {
  InlineExecutor one;
  const auto pictures = test::value_of(isp::read_bench_pictures(
      std::string(LOWLUX_TESTDATA) + "/pictures", isp::files_of(isp::PictureSet::held_out), {1024, 768}, one));
  std::printf(
      "PSNR of single frames / of means of %d, less that of mosaics that are all of one kind [dB], mean of the "
      "held-out pictures\n%-18s",
      frames, "");
  for (const Pattern& pattern : patterns) std::printf(" %13s", pattern.name);
  std::printf("\n");
  for (const DenoiseLight& light : {DenoiseLight{20, 2, 2}, DenoiseLight{4, 2, 2}, DenoiseLight{20, 200, 4}}) {
    for (const Level level : denoise::all_levels) {
      std::printf("%-8s %-9s", isp::name_of(light).c_str(), std::string(denoise::name_of(level)).c_str());
      std::array<Difference, patterns.size()> sums;
      for (const auto& picture : pictures) add(picture, light, level, sums);
      for (const Difference& d : sums) std::printf("   %+.2f/%+.2f", d.single / d.count, d.mean / d.count);
      std::printf("\n");
    }
  }
}

void print_ratio_times() {
  constexpr int width = 2000, height = 1500, rounds = 9;
  const Plane<float> raw_e = [] {
    Plane<float> out(width, height);
    for (int y = 0; y < height; ++y) {
      normal_row({.seed = 1}, 0, static_cast<std::uint32_t>(y), 1, {out.row(y), width});
      for (int x = 0; x < width; ++x) out.at(x, y) = 50 + 7 * out.at(x, y);
    }
    return out;
  }();
  NoiseRatio ratio{.block_px = block_px,
                   .ratio = Plane<float>(ratio_blocks(width, block_px), ratio_blocks(height, block_px))};
  for (std::size_t i = 0; i < ratio.ratio.size(); ++i) ratio.ratio.data()[i] = i % 5 == 0 ? 1 : 0.9f;
  const denoise::RawNoise noise{.variance_e2 = {2, 2, 2}};
  Plane<float> out(width, height);
  InlineExecutor one;
  denoise::Denoiser denoiser(width, height, 1, Level::best);
  std::printf("\nms/MP without / with a ratio, one thread, median CPU time of %d rounds\n", rounds);
  for (const Level level : denoise::all_levels) {
    const auto run = [&](const NoiseRatioView& view) {
      denoiser.run({raw_e.view(), BayerPhase::rggb, view}, noise, {.level = level}, out.view(), {}, one);
    };
    constexpr double megapixels = 1e-6 * width * height;
    std::array tasks{test::Task{"without", [&] { run({}); }, megapixels},
                     test::Task{"with", [&] { run(view_of(&ratio)); }, megapixels}};
    test::time_in_turn(tasks, rounds);
    std::printf("%-9s %7.2f / %7.2f\n", std::string(denoise::name_of(level)).c_str(), tasks[0].median_cpu_ms(),
                tasks[1].median_cpu_ms());
  }
}

}  // namespace

int lowlux::test::measure_noise_ratio(Arguments& arguments) {
  const bool times = !arguments.flag("--quality-only"), quality = !arguments.flag("--time-only");
  arguments.end();
  if (quality) print_ratio_quality();
  if (times) print_ratio_times();
  return 0;
}
