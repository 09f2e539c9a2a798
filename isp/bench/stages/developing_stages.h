#pragma once

#include "isp/base/result.h"
#include "isp/bench/bench_stages.h"

/// Stages of `bench` between the raw frame and the picture.
namespace lowlux::isp {

/// The stage `chroma-start`: levels of the denoiser, their chroma from each level of the pyramid, against the truth.
/// Errors of all: a picture of the folder cannot be read.
Result<BenchOutcome> run_chroma_start_bench(const BenchOptions& options);

/// The stage `demosaic`: methods against the truth, the kernel against the same in double.
Result<BenchOutcome> run_demosaic_bench(const BenchOptions& options);

/// The stage `mesopic`: states of CIE 191 and models of appearance, tables against the exact.
Result<BenchOutcome> run_mesopic_bench(const BenchOptions& options);

/// The stage `retarget`: tables against the exact for each colour.
Result<BenchOutcome> run_retarget_bench(const BenchOptions& options);

/// The stage `develop`: whole plans, against what is developed of the mean without noise.
Result<BenchOutcome> run_develop_bench(const BenchOptions& options);

/// The stage `scaling`: time and memory of developing over the size of the frame and the threads; time of each of a few
/// files. Errors: those of writing and reading these.
Result<BenchOutcome> run_scaling_bench(const BenchOptions& options);

}  // namespace lowlux::isp
