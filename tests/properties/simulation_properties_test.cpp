#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <span>
#include <vector>

#include "capture/synthetic/block_levels.h"
#include "capture/synthetic/readout.h"
#include "capture/synthetic/sensor_sim.h"
#include "isp/base/executor.h"
#include "isp/base/random/random.h"
#include "isp/model/sensor/photon.h"
#include "tests/properties/draws.h"

namespace lowlux {
namespace {

using namespace properties;
using isp::Effect;
using isp::NoiseSourceSet;

std::uint64_t any_seed() { return *rc::gen::arbitrary<std::uint64_t>(); }

/// Charges over the decades that sensors have, one of them for a whole row or each its own.
std::vector<float> any_means(int count) {
  auto random = any_random();
  std::uniform_real_distribution<double> decade(-2, 5);
  std::vector<float> out(static_cast<std::size_t>(count));
  for (float& mean : out) mean = static_cast<float>(std::pow(10, decade(random)));
  return out;
}

// Eight standard errors, as of dark series: skewed laws too lie within, at 80 events and more in all.
RC_GTEST_PROP(PoissonProperty, CountsHaveTheirMeanAndVariance, ()) {
  constexpr int n = 8192;
  const double mu = any_decade(-2, 6);
  std::vector<float> counts(n, static_cast<float>(mu));
  poisson_row({.seed = any_seed()}, 0, 0, counts, counts);
  double sum = 0, squares = 0;
  for (const float count : counts) {
    RC_ASSERT(count >= 0 && count == std::floor(count));
    sum += count - mu;
    squares += (count - mu) * (count - mu);
  }
  RC_ASSERT(std::abs(sum / n) < 8 * std::sqrt(mu / n));
  RC_ASSERT(std::abs(squares / n - mu) < 8 * std::sqrt((mu + 2 * mu * mu) / n));  // the fourth moment is mu + 3 mu^2
}

capture::ReadoutParameters any_readout() {
  capture::ReadoutParameters out;
  if (*rc::gen::arbitrary<bool>()) out.full_well_e = static_cast<float>(any_decade(1, 5));
  if (*rc::gen::arbitrary<bool>()) out.read_noise_e = static_cast<float>(any_decade(-2, 3));
  out.gain_dn_per_e = static_cast<float>(any_decade(-3, 2));
  out.black_dn = static_cast<float>(any_between(0, 2000));
  out.max_dn = *rc::gen::element(0.0F, 255.0F, 1023.0F, 16383.0F, 65535.0F);
  out.quantisation = *rc::gen::element(Quantisation::round, Quantisation::floor);
  out.photon_noise = *rc::gen::arbitrary<bool>();
  return out;
}

RC_GTEST_PROP(ReadoutProperty, PiecesOfARowAreTheRowAndCodesAreItsFloats, ()) {
  const int width = size_between(1, 300), cut = size_between(0, width);
  const DrawStream stream{.seed = any_seed(), .frame = *rc::gen::arbitrary<std::uint32_t>()};
  const auto x0 = static_cast<std::uint32_t>(size_between(0, 1000)), y = static_cast<std::uint32_t>(size_between(0, 9));
  const auto mean = any_means(width), steady = any_means(width), offset = any_means(width);
  const auto parameters = any_readout();
  std::vector<std::uint16_t> whole(mean.size()), pieces(mean.size());
  std::vector<float> floats(mean.size());
  read_out_row(stream, x0, y, {mean, steady, offset}, parameters, whole);
  read_out_row(stream, x0, y, {mean, steady, offset}, parameters, floats);
  const auto split = static_cast<std::size_t>(cut);
  const auto piece = [&](std::size_t first, std::size_t count) {
    const auto of = [&](const std::vector<float>& row) { return std::span(row).subspan(first, count); };
    read_out_row(stream, x0 + static_cast<std::uint32_t>(first), y, {of(mean), of(steady), of(offset)}, parameters,
                 std::span(pieces).subspan(first, count));
  };
  piece(0, split);
  piece(split, mean.size() - split);
  RC_ASSERT(whole == pieces);
  for (std::size_t i = 0; i < whole.size(); ++i) {
    RC_ASSERT(floats[i] == static_cast<float>(whole[i]));
    RC_ASSERT(static_cast<float>(whole[i]) <= parameters.max_dn);
  }
}

// Of the same draws: the quantile function of a Poisson law rises with its mean, and every step after it keeps order.
RC_GTEST_PROP(ReadoutProperty, MoreLightGivesNoLowerCode, ()) {
  const auto dim = any_means(size_between(1, 200));
  const DrawStream stream{.seed = any_seed()};
  auto bright = dim;
  const auto more = static_cast<float>(any_between(1, 3));
  for (float& mean : bright) mean *= more;
  auto parameters = any_readout();
  parameters.clip = *rc::gen::arbitrary<bool>();
  parameters.quantise = *rc::gen::arbitrary<bool>();
  std::vector<float> low(dim.size()), high(dim.size());
  read_out_row(stream, 0, 0, {dim, {}, {}}, parameters, low);
  read_out_row(stream, 0, 0, {bright, {}, {}}, parameters, high);
  for (std::size_t i = 0; i < dim.size(); ++i) RC_ASSERT(low[i] <= high[i]);
}

SensorModel any_sensor() {
  SensorModel out;
  out.system_gain_dn_per_e = any_decade(-2, 1);
  out.read_noise_e = any_between(0, 8);
  out.full_well_e = any_decade(2, 5);
  out.black_level_dn = any_between(0, 300);
  out.dark_current_e_per_s = {any_between(0, 5), any_between(0, 5), any_between(0, 5)};
  out.prnu = any_between(0, 0.05);
  out.dsnu = any_between(0, 0.5);
  out.hot_pixel_fraction = any_between(0, 0.01);
  out.hot_pixel_current_e_per_s = any_between(0, 500);
  out.crosstalk = any_between(0, 0.2);
  out.glow_e_per_s = any_between(0, 100);
  out.glow_position = {any_between(-1, 2), any_between(-1, 2)};
  out.glow_length = any_decade(-3, 1);
  out.row_noise_e = any_between(0, 2);
  out.column_noise_e = any_between(0, 2);
  return out;
}

/// A sensor that reads out some light, and how its frame is developed.
struct Setup {
  SensorModel sensor = any_sensor();
  isp::Exposure exposure{.time_s = any_decade(-3, 1), .temperature_c = any_between(-20, 60)};
  BayerPhase phase = any_phase();
  Plane<float> rate_e_per_s =
      any_plane(size_between(2, 100), size_between(2, 70), 0, static_cast<float>(any_decade(0, 5)));
  std::vector<isp::BlockLevel> blocks = capture::block_levels(frame(0));
  isp::Developing developing = isp::developing_of(sensor, exposure, identity3(), {1, 1, 1}, blocks);

  isp::NoiseSourcePlan plan_of(NoiseSourceSet effects) const {
    return isp::fixed_effects(sensor, exposure, developing, blocks, effects);
  }
  capture::SensorFrame frame(std::uint64_t seed) const {
    return {.sensor = sensor,
            .exposure = exposure,
            .phase = phase,
            .rate_e_per_s = rate_e_per_s.view(),
            .seed = seed,
            .pattern_seed = seed + 1};
  }
  Plane<float> read_out(NoiseSourceSet effects, std::uint64_t seed, Executor& executor) const {
    Plane<float> out(rate_e_per_s.width(), rate_e_per_s.height());
    capture::read_out(frame(seed), plan_of(effects), executor, out.view());
    return out;
  }
};

NoiseSourceSet any_effects() {
  NoiseSourceSet out;
  for (int i = 0; i < isp::effect_count; ++i) {
    if (*rc::gen::arbitrary<bool>()) out = out.with(static_cast<Effect>(i));
  }
  return out;
}

RC_GTEST_PROP(SensorProperty, AnyEffectsGiveTheSameFrameForAnyThreads, ()) {
  const Setup setup;
  const NoiseSourceSet effects = any_effects();
  const std::uint64_t seed = any_seed();
  InlineExecutor one;
  PoolExecutor three(3);
  const auto dn = setup.read_out(effects, seed, one);
  RC_ASSERT(all_finite(dn));
  RC_ASSERT(largest_difference(dn, setup.read_out(effects, seed, three)) == 0);
  if (!effects.has(Effect::quantisation) || !effects.has(Effect::clipping)) return;
  for (std::size_t i = 0; i < dn.size(); ++i) {
    const float code = dn.data()[i];
    RC_ASSERT(code >= 0 && code <= setup.sensor.white_level_dn && code == std::floor(code));
  }
}

RC_GTEST_PROP(SensorProperty, WithoutEffectsItIsALine, ()) {
  const Setup setup;
  InlineExecutor one;
  const auto dn = setup.read_out({}, any_seed(), one);
  for (std::size_t i = 0; i < dn.size(); ++i) {
    const double signal_e = setup.rate_e_per_s.data()[i] * setup.exposure.time_s;
    const double expected = setup.sensor.black_level_dn + setup.sensor.system_gain_dn_per_e * signal_e;
    RC_ASSERT(std::abs(dn.data()[i] - expected) <= 5e-7 * expected);  // five roundings of 2^-24 each: 3e-7
  }
}

RC_GTEST_PROP(SensorProperty, WhatIsLeftOutStaysBelowTheTolerance, ()) {
  const Setup setup;
  const isp::Tolerance tolerance{any_decade(-2, 1), any_decade(-3, 0)};
  const auto plan = isp::plan_noise_sources(setup.sensor, setup.exposure, setup.developing, setup.blocks, tolerance);
  RC_ASSERT(plan.region_of_block.size() == setup.blocks.size());
  for (const std::uint8_t region : plan.region_of_block) RC_ASSERT(region < plan.regions.size());
  for (const isp::RegionPlan& region : plan.regions) {
    RC_ASSERT(region.left_out_together.delta_e < tolerance.delta_e);
    RC_ASSERT(region.left_out_together.relative_variance < tolerance.relative_variance);
    for (const isp::NoiseSourceDecision& d : region.decisions) {
      RC_ASSERT(region.kept.has(d.effect) == d.kept);
      RC_ASSERT(d.reason != isp::NoiseSourceDecision::Reason::negligible || d.alone.delta_e < tolerance.delta_e);
    }
  }
}

Spectrum any_power() {
  std::vector<double> nm, power;
  double at = any_between(300, 500);
  for (int n = size_between(2, 30); n > 0; --n) {
    nm.push_back(at);
    power.push_back(any_between(0, 10));
    at += any_between(0.5, 40);
  }
  power.front() += 0.1;
  return Spectrum::of(nm, power).value();
}

RC_GTEST_PROP(PhotonProperty, CountsAtTheirMeansTellTheSpectrumAndMoreOfThemTellItBetter, ()) {
  const Spectrum power = any_power();
  const double power_w = any_decade(-18, -6), exposure_s = any_decade(-4, 3);
  const auto means = isp::mean_photons(power, power_w, exposure_s);
  RC_ASSERT(means.has_value());
  double energy_j = 0;
  for (std::size_t i = 0; i < means->photons.size(); ++i) {
    energy_j += means->photons[i] * isp::photon_energy_j(means->wavelengths_nm[i]);
  }
  RC_ASSERT(std::abs(energy_j / (power_w * exposure_s) - 1) < 1e-12);  // sums of 30 in double
  const auto told = isp::estimated_spectrum(*means, means->photons);
  const auto truth = isp::normalised(power);
  RC_ASSERT(told.has_value() && truth.has_value());
  double largest = 0;
  for (const double value : truth->values()) largest = std::max(largest, value);
  for (std::size_t i = 0; i < truth->size(); ++i) {
    RC_ASSERT(std::abs(told->values()[i] - truth->values()[i]) <= 1e-12 * largest);
  }
  const double more = any_between(1, 1000);
  const auto longer = isp::mean_photons(power, power_w, more * exposure_s);
  const auto once = isp::expected_squared_distance(*means), then = isp::expected_squared_distance(*longer);
  RC_ASSERT(once.has_value() && then.has_value());
  RC_ASSERT(std::abs(more * *then - *once) <= 1e-9 * *once);  // as one over the photons
}

}  // namespace
}  // namespace lowlux
