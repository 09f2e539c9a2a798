#include "isp/bench/scenes/denoise_scene.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include <fmt/format.h>

#include "isp/base/random/random.h"
#include "isp/render/output_space.h"

namespace lowlux::isp {
namespace {

constexpr BayerPhase phase = BayerPhase::rggb;

double gain_at(int x, int y) { return bench_white_gain[static_cast<std::size_t>(colour_at(phase, x, y))]; }

Vector3 weights() { return luminance_weights(OutputSpace::linear_srgb).value(); }  // of a space with primaries

constexpr float no_clip = std::numeric_limits<float>::infinity();

RgbTransform transform(bool move_into_gamut, float clip) {
  const Vector3 w = weights();
  return {.luminance = {static_cast<float>(w[0]), static_cast<float>(w[1]), static_cast<float>(w[2])},
          .clip = clip,
          .move_into_gamut = move_into_gamut};
}

double mean_of(const Plane<float>& plane) {
  double sum = 0;
  for (std::size_t i = 0; i < plane.size(); ++i) sum += static_cast<double>(plane.data()[i]);
  return sum / static_cast<double>(plane.size());
}

/// Limits a row of charge to what its sites hold.
void limit(DenoiseShot& shot, int y) {
  const auto full_e = static_cast<float>(shot.white_e), with_dark_e = static_cast<float>(shot.noise().saturation_e[0]);
  for (int x = 0; x < shot.raw_e.width(); ++x) {
    shot.signal_e.at(x, y) = std::min(shot.signal_e.at(x, y), full_e);
    shot.raw_e.at(x, y) = std::min(shot.raw_e.at(x, y), with_dark_e);
  }
}

/// Returns the method that the pipeline chooses.
DemosaicMethod method_for(const DenoiseLight& light, NoiseLeft left) {
  if (left == NoiseLeft::all && light.mean_e < 50) return DemosaicMethod::malvar;
  return left != NoiseLeft::none && light.mean_e < 100 ? DemosaicMethod::residual_median : DemosaicMethod::residual;
}

}  // namespace

std::string name_of(const DenoiseLight& light) { return fmt::format("{:g}/{:g}", light.mean_e, light.dark_e); }

denoise::RawNoise DenoiseShot::noise() const {
  const double read_e2 = light.read_noise_e * light.read_noise_e;
  denoise::RawNoise out{.dark_mean_e = {light.dark_e, light.dark_e, light.dark_e, light.dark_e},
                        .variance_e2 = {read_e2, read_e2, read_e2}};
  if (saturates) out.saturation_e.fill(static_cast<float>(white_e + light.dark_e));  // exactly what raw_e is limited to
  return out;
}

std::uint64_t seed_of(const BenchPicture& picture, const DenoiseLight& light) {
  const auto all = files_of(PictureSet::all);
  const auto place = static_cast<std::uint64_t>(std::find(all.begin(), all.end(), picture.name) - all.begin());
  return 1000 * place + static_cast<std::uint64_t>(light.mean_e) + (light.dark_e > 2 ? 100000 : 0);
}

DenoiseShot take(const BenchPicture& picture, const DenoiseLight& light, std::uint64_t seed, bool saturates) {
  const int width = picture.linear.width(), height = picture.linear.height();
  DenoiseShot shot{.light = light,
                   .signal_e = Plane<float>(width, height),
                   .raw_e = Plane<float>(width, height),
                   .saturates = saturates};
  double limited = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const auto colour = static_cast<std::size_t>(colour_at(phase, x, y));
      const float value = picture.linear.plane[colour].at(x, y);
      shot.signal_e.at(x, y) = static_cast<float>(value / gain_at(x, y));
      limited += std::min<double>(value, 1) / gain_at(x, y);
    }
  }
  const double mean_signal = saturates ? limited / static_cast<double>(shot.signal_e.size()) : mean_of(shot.signal_e);
  shot.white_e = light.mean_e / mean_signal;
  std::vector<float> mean(static_cast<std::size_t>(width)), normal(static_cast<std::size_t>(width));
  const DrawStream stream{.seed = seed, .frame = 0, .purpose = draw_purpose::electrons};
  for (int y = 0; y < height; ++y) {
    float* const signal = shot.signal_e.row(y);
    float* const raw = shot.raw_e.row(y);
    for (std::size_t x = 0; x < mean.size(); ++x) {
      signal[x] = static_cast<float>(signal[x] * shot.white_e);
      mean[x] = static_cast<float>(signal[x] + light.dark_e);
      if (saturates) mean[x] = std::min(mean[x], poisson_max_mean);  // far above saturation
      assert(mean[x] <= poisson_max_mean);
    }
    poisson_row(stream, 0, static_cast<std::uint32_t>(y), mean, {raw, mean.size()});
    normal_row(stream, 0, static_cast<std::uint32_t>(y), 1, normal);
    for (std::size_t x = 0; x < mean.size(); ++x) raw[x] += static_cast<float>(light.read_noise_e) * normal[x];
    if (saturates) limit(shot, y);
  }
  return shot;
}

SignedMosaic mosaic_of(const PlaneView<const float>& mosaic_e, const DenoiseShot& shot, NoiseLeft left,
                       DemosaicMethod method, double exposure) {
  const double per_e = exposure / shot.white_e, kept = left == NoiseLeft::none  ? 0
                                                       : left == NoiseLeft::all ? 1
                                                                                : 1.0 / 16;
  SignedMosaic out{.value = mosaic_e, .phase = phase};
  out.demosaic = {.method = method,
                  .offset = static_cast<float>(4 * per_e),
                  .noise_std = static_cast<float>(std::sqrt(kept * shot.light.mean_e) * per_e /
                                                  (3 * std::pow((shot.light.mean_e + 4) * per_e, 2.0 / 3)))};
  for (int y = 0; y < 2; ++y) {
    for (int x = 0; x < 2; ++x) {
      out.gain[static_cast<std::size_t>(site_of(x, y))] = static_cast<float>(gain_at(x, y) * per_e);
    }
  }
  return out;
}

float clip_of(const DenoiseShot& shot, double exposure) {
  return shot.saturates ? static_cast<float>(exposure) : no_clip;
}

BenchRenderer::BenchRenderer(int max_width, Executor& executor)
    : executor_(executor), kernel_(max_width, executor.width()) {}

RenderedPicture BenchRenderer::render(const PlaneView<const float>& mosaic_e, const DenoiseShot& shot, NoiseLeft left,
                                      double exposure) {
  const SignedMosaic in = mosaic_of(mosaic_e, shot, left, method_for(shot.light, left), exposure);
  RenderedPicture out{SceneLinear(mosaic_e.width, mosaic_e.height), SceneLinear(mosaic_e.width, mosaic_e.height)};
  const float clip = clip_of(shot, exposure);
  kernel_.linear(in, transform(true, clip), out.display.view(), executor_);
  kernel_.linear(in, transform(false, clip), out.light.view(), executor_);
  return out;
}

SceneLinear BenchRenderer::display_of(const SceneLinear& light) {
  SceneLinear out(light.width(), light.height());
  kernel_.linear(CameraPlanes{.rgb = light.view()}, transform(true, no_clip), out.view(), executor_);
  return out;
}

double exposure_with_dark(const BenchPicture& picture, const DenoiseShot& shot) {
  const Vector3 w = weights();
  double signal = 0, dark = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    signal += w[c] * mean_of(picture.linear.plane[c]);
    dark += w[c] * shot.light.dark_e * bench_white_gain[c] / shot.white_e;
  }
  return signal / (signal + dark);
}

}  // namespace lowlux::isp
