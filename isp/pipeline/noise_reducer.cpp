#include "isp/pipeline/noise_reducer.h"

#include <algorithm>
#include <utility>

namespace lowlux::isp {
namespace {

void fit(Plane<float>& plane, int width, int height) {
  if (plane.width() != width || plane.height() != height) plane = Plane<float>(width, height);
}

}  // namespace

SignalElectrons NoiseReducer::run(RawElectrons& raw, const NoiseReduction& how, Plane<float> memory, NoiseMaps* maps) {
  const int width = raw.value.width(), height = raw.value.height();
  fit(memory, width, height);
  if (!denoiser_ || width > width_ || height > height_ || how.options.level > most_) {
    width_ = std::max(width, width_);
    height_ = std::max(height, height_);
    most_ = std::max(how.options.level, most_);
    denoiser_.reset();  // before the next one takes its memory
    denoiser_ = std::make_unique<denoise::Denoiser>(width_, height_, executor_.width(), most_);
  }
  for (const denoise::LineOffsets& lines : how.lines) subtract_lines(lines, raw.value.view());
  denoise::DenoiseMaps views;
  if (maps != nullptr) {
    fit(maps->residual_variance_e2, (width + 1) / 2, (height + 1) / 2);
    fit(maps->chroma_confidence, (width + 1) / 2, (height + 1) / 2);
    views.residual_variance = maps->residual_variance_e2.view();
    views.chroma_confidence = maps->chroma_confidence.view();
    for (int c = 0; c < 3; ++c) {
      fit(maps->site_variance_e2[c], (width + 1) / 2, (height + 1) / 2);
      views.site_variance[c] = maps->site_variance_e2[c].view();
    }
  }
  denoiser_->run({raw.value.view(), raw.phase}, how.noise, how.options, memory.view(), views, executor_);
  return {std::move(memory), raw.phase};
}

}  // namespace lowlux::isp
