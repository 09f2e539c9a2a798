#include "tests/scenarios/bench_raw.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "isp/render/output_space.h"

namespace lowlux::isp {
namespace {

constexpr double black_dn = 1024, largest_dn = 65535, max_dn_per_e = 8, saturation_over_white = 4;

/// Draws of the flaws, which no other draw depends on.
class Flaws {
 public:
  Flaws(const SensorFlaws& flaws, int width, int height, std::uint64_t seed) : flaws_(flaws), engine_(seed) {
    std::normal_distribution<double> normal;
    row_e_.reserve(static_cast<std::size_t>(height));
    for (int y = 0; y < height; ++y) row_e_.push_back(flaws.row_noise_e * normal(engine_));
    column_e_.reserve(static_cast<std::size_t>(width));
    for (int x = 0; x < width; ++x) column_e_.push_back(flaws.column_noise_e * normal(engine_));
  }
  double at(int x, int y) {
    const double lines = row_e_[static_cast<std::size_t>(y)] + column_e_[static_cast<std::size_t>(x)];
    std::uniform_real_distribution<double> uniform;
    if (!(uniform(engine_) < flaws_.hot_pixel_fraction)) return lines;
    return lines - flaws_.hot_pixel_e * std::log(1 - uniform(engine_));
  }

 private:
  const SensorFlaws& flaws_;
  std::mt19937_64 engine_;
  std::vector<double> row_e_, column_e_;
};

CameraColour colour() {
  Vector3 neutral{};
  for (int c = 0; c < 3; ++c) neutral[c] = 1 / bench_white_gain[c];
  CameraColour out;
  out.calibrations = {{.cct_k = 6504, .xyz_to_camera = diagonal3(neutral) * *xyz_to_output(OutputSpace::linear_srgb)}};
  out.as_shot_neutral = neutral;
  out.source = CameraColour::Source::file_tags;
  return out;
}

}  // namespace

BenchRaw raw_of(const DenoiseShot& shot, const SensorFlaws& flaws, std::uint64_t seed) {
  const int width = shot.raw_e.width(), height = shot.raw_e.height();
  const double dark_e = shot.light.dark_e, full_e = saturation_over_white * shot.white_e + dark_e;
  const double dn_per_e = std::min(max_dn_per_e, (largest_dn - black_dn) / full_e);
  const double white_dn = std::floor(black_dn + dn_per_e * full_e);
  BenchRaw out;
  RawDn& raw = out.frame.raw;
  raw.dn = Plane<std::uint16_t>(width, height);
  Flaws drawn(flaws, width, height, seed);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double e = static_cast<double>(shot.raw_e.at(x, y)) + drawn.at(x, y);
      raw.dn.at(x, y) = static_cast<std::uint16_t>(std::lround(std::clamp(black_dn + dn_per_e * e, 0.0, white_dn)));
    }
  }
  raw.active = raw.default_crop = {0, 0, width, height};
  raw.black_tag = BlackLevel{.pattern_dn = {black_dn + dn_per_e * dark_e}};
  raw.white_dn.fill(white_dn);
  const double read_e2 = shot.light.read_noise_e * shot.light.read_noise_e + 1 / (12 * dn_per_e * dn_per_e);
  const auto noise_over = [](double range_e, double variance_e2) {
    NoiseProfile noise;
    noise.scale.fill(1 / range_e);
    noise.offset.fill(variance_e2 / (range_e * range_e));
    return noise;
  };
  const double range_e = (white_dn - black_dn) / dn_per_e;
  out.frame.noise = noise_over(range_e - dark_e, read_e2 + dark_e);  // the tagged black holds the dark charge
  out.noise_over_pedestal = noise_over(range_e, read_e2);
  out.frame.colour = colour();
  out.black.pedestal_dn.fill(black_dn);
  out.black.dark_mean_e.fill(dark_e);
  out.black.source = BlackPoint::Source::profile;
  return out;
}

}  // namespace lowlux::isp
