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
/// level counts doubt_of() times, because what it takes from detail is not in it.
class NoiseReducer {
 public:
  explicit NoiseReducer(Executor& executor) : executor_(executor) {}

  /// @param raw   as the frame the decision was made for; its lines are taken off in place
  /// @param maps  filled if not null
  /// Precondition: how.reduces().
  SignalElectrons run(RawElectrons& raw, const NoiseReduction& how, Plane<float> memory, NoiseMaps* maps);

  /// 1 where only this frame is known, 4 where many before it are: noise of one frame that comes back is seen, and a
  /// mean of few frames may be of something that moved too little to be found. Chosen on the pictures of
  /// tests/scenarios/temporal_blend_test.cpp, which prints what others give.
  /// @param share  variance of the mean over frames, of a raw value's, 0..1
  static constexpr float doubt_of(float share) { return 1 + 3 * (1 - share) * (1 - share); }

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
