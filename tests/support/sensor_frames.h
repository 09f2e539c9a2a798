#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "capture/synthetic/sensor_sim.h"

namespace lowlux::test {

/// Holds the sample mean and variance with their standard errors, the variance's from the sample's fourth central
/// moment.
struct SampleMoments {
  double mean = 0, variance = 0, mean_error = 0, variance_error = 0;
};

inline SampleMoments moments_of(std::span<const double> sample) {
  const auto n = static_cast<double>(sample.size());
  double sum = 0, second = 0, fourth = 0;
  for (const double v : sample) sum += v;
  const double mean = sum / n;
  for (const double v : sample) {
    const double square = (v - mean) * (v - mean);
    second += square;
    fourth += square * square;
  }
  const double variance = second / (n - 1);
  return {mean, variance, std::sqrt(variance / n),
          std::sqrt(std::max(0.0, fourth / n - variance * variance * (n - 3) / (n - 1)) / n)};
}

inline std::vector<double> samples_of(const Plane<float>& plane) { return {plane.data(), plane.data() + plane.size()}; }

inline Plane<float> filled(int width, int height, float value) {
  Plane<float> out(width, height);
  std::fill_n(out.data(), out.size(), value);
  return out;
}

/// Returns a plan of one region with these effects.
inline isp::NoiseSourcePlan plan_of(int width, int height, isp::NoiseSourceSet kept) {
  const auto blocks = [](int pixels) { return (pixels + isp::effect_block - 1) / isp::effect_block; };
  isp::NoiseSourcePlan plan;
  isp::RegionPlan region;
  region.blocks = blocks(width) * blocks(height);
  region.kept = kept;
  plan.regions.push_back(region);
  plan.region_of_block.assign(static_cast<std::size_t>(region.blocks), 0);
  return plan;
}

/// Describes a frame of even light [e- per second].
struct Flat {
  int width = 512;
  int height = 256;
  double rate_e_per_s = 0;
  isp::Exposure exposure;
  std::uint64_t seed = 1;
  std::uint32_t frame = 0;
};

inline Plane<float> flat_dn(const SensorModel& sensor, isp::NoiseSourceSet kept, const Flat& flat) {
  InlineExecutor executor;
  const Plane<float> rate = filled(flat.width, flat.height, static_cast<float>(flat.rate_e_per_s));
  Plane<float> dn(flat.width, flat.height);
  capture::read_out(capture::SensorFrame{sensor, flat.exposure, BayerPhase::rggb, std::as_const(rate).view(), nullptr,
                                         flat.seed, flat.seed, flat.frame},
                    plan_of(flat.width, flat.height, kept), executor, dn.view());
  return dn;
}

}  // namespace lowlux::test
