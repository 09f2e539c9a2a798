#pragma once

#include <functional>

#include "denoise/denoiser.h"
#include "isp/base/noise_ratio.h"
#include "tests/denoise/frames.h"

/// Mosaics that are a single frame in some blocks and the mean of several frames in the others.
namespace lowlux::denoise_testing {

/// Returns whether the block at (column, row) is single.
using Blocks = std::function<bool(int column, int row)>;

inline Blocks checked(int side) {
  return [side](int column, int row) { return (column / side + row / side) % 2 == 0; };
}

/// One scene exposed `frames` times: a single frame, their mean, and a mosaic of both with its noise ratio.
struct Mixed {
  Plane<float> single;
  Plane<float> mean;
  Plane<float> both;
  NoiseRatio ratio;       // of `both`
  NoiseRatio everywhere;  // of `mean`
  Blocks blocks;

  bool is_single(int x, int y) const { return blocks(x / ratio.block_px, y / ratio.block_px); }
};

inline Mixed mixed(const Camera& camera, const Scene& scene, int width, int height, int frames, int block_px,
                   const Blocks& blocks, std::uint64_t seed) {
  Mixed out{.single = exposed(camera, scene, width, height, seed), .blocks = blocks};
  out.mean = out.single.clone();
  for (int i = 1; i < frames; ++i) {
    const auto more = exposed(camera, scene, width, height, seed + 1000 * static_cast<std::uint64_t>(i));
    for (std::size_t k = 0; k < more.size(); ++k) out.mean.data()[k] += more.data()[k];
  }
  for (std::size_t k = 0; k < out.mean.size(); ++k) out.mean.data()[k] /= static_cast<float>(frames);
  out.ratio = {.block_px = block_px,
               .ratio = Plane<float>(ratio_blocks(width, block_px), ratio_blocks(height, block_px))};
  out.both = out.mean.clone();
  for (int j = 0; j < out.ratio.ratio.height(); ++j) {
    for (int i = 0; i < out.ratio.ratio.width(); ++i) {
      out.ratio.ratio.at(i, j) = blocks(i, j) ? 1 : 1 / static_cast<float>(frames);
    }
  }
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      if (out.is_single(x, y)) out.both.at(x, y) = out.single.at(x, y);
    }
  }
  out.everywhere.ratio = Plane<float>(1, 1);
  out.everywhere.ratio.at(0, 0) = 1 / static_cast<float>(frames);
  return out;
}

inline Plane<float> denoised(const Plane<float>& raw, const Camera& camera, const NoiseRatioView& ratio,
                             const denoise::DenoiseOptions& options, int threads = 1) {
  Plane<float> out(raw.width(), raw.height());
  PoolExecutor pool(threads);
  denoise::Denoiser denoiser(raw.width(), raw.height(), threads, options.level);
  denoiser.run({raw.view(), camera.phase, ratio}, camera.noise(), options, out.view(), {}, pool);
  return out;
}

}  // namespace lowlux::denoise_testing
