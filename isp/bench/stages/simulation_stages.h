#pragma once

#include "isp/base/result.h"
#include "isp/bench/bench_stages.h"

/// Stages of `bench` on the side of simulation and calibration. README.md says what each measures.
namespace lowlux::isp {

/// Counts of photons: samplers beside Poisson's law. Looks at no pictures.
Result<BenchOutcome> run_photon_sampling_bench(const BenchOptions& options);

/// What each effect of a sensor does to a simulated frame, and what the planner leaves out. Errors: a picture cannot be
/// read.
Result<BenchOutcome> run_simulation_effects_bench(const BenchOptions& options);

/// Black points of few and of many dark pixels. Looks at no pictures.
Result<BenchOutcome> run_black_point_bench(const BenchOptions& options);

/// System gain and read noise of pairs of flats and of single pictures. Errors: a picture cannot be read; a measurement
/// that must succeed was refused.
Result<BenchOutcome> run_noise_fit_bench(const BenchOptions& options);

/// Whole simulated files, by photon sampling and effects. Errors: a picture cannot be read or simulated.
Result<BenchOutcome> run_simulate_bench(const BenchOptions& options);

}  // namespace lowlux::isp
