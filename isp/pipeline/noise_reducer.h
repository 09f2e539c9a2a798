#pragma once

#include <memory>
#include <optional>

#include "denoise/denoiser.h"
#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/pipeline/noise_reduction.h"

namespace lowlux::isp {

/// Takes lines, noise and dark charge off a mosaic as decided. Owns the denoisers and their memory (see Denoiser and
/// TemporalMean), which the first frame of a size allocates.
///
/// Where a level and frames before both take part, each site is the mean of both results, weighted by the inverse of
/// their predicted variances: what moves is left to the level, what stands still to the frames before. That of the
/// level counts `level_doubt` times, because what it takes from detail is not in it.
class NoiseReducer {
 public:
  explicit NoiseReducer(Executor& executor) : executor_(executor) {}

  /// @param raw   as the frame the decision was made for; its lines are taken off in place
  /// @param maps  filled if not null
  /// Precondition: how.reduces().
  SignalElectrons run(RawElectrons& raw, const NoiseReduction& how, Plane<float> memory, NoiseMaps* maps);

  static constexpr float level_doubt = 4;  // chosen on the scenes of tests/bench/stage_bench

  /// Share of the blocks that moved in the last frame; 0 where frames before took no part.
  double moved() const { return moved_; }

 private:
  void reserve(int width, int height, const NoiseReduction& how);
  void reduce_by_level(const RawElectrons& raw, const NoiseReduction& how, PlaneView<float> out, NoiseMaps* maps);
  void reduce_by_time(const RawElectrons& raw, const NoiseReduction& how);
  void blend(const RawElectrons& raw, const NoiseReduction& how, const NoiseMaps& maps, PlaneView<float> signal_e);

  Executor& executor_;
  std::unique_ptr<denoise::Denoiser> denoiser_;
  int width_ = 0;
  int height_ = 0;
  std::unique_ptr<denoise::TemporalMean> temporal_;
  int temporal_width_ = 0;
  int temporal_height_ = 0;
  Plane<float> mean_e_;          // over frames, dark charge in
  Plane<float> variance_share_;  // of a raw value's, one for each 2x2 cell
  NoiseMaps level_maps_;
  double moved_ = 0;
  denoise::Level most_ = denoise::Level::high;  // that there is memory for
};

}  // namespace lowlux::isp
