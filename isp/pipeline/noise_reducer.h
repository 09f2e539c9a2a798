#pragma once

#include <memory>
#include <optional>

#include "denoise/denoiser.h"
#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/pipeline/noise_reduction.h"

namespace lowlux::isp {

/// Takes lines, noise and dark charge off a mosaic as decided. Owns the denoiser and its memory (see Denoiser), which
/// the first frame of a size allocates.
class NoiseReducer {
 public:
  explicit NoiseReducer(Executor& executor) : executor_(executor) {}

  /// @param raw   as the frame the decision was made for; its lines are taken off in place
  /// @param maps  filled if not null
  /// Precondition: how.level.
  SignalElectrons run(RawElectrons& raw, const NoiseReduction& how, Plane<float> memory, NoiseMaps* maps);

 private:
  Executor& executor_;
  std::unique_ptr<denoise::Denoiser> denoiser_;
  int width_ = 0;
  int height_ = 0;
  denoise::Level most_ = denoise::Level::high;  // that there is memory for
};

}  // namespace lowlux::isp
