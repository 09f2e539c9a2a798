#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "capture/synthetic/synthetic_source.h"
#include "isp/base/random/random.h"
#include "isp/model/colour/colour_difference.h"
#include "isp/model/spectrum/cie_data.h"
#include "isp/model/spectrum/spectral_data.h"
#include "isp/model/spectrum/spectral_response.h"

// The planner's promise: a frame simulated with the effects it chose differs from the frame with all effects, made of
// the same random numbers, by less than the tolerance, in the colour of block means and in the variance of blocks.
namespace lowlux::capture {
namespace {

constexpr int blocks_across = 4, blocks_down = 3;
constexpr std::uint32_t draws_purpose = 77;  // of this test's own choices

/// Numbers in 0..1 that depend on the scene's index alone.
class Draws {
 public:
  explicit Draws(std::uint32_t scene) : scene_(scene) {}
  double uniform() { return (words_at({20261121, 0, draws_purpose}, scene_, next_++)[0] + 0.5) * 0x1p-32; }
  double log_uniform(double low, double high) { return low * std::pow(high / low, uniform()); }
  int below(int count) { return static_cast<int>(uniform() * count); }

 private:
  std::uint32_t scene_;
  std::uint32_t next_ = 0;
};

/// Every sensor and gain setting that can be simulated, whatever is sourced of it.
std::vector<std::pair<std::string, std::string>> usable_sensors() {
  std::vector<std::pair<std::string, std::string>> all;
  for (const std::string_view name : isp::sensor_names()) {
    for (const std::string_view gain : isp::gain_settings(name)) {
      if (isp::sensor_named(name, gain, {})) all.emplace_back(name, gain);
    }
  }
  return all;
}

isp::NamedSensor draw_sensor(Draws& draws) {
  static const auto sensors = usable_sensors();
  const auto& [name, gain] = sensors[draws.below(static_cast<int>(sensors.size()))];
  isp::SensorFigures figures;
  figures.prnu = draws.log_uniform(1e-4, 0.03);
  figures.dsnu = draws.log_uniform(0.01, 1);
  figures.hot_pixel_fraction = draws.log_uniform(1e-6, 1e-3);
  figures.hot_pixel_current_e_per_s = draws.log_uniform(1, 1e4);
  figures.row_noise_e = draws.log_uniform(0.01, 3);
  figures.column_noise_e = draws.log_uniform(0.01, 3);
  figures.telegraph_fraction = draws.log_uniform(1e-4, 1);
  figures.telegraph_e = draws.log_uniform(0.1, 30);
  figures.crosstalk = draws.log_uniform(1e-6, 0.05);
  figures.glow_e_per_s = draws.log_uniform(0.01, 1e4);
  figures.glow_position = {1.4 * draws.uniform() - 0.2, 1.4 * draws.uniform() - 0.2};
  figures.glow_length = draws.log_uniform(0.02, 1);
  auto sensor = *isp::sensor_named(name, gain, figures);
  if (sensor.model.dark_current_e_per_s[1] == 0) sensor.model.dark_current_e_per_s.fill(draws.log_uniform(0.01, 100));
  return sensor;
}

/// A grid of flat blocks: Munsell chips and greys under a light, each dimmed by up to three decades.
Scene draw_scene(Draws& draws) {
  const auto lights = isp::light_names();
  const auto chips = isp::spectra_of(isp::SpectrumSet::munsell_ten);
  // A light that leaves a channel nearly dark makes a matrix that amplifies without limit: low-pressure sodium.
  std::string_view light = lights[draws.below(static_cast<int>(lights.size()))];
  if (light == "LPS") light = "D65";
  SceneSetup setup{blocks_across * isp::effect_block, blocks_down * isp::effect_block, *isp::light_named(light),
                   std::string(light), draws.log_uniform(1e-3, 1e4)};
  Scene scene = *flat_scene(setup);
  scene.radiances.clear();
  for (int block = 0; block < blocks_across * blocks_down; ++block) {
    const Spectrum& chip = chips[draws.below(static_cast<int>(chips.size()))].spectrum;
    const double dimmed = block == 0 ? 1 : draws.log_uniform(1e-3, 1);
    std::vector<double> value;
    for (std::size_t i = 0; i < scene.white.size(); ++i) {
      value.push_back(dimmed * scene.white.values()[i] * chip.at(scene.white.wavelengths_nm()[i]));
    }
    const auto nm = scene.white.wavelengths_nm();
    scene.radiances.push_back(*Spectrum::of({nm.begin(), nm.end()}, std::move(value)));
    for (int y = 0; y < isp::effect_block; ++y) {
      std::fill_n(
          scene.patch.row(block / blocks_across * isp::effect_block + y) + block % blocks_across * isp::effect_block,
          isp::effect_block, static_cast<std::uint16_t>(block));
    }
  }
  return scene;
}

Scene copy_of(const Scene& scene) {
  SceneLinear xyz;
  for (int c = 0; c < 3; ++c) xyz.plane[c] = scene.xyz_cd_m2.plane[c].clone();
  return {std::move(xyz), scene.patch.clone(), scene.radiances, {}, {}, scene.white, scene.description};
}

/// Mean and variance of R, G and B in one block [DN].
struct BlockStatistics {
  Vector3 mean{}, variance{};
};

BlockStatistics block_statistics(const Plane<float>& dn, BayerPhase phase, int block) {
  const int x0 = block % blocks_across * isp::effect_block, y0 = block / blocks_across * isp::effect_block;
  Vector3 sum{}, square{};
  std::array<int, 3> count{};
  for (int pass = 0; pass < 2; ++pass) {
    for (int y = y0; y < y0 + isp::effect_block; ++y) {
      for (int x = x0; x < x0 + isp::effect_block; ++x) {
        const int k = static_cast<int>(colour_at(phase, x, y));
        if (pass == 0) {
          sum[k] += dn.at(x, y);
          ++count[k];
        } else {
          square[k] += (dn.at(x, y) - sum[k] / count[k]) * (dn.at(x, y) - sum[k] / count[k]);
        }
      }
    }
  }
  BlockStatistics out;
  for (int k = 0; k < 3; ++k) {
    out.mean[k] = sum[k] / count[k];
    out.variance[k] = square[k] / (count[k] - 1);
  }
  return out;
}

isp::Lab developed(const isp::Developing& d, const SensorModel& s, const Vector3& mean_dn) {
  Vector3 rgb{};
  for (int k = 0; k < 3; ++k) rgb[k] = (mean_dn[k] - s.black_level_dn) / s.system_gain_dn_per_e / d.white_e[k];
  return isp::lab_of(isp::xyz_of(d.camera_to_xyz * rgb), *isp::xyz_of(isp::white_d65));
}

/// The largest changes over the blocks of one scene.
isp::PredictedChange observed_change(const SyntheticSource& planned, const SyntheticSource& whole,
                                     const SensorModel& s) {
  InlineExecutor inline_executor;
  const Plane<float> a = planned.frame_dn(3, inline_executor), b = whole.frame_dn(3, inline_executor);
  isp::PredictedChange worst;
  for (int block = 0; block < blocks_across * blocks_down; ++block) {
    const auto sa = block_statistics(a, BayerPhase::rggb, block), sb = block_statistics(b, BayerPhase::rggb, block);
    worst.delta_e = std::max(worst.delta_e, isp::ciede2000(developed(whole.developing(), s, sa.mean),
                                                           developed(whole.developing(), s, sb.mean)));
    for (int k = 0; k < 3; ++k) {
      worst.relative_variance =
          std::max(worst.relative_variance,
                   std::fabs(sa.variance[k] - sb.variance[k]) / std::max(sb.variance[k], isp::variance_floor_dn2));
    }
  }
  return worst;
}

// 300 scenes; 3000 in scripts/nightly.
TEST(EffectPromise, WhatIsLeftOutStaysBelowTheToleranceOver300Scenes) {
  const std::uint32_t scenes = std::getenv("LOWLUX_NIGHTLY") == nullptr ? 300 : 3000;
  std::array<int, isp::effect_count> kept{}, left_out{};
  InlineExecutor inline_executor;
  const isp::Tolerance tolerance;
  double worst_delta_e = 0, worst_variance = 0;
  for (std::uint32_t i = 0; i < scenes; ++i) {
    Draws draws(i);
    const isp::NamedSensor sensor = draw_sensor(draws);
    const SpectralResponse response =
        *isp::spectral_response(sensor, {2, draws.log_uniform(10, 1000)});  // the luminance that fills it in 1 s
    const Scene scene = draw_scene(draws);
    SyntheticOptions options;
    options.exposure = {draws.log_uniform(1e-4, 100), -20 + 80 * draws.uniform()};
    options.seed = i;
    options.effects = {tolerance, {}};
    const auto planned = SyntheticSource::of(copy_of(scene), sensor, response, options, inline_executor);
    options.effects = {std::nullopt, isp::NoiseSourceSet::all()};
    const auto whole = SyntheticSource::of(copy_of(scene), sensor, response, options, inline_executor);
    ASSERT_TRUE(planned && whole) << i << " " << (planned ? whole.error().message : planned.error().message);
    const isp::PredictedChange change = observed_change(*planned, *whole, sensor.model);
    EXPECT_LT(change.delta_e, tolerance.delta_e) << "scene " << i << " " << sensor.model.name;
    EXPECT_LT(change.relative_variance, tolerance.relative_variance) << "scene " << i << " " << sensor.model.name;
    worst_delta_e = std::max(worst_delta_e, change.delta_e);
    worst_variance = std::max(worst_variance, change.relative_variance);
    for (const isp::RegionPlan& region : planned->plan().regions) {
      for (const isp::NoiseSourceDecision& d : region.decisions) {
        if (d.reason == isp::NoiseSourceDecision::Reason::absent) continue;
        ++(d.kept ? kept : left_out)[static_cast<int>(d.effect)];
      }
    }
  }
  std::printf("  largest change: CIEDE2000 %.3f of %.3f, relative variance %.4f of %.4f\n", worst_delta_e,
              tolerance.delta_e, worst_variance, tolerance.relative_variance);
  for (int e = 0; e < isp::effect_count; ++e) {
    std::printf("  %-15s kept in %4d regions, left out in %4d\n", std::string(isp::effect_names()[e]).c_str(), kept[e],
                left_out[e]);
    EXPECT_GT(kept[e], 0) << isp::effect_names()[e];
    EXPECT_GT(left_out[e], 0) << isp::effect_names()[e];
  }
}

}  // namespace
}  // namespace lowlux::capture
