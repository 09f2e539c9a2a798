#pragma once

#include <functional>
#include <optional>

#include "isp/base/executor.h"
#include "isp/base/result.h"
#include "isp/bench/bench_stages.h"
#include "isp/bench/scenes/develop_scene.h"
#include "isp/pipeline/options.h"

/// Stages of `bench` between the raw frame and the image.
namespace lowlux::isp {

/// Runs the stage `chroma-start`: levels of the denoiser, with chroma from each level of the pyramid, against the
/// truth.
/// Errors of all stages: an image of the folder cannot be read.
Result<BenchOutcome> run_chroma_start_bench(const BenchOptions& options);

/// Runs the stage `demosaic`: methods against the truth, the kernel against its algorithm in double.
Result<BenchOutcome> run_demosaic_bench(const BenchOptions& options);

/// Runs the stage `scenes`: levels of the denoiser and methods of demosaicing on generated scenes, and their marks.
Result<BenchOutcome> run_scenes_bench(const BenchOptions& options);

/// Runs the stage `mesopic`: states of CIE 191 and appearance models, tables against the exact results.
Result<BenchOutcome> run_mesopic_bench(const BenchOptions& options);

/// Runs the stage `scene-light`: the rods' luminance under every lamp, with and without the light stated.
Result<BenchOutcome> run_scene_light_bench(const BenchOptions& options);

/// Runs the stage `retarget`: tables against the exact result for each colour.
Result<BenchOutcome> run_retarget_bench(const BenchOptions& options);

/// Runs the stage `develop`: complete plans, against the noise-free mean developed.
Result<BenchOutcome> run_develop_bench(const BenchOptions& options);

/// Holds the contributions to the mean squared error of the sRGB codes (0..1) of a developed frame, which add up to it.
/// One is negative where two errors partly cancel each other.
struct ErrorSources {
  double demosaicing = 0;
  double noise = 0;      // error by remaining noise, and by detail lost in noise reduction and repairs
  double black = 0;      // error of the measured black level
  double rendering = 0;  // rounding to 8 bits

  double sum() const { return demosaicing + noise + black + rendering; }
};

/// Develops a noisy frame as it is, with the true black level, without noise, and from the true colours of every pixel.
/// A contribution is the difference between the errors of two of these images in succession (isp/bench/README.md).
/// @param options  sRGB of 8 bits; exposure_ev, which has to be set, is that of the mean frame
/// Errors: those of develop.
Result<ErrorSources> error_sources(const SimulatedRaws& raws, const DevelopLight& light, const DevelopOptions& options,
                                   Executor& executor);

/// Runs the stage `error-sources`: contributions of demosaicing, noise, black and rendering to the error of `develop`.
Result<BenchOutcome> run_error_sources_bench(const BenchOptions& options);

/// Runs the stage `merge`: ways to merge bursts to one raw frame, against the truth of their first frame.
Result<BenchOutcome> run_merge_bench(const BenchOptions& options);

/// Runs the stage `scaling`: time and memory of developing over the size of the frame and the threads; time per file
/// for a few files. Errors: those of writing and reading these.
Result<BenchOutcome> run_scaling_bench(const BenchOptions& options);

/// Returns, for the stage `scaling`, the peak memory that work takes in addition to the memory in use before [bytes].
/// The work runs in a child process, whose largest resident set is read before and after, so that memory left by other
/// work does not count. The child has the calling thread alone, and ends with the work. Returns nullopt if it could not
/// be started, or failed.
std::optional<double> peak_bytes_of(const std::function<bool()>& work);

}  // namespace lowlux::isp
