#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "isp/bench/peers/denoise_methods.h"
#include "isp/bench/peers/gat_denoise.h"

namespace lowlux::isp {
namespace {

constexpr std::array<int, 9> radii{0, 1, 2, 3, 4, 6, 8, 16, 32};
constexpr std::uint64_t tuning_seed = 0x7e57;

struct Sample {
  const BenchPicture* picture;
  DenoiseShot shot;
  PictureTruth truth;
  SceneLinear with_dark;
};

std::vector<Sample> samples_of(const std::vector<BenchPicture>& pictures, const DenoiseLight& light,
                               Executor& executor) {
  std::vector<Sample> out;
  out.reserve(pictures.size());
  for (const BenchPicture& picture : pictures) {
    DenoiseShot shot = take(picture, light, tuning_seed + out.size());
    BenchRenderer renderer(picture.linear.width(), executor);
    SceneLinear with_dark =
        renderer.render(shot.raw_e.view(), shot, NoiseLeft::all, exposure_with_dark(picture, shot)).light;
    out.push_back({&picture, std::move(shot), PictureTruth(picture.linear.view(), executor), std::move(with_dark)});
  }
  return out;
}

double chromatic_psnr_db(const std::vector<Sample>& samples, const ChromaticWindows& windows, Executor& executor) {
  double sum = 0;
  for (const Sample& sample : samples) {
    BenchRenderer renderer(sample.truth.width(), executor);
    const SceneLinear display = renderer.display_of(chromatic_filtered(sample.with_dark.view(), windows));
    sum += encoded_psnr_db(display.view(), sample.truth, executor);
  }
  return sum / static_cast<double>(samples.size());
}

/// Searches one radius after the other, each over all radii, twice.
ChromaticWindows best_windows(const std::vector<Sample>& samples, Executor& executor) {
  ChromaticWindows best{2, 2};
  double best_db = chromatic_psnr_db(samples, best, executor);
  for (int i = 0; i < 4; ++i) {
    int ChromaticWindows::*const radius =
        i % 2 == 0 ? &ChromaticWindows::luminance_radius : &ChromaticWindows::chroma_radius;
    for (const int r : radii) {
      ChromaticWindows next = best;
      next.*radius = r;
      const double db = chromatic_psnr_db(samples, next, executor);
      if (db > best_db) {
        best_db = db;
        best = next;
      }
    }
  }
  return best;
}

double gat_psnr_db(const std::vector<Sample>& samples, const std::array<double, 3>& gain, Executor& executor) {
  double sum = 0;
  InlineExecutor one;
  for (const Sample& sample : samples) {
    MethodMemory memory(sample.truth.width(), sample.truth.height(), executor);
    Plane<float> out(sample.truth.width(), sample.truth.height());
    gat_denoise(memory.denoiser, sample.shot, denoise::Level::standard, gain, out.view(), one);
    const SceneLinear display = memory.renderer.render(out.view(), sample.shot, NoiseLeft::reduced).display;
    sum += encoded_psnr_db(display.view(), sample.truth, executor);
  }
  return sum / static_cast<double>(samples.size());
}

/// Chooses between two sets of gains. Stabilised noise is white and equal in all colours, which favours equal gains;
/// neutral detail is equal under the square roots of the gains, where noise is photon noise alone.
std::array<double, 3> best_gain(const std::vector<Sample>& samples, Executor& executor) {
  constexpr std::array<double, 3> equal{1, 1, 1};
  std::array<double, 3> roots{};
  for (std::size_t c = 0; c < 3; ++c) roots[c] = std::sqrt(bench_white_gain[c]);
  return gat_psnr_db(samples, roots, executor) > gat_psnr_db(samples, equal, executor) ? roots : equal;
}

}  // namespace

TunedParameters tune(const std::vector<BenchPicture>& pictures, const DenoiseLight& light, Executor& executor) {
  const std::vector<Sample> samples = samples_of(pictures, light, executor);
  return {best_windows(samples, executor), best_gain(samples, executor)};
}

}  // namespace lowlux::isp
