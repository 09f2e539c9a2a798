#pragma once

#include <cstdint>
#include <span>

#include "isp/base/cfa.h"
#include "isp/base/frame.h"
#include "isp/base/plane.h"
#include "isp/base/result.h"
#include "isp/base/sensor.h"
#include "isp/bench/bench_stages.h"
#include "isp/model/sensor/noise_source_plan.h"

/// Stages of `bench` for simulation and calibration. README.md describes the measurements.
namespace lowlux::isp {

/// Runs the stage of photon counts: samplers against the Poisson distribution. It uses no images.
Result<BenchOutcome> run_photon_sampling_bench(const BenchOptions& options);

/// Runs the stage that measures the change each sensor effect makes to a simulated frame, and the planner's omissions.
/// Errors: an image cannot be read.
Result<BenchOutcome> run_simulation_effects_bench(const BenchOptions& options);

/// Runs the stage of black points measured on few and on many dark pixels. It uses no images.
Result<BenchOutcome> run_black_point_bench(const BenchOptions& options);

/// Runs the stage of dark charge that is estimated from frames of six sensors. Errors: an image cannot be read or
/// simulated.
Result<BenchOutcome> run_dark_estimate_bench(const BenchOptions& options);

/// Runs the stage of system gain and read noise from pairs of flats and from single images. Errors: an image cannot be
/// read; a measurement that must succeed was refused.
Result<BenchOutcome> run_noise_fit_bench(const BenchOptions& options);

/// Runs the stage of simulated files, by photon sampling and effects. Errors: an image cannot be read or simulated.
Result<BenchOutcome> run_simulate_bench(const BenchOptions& options);

/// A sensor and its dark charge, which define the dark pixels.
struct DarkCase {
  const char* name;
  SensorModel sensor;  // without patterns, except hot pixels in the case that has them
  double dark_e = 0;
};

/// Returns the standard deviation of a mean over `pixels` dark pixels [e-]: sqrt((d + sigma_r^2 + 1 / (12 K^2)) /
/// pixels). Hot pixels are not included.
double black_error_e(const DarkCase& dark, std::int64_t pixels);

/// Returns a frame of masked columns with `pixels_per_site` pixels of each site between the trims of
/// measure_masked_black(), and a few active columns next to them.
/// @param pixels_per_site  a multiple of 20, at least 100
RawDn masked_frame(const DarkCase& dark, std::int64_t pixels_per_site, std::uint64_t seed);

/// Returns the mean code of each site over all pixels of the measured columns, without rejection.
PerSite<double> mean_black_dn(const RawDn& raw);

/// Data from which frames with different effects are made; RGGB.
struct ChangedFrame {
  const SensorModel& sensor;
  Exposure exposure;
  const Developing& developing;
};

/// Returns the larger of both, member by member.
PredictedChange larger(const PredictedChange& a, const PredictedChange& b);

/// Returns the largest changes over all complete blocks of effect_block px: CIEDE2000 of their developed means, and the
/// difference of a channel's variance, relative to that of `reference_dn` or variance_floor_dn2 if that is more.
/// @param dn, reference_dn  of one size
PredictedChange measured_change(const ChangedFrame& frame, const Plane<float>& dn, const Plane<float>& reference_dn);

/// Returns the largest changes that predict_change() gives for the blocks, by the effects the plan keeps in each.
PredictedChange predicted_change(const ChangedFrame& frame, std::span<const BlockLevel> blocks,
                                 const NoiseSourcePlan& plan);

}  // namespace lowlux::isp
