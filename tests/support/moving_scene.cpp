#include "tests/support/moving_scene.h"

#include <cmath>
#include <numbers>
#include <random>
#include <span>

#include "isp/base/random/random.h"

namespace lowlux::test {

WaveScene::WaveScene(std::uint64_t seed, double contrast, double max_frequency, int waves) : contrast_(contrast) {
  std::mt19937_64 random(seed);
  const auto uniform = [&] { return static_cast<double>(random() >> 11) / 9007199254740992.0; };
  for (int i = 0; i < waves; ++i) {
    const double octaves = std::log(400 * max_frequency) * (i + uniform()) / waves;
    const double frequency = std::exp(octaves) / 400, direction = std::numbers::pi * uniform();
    const double amplitude = contrast * std::sqrt(2.0 / waves);
    // Colours differ by a fifth of their amplitude, each in its own way.
    const auto tint = [&] { return amplitude * (0.8 + 0.4 * uniform()); };
    waves_.push_back({2 * std::numbers::pi * frequency * std::cos(direction),
                      2 * std::numbers::pi * frequency * std::sin(direction),
                      2 * std::numbers::pi * uniform(),
                      {tint(), amplitude, tint()}});
  }
}

double WaveScene::at(Position p, CfaColour colour) const {
  double sum = 0;
  for (const Wave& w : waves_) {
    sum += w.amplitude[static_cast<std::size_t>(colour)] * std::cos(w.fx * p.x + w.fy * p.y + w.phase);
  }
  return std::exp(sum - contrast_ * contrast_ / 2);
}

View rigid_view(int width, int height, double dx_px, double dy_px, double turn_rad) {
  const double cx = (width - 1) / 2.0, cy = (height - 1) / 2.0, c = std::cos(turn_rad), s = std::sin(turn_rad);
  return [=](Position p) {
    const double x = p.x - cx - dx_px, y = p.y - cy - dy_px;
    return Position{cx + c * x + s * y, cy - s * x + c * y};
  };
}

Position displacement_in(const View& view, Position from) {
  Position to = from;
  for (int i = 0; i < 60; ++i) {
    const Position seen = view(to);
    to = {to.x + from.x - seen.x, to.y + from.y - seen.y};
  }
  return {to.x - from.x, to.y - from.y};
}

Plane<float> expose(const Light& light, const View& view, int width, int height, const Exposure& exposure,
                    Executor& executor) {
  Plane<float> mosaic(width, height);
  const DrawStream stream{exposure.seed, exposure.frame, draw_purpose::electrons};
  for_each_band(executor, height, [&](RowBand band, int) {
    std::vector<float> mean(static_cast<std::size_t>(width)), read(mean.size());
    for (int y = band.first; y < band.last; ++y) {
      for (int x = 0; x < width; ++x) {
        const Position p = view({static_cast<double>(x), static_cast<double>(y)});
        mean[static_cast<std::size_t>(x)] =
            static_cast<float>(exposure.mean_e * light(p, colour_at(exposure.phase, x, y)));
      }
      const std::span<float> row(mosaic.row(y), static_cast<std::size_t>(width));
      poisson_row(stream, 0, static_cast<std::uint32_t>(y), mean, row);
      normal_row(stream, 0, static_cast<std::uint32_t>(y), 1, read);
      for (std::size_t x = 0; x < row.size(); ++x) row[x] += static_cast<float>(exposure.read_noise_e) * read[x];
    }
  });
  return mosaic;
}

merge::FrameView frame_view(const Plane<float>& mosaic, const Exposure& exposure) {
  const double variance = exposure.read_noise_e * exposure.read_noise_e;
  return {mosaic.view(), exposure.phase, {variance, variance, variance, variance}};
}

double rms_error_px(const merge::Motion& motion, const View& view, int width, int height) {
  double sum = 0;
  int count = 0;
  for (int y = 0; y < height; y += motion.spacing_px) {
    for (int x = 0; x < width; x += motion.spacing_px) {
      const Position truth = displacement_in(view, {static_cast<double>(x), static_cast<double>(y)});
      if (x + truth.x < 0 || y + truth.y < 0 || x + truth.x > width - 1 || y + truth.y > height - 1) continue;
      const merge::Shift found = motion.at(static_cast<float>(x), static_cast<float>(y));
      sum += std::pow(static_cast<double>(found.dx_px) - truth.x, 2);
      sum += std::pow(static_cast<double>(found.dy_px) - truth.y, 2);
      count += 2;
    }
  }
  return count == 0 ? 0 : std::sqrt(sum / count);
}

}  // namespace lowlux::test
