#pragma once

#include "isp/base/result.h"
#include "isp/bench/bench_stages.h"

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

}  // namespace lowlux::isp
