#include "isp/pipeline/finished/clean_raw.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>

#include "isp/pipeline/finished/raw_codes.h"
#include "isp/pipeline/finished/residual_profile.h"
#include "isp/pipeline/plan/plan_develop.h"
#include "isp/pipeline/render/pipeline_memory.h"
#include "isp/pipeline/render/pixel_cells.h"
#include "isp/pipeline/render/region.h"
#include "isp/pipeline/render/signal_stages.h"
#include "isp/pipeline/stage_clock.h"
#include "isp/raw/to_linear.h"

namespace lowlux::isp {
namespace {

/// Returns the standard deviation of a dark pixel of a mosaic in fractions of white, the largest of all sites.
double dark_noise(const DevelopPlan& plan) {
  const PerSite<double> light_e = light_at_white_e(plan.levels);
  double noise = 0;
  for (int site = 0; site < 4; ++site) {
    const denoise::RawNoise& n = plan.noise_reduction.noise;
    const double variance = *std::ranges::max_element(n.variance_e2) + n.dark_mean_e[site];
    noise = std::max(noise, std::sqrt(variance) / light_e[site]);
  }
  return noise;
}

void clean_mosaic(const RawFrame& frame, RawElectrons charge, CleanRaw& out, StageClock& clock, Executor& executor) {
  const NoiseReduction& how = out.plan.noise_reduction;
  const PerSite<double> light_e = light_at_white_e(out.plan.levels);
  const Region whole = whole_frame(frame.raw);
  SignalStages stages(executor);
  stages.set_charge(std::move(charge.value));
  stages.reserve(size_of(whole), how);
  const SignalElectronsView signal = stages.electrons(frame, out.plan, whole, &out.maps);
  clock.lap("denoise");
  const SampleLevels levels = frame.raw.is_float() ? float_levels() : code_levels(dark_noise(out.plan));
  out.frame.raw = encode_signal({.signal_e = signal.value,
                                 .charge_e = stages.charge_e(),
                                 .saturation_e = how.noise.saturation_e,
                                 .signal_at_white_e = light_e,
                                 .charge_at_white_e = *out.plan.levels.electrons_at_white},
                                frame.raw, levels, executor);
  out.frame.noise = residual_profile(signal, out.maps.site_variance_e2, light_e, levels.rounding_variance());
}

/// Holds the charge of the pixels of a frame without a mosaic, of R, G and B, and its noise.
struct PixelCharge {
  PerSite<double> at_white_e{};  // at 0, 1, 2
  std::array<double, 3> saturation_e{};
  double dark_noise = 0;  // standard deviation of a dark pixel in fractions of white, the largest of all colours
};

/// Returns the charge of pixels from that of the sites of their cells.
PixelCharge charge_of(const NoiseReduction& how, const std::array<double, 3>& part) {
  PixelCharge out;
  for (std::size_t c = 0; c < 3; ++c) {
    out.at_white_e[c] = (*how.cell_e)[c] / part[c];
    out.saturation_e[c] = how.noise.saturation_e[c] / part[c];
    out.dark_noise = std::max(out.dark_noise, std::sqrt(how.noise.variance_e2[c] / part[c]) / out.at_white_e[c]);
  }
  out.at_white_e[3] = out.at_white_e[2];
  return out;
}

/// Returns the pixels of planes one after the other, as SignalToEncode has them [e-].
/// @param planes  fractions of white: R, G and B, or one
Plane<float> interleaved(std::span<const Plane<float>> planes, const PerSite<double>& at_white_e, Executor& executor) {
  const int width = planes[0].width(), samples = static_cast<int>(planes.size());
  Plane<float> out(samples * width, planes[0].height());
  for_each_band(executor, out.height(), [&](RowBand band, int) {
    for (int y = band.first; y < band.last; ++y) {
      for (int c = 0; c < samples; ++c) {
        const float* const from = planes[static_cast<std::size_t>(c)].row(y);
        float* const to = out.row(y) + c;
        const auto electrons = static_cast<float>(at_white_e[c]);
        for (int x = 0; x < width; ++x) to[samples * x] = electrons * from[x];
      }
    }
  });
  return out;
}

/// Returns the levels of the samples of a clean frame without a mosaic, whose samples are interleaved.
SampleLevels levels_of(const RawDn& raw, const PixelCharge& charge, const Plane<float>& signal_e) {
  if (raw.is_float() && !raw.from_x_trans) return float_levels();
  if (raw.layout == SensorLayout::monochrome) return code_levels(charge.dark_noise);
  return rgb_code_levels(charge.dark_noise, min_sample(signal_e, charge.at_white_e));
}

void clean_pixels(const RawFrame& frame, CleanRaw& out, StageClock& clock, Executor& executor) {
  const RawDn& raw = frame.raw;
  const NoiseReduction& how = out.plan.noise_reduction;
  const PixelCharge charge = charge_of(how, parts_of(raw));
  SignalStages stages(executor);
  const Plane<float> charge_e = interleaved(stages.noisy_pixels(frame, out.plan), charge.at_white_e, executor);
  const std::span<Plane<float>> pixels = stages.pixels(frame, out.plan, &out.maps);
  const Plane<float> signal_e = interleaved(pixels, charge.at_white_e, executor);
  clock.lap("denoise");
  const SampleLevels levels = levels_of(raw, charge, signal_e);
  out.frame.raw = encode_signal({.signal_e = signal_e.view(),
                                 .charge_e = charge_e.view(),
                                 .saturation_e = charge.saturation_e,
                                 .signal_at_white_e = charge.at_white_e,
                                 .charge_at_white_e = charge.at_white_e},
                                raw, levels, executor);
  out.frame.noise = residual_profile(pixels, out.maps, *how.cell_e, levels.rounding_variance());
  scale_to_pixels(raw, out.maps);
}

}  // namespace

Result<CleanRaw> clean_raw(const RawFrame& frame, const DevelopOptions& options, Executor& executor) {
  RawElectrons charge;
  Result<DevelopPlan> plan = plan_develop(frame, options, executor, &charge);
  if (!plan) return tl::make_unexpected(std::move(plan.error()));
  if (!plan->noise_reduction.has_level()) return fail(ErrorCode::insufficient, plan->noise_reduction.reason);
  CleanRaw out;
  out.plan = *std::move(plan);
  StageClock clock(out.plan.times);
  out.frame.colour = frame.colour;
  out.frame.corrections = frame.corrections;
  out.frame.corrections.defects.clear();
  out.frame.source_tags = frame.source_tags;
  if (is_mosaic(frame.raw)) {
    clean_mosaic(frame, std::move(charge), out, clock, executor);
  } else {
    clean_pixels(frame, out, clock, executor);
  }
  if (!options.denoise.maps) out.maps = {};
  clock.lap("codes");
  return out;
}

std::size_t clean_raw_bytes(const RawDn& raw, const DevelopOptions& options, int threads) {
  DevelopOptions with_maps = options;
  with_maps.denoise.maps = true;  // a NoiseProfile needs them
  const std::size_t bytes = expected_bytes(raw, with_maps, threads);
  if (is_mosaic(raw)) return bytes;
  const std::size_t pixels = static_cast<std::size_t>(raw.active.width) * static_cast<std::size_t>(raw.active.height);
  return bytes + sizeof(float) * pixels * 2 * static_cast<std::size_t>(planes_of(raw));
}

}  // namespace lowlux::isp
