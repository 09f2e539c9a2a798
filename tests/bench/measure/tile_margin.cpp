// What a frame loses by being denoised in pieces: the difference to the whole frame, over the noise of a raw value,
// near seams (32 px) and away from them, for margins on the denoiser's lattice and off it.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <string>
#include <vector>

#include "capture/file/picture_source.h"
#include "denoise/denoiser.h"
#include "isp/pipeline/render/frame_tiles.h"
#include "tests/bench/measure/measure.h"

namespace {

using namespace lowlux;
using denoise::Level;

constexpr int width = 2048, height = 1536, core = 768, near_px = 32;
constexpr double dark_e = 2, read_noise_e = 2;

int mirrored(int i, int n) {
  const int folded = i % (2 * n);
  return folded < n ? folded : 2 * n - 1 - folded;
}

/// Means of the picture as light of so many electrons on average, dark charge in; X, Y, Z serve as R, G, B.
Plane<float> means_of(const SceneLinear& picture, double mean_e) {
  double sum = 0;
  for (const Plane<float>& plane : picture.plane) {
    for (std::size_t i = 0; i < plane.size(); ++i) sum += std::min(plane.data()[i], 1.0f);
  }
  const double unit_e = mean_e * 3 * static_cast<double>(picture.plane[0].size()) / sum;
  Plane<float> out(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const Plane<float>& plane = picture.plane[static_cast<std::size_t>(colour_at(BayerPhase::rggb, x, y))];
      const float light = plane.at(mirrored(x, picture.width()), mirrored(y, picture.height()));
      out.at(x, y) = static_cast<float>(unit_e * std::min(light, 1.0f) + dark_e);
    }
  }
  return out;
}

Plane<float> noisy(const Plane<float>& mean) {
  Plane<float> out(width, height);
  std::mt19937 engine(7);
  std::normal_distribution<double> normal;
  for (std::size_t i = 0; i < out.size(); ++i) {
    const double charge_e = std::poisson_distribution<int>(mean.data()[i])(engine);
    out.data()[i] = static_cast<float>(charge_e + read_noise_e * normal(engine));
  }
  return out;
}

struct Work {
  const Plane<float>& raw;
  Level level;
  denoise::Denoiser denoiser{width, height, 1, level};
  InlineExecutor executor{};

  void run(const Rect& part, PlaneView<float> out) {
    const double variance_e2 = read_noise_e * read_noise_e;
    denoise::DenoiseOptions options;
    options.level = level;
    denoiser.run(
        {raw.view().crop(part.x, part.y, part.width, part.height)},
        {.dark_mean_e = {dark_e, dark_e, dark_e, dark_e}, .variance_e2 = {variance_e2, variance_e2, variance_e2}},
        options, out, {}, executor);
  }
};

Plane<float> in_pieces(Work& work, int margin) {
  Plane<float> out(width, height), piece(width, height);
  for (int y = 0; y < height; y += core) {
    for (int x = 0; x < width; x += core) {
      const Rect own = isp::overlap({x, y, core, core}, {0, 0, width, height});
      const Rect whole =
          isp::overlap({x - margin, y - margin, core + 2 * margin, core + 2 * margin}, {0, 0, width, height});
      const PlaneView<float> done = piece.view().crop(0, 0, whole.width, whole.height);
      work.run(whole, done);
      for (int row = own.y; row < own.y + own.height; ++row) {
        std::copy_n(done.row(row - whole.y) + own.x - whole.x, own.width, out.row(row) + own.x);
      }
    }
  }
  return out;
}

bool near_seam(int x, int y) {
  const auto near = [](int at) { return at >= core - near_px && (at + near_px) % core < 2 * near_px; };
  return near(x) || near(y);
}

void print_difference(const Plane<float>& tiled, const Plane<float>& whole, const Plane<float>& mean) {
  double sum[2] = {}, most[2] = {};
  long count[2] = {};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const int where = near_seam(x, y) ? 0 : 1;
      const double noise_e = std::sqrt(mean.at(x, y) + read_noise_e * read_noise_e);
      const double d = (tiled.at(x, y) - whole.at(x, y)) / noise_e;
      sum[where] += d * d;
      most[where] = std::max(most[where], std::fabs(d));
      ++count[where];
    }
  }
  std::printf("  near: rms %.1e, most %.1e   away: rms %.1e, most %.1e\n",
              std::sqrt(sum[0] / static_cast<double>(count[0])), most[0],
              std::sqrt(sum[1] / static_cast<double>(count[1])), most[1]);
}

}  // namespace

int lowlux::test::measure_tile_margin(Arguments& arguments) {
  InlineExecutor executor;
  const std::string file = arguments.required("PICTURE");
  std::vector<Level> levels{Level::draft, Level::standard, Level::high};
  if (arguments.is_next("best")) levels = {Level::best};
  arguments.end();
  const auto picture = value_of(capture::read_picture(file, executor));
  for (const double mean_e : {1.0, 20.0, 200.0}) {
    const Plane<float> mean = means_of(picture.xyz, mean_e), raw = noisy(mean);
    for (const Level level : levels) {
      Work work{raw, level};
      Plane<float> whole(width, height);
      work.run({0, 0, width, height}, whole.view());
      for (const int margin : {64, 128, 192, 256, 384, 512}) {
        std::printf("%5g e-, %-8s margin %3d px", mean_e, std::string(name_of(level)).c_str(), margin);
        print_difference(in_pieces(work, margin), whole, mean);
      }
    }
  }
  return 0;
}
