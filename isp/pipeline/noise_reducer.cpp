#include "isp/pipeline/noise_reducer.h"

#include <algorithm>
#include <utility>

namespace lowlux::isp {
namespace {

void fit(Plane<float>& plane, int width, int height) {
  if (plane.width() != width || plane.height() != height) plane = Plane<float>(width, height);
}

/// Memory for the maps of a mosaic.
denoise::DenoiseMaps views_of(NoiseMaps& maps, int width, int height) {
  const int columns = (width + 1) / 2, rows = (height + 1) / 2;
  fit(maps.residual_variance_e2, columns, rows);
  fit(maps.chroma_confidence, columns, rows);
  for (Plane<float>& plane : maps.site_variance_e2) fit(plane, columns, rows);
  return {.residual_variance = maps.residual_variance_e2.view(),
          .chroma_confidence = maps.chroma_confidence.view(),
          .site_variance = {maps.site_variance_e2[0].view(), maps.site_variance_e2[1].view(),
                            maps.site_variance_e2[2].view()}};
}

/// One column parity of one row of mosaics: what a mean over frames and a level's result make together.
struct BlendSites {
  const float* mean_e;    // dark charge in; every second sample
  const float* share;     // one for each cell
  const float* level_e2;  // variance of the level's result, one for each cell
  float dark_e;
  float variance_e2;
};

void blend_sites(const BlendSites& in, int sites, float* signal_e) {
  for (int i = 0; i < sites; ++i) {
    const float mean_e = in.mean_e[2 * i];
    // The charge by the level's result: by the noisy mean itself, low values would count more than high ones.
    const float charge_e = std::max(signal_e[2 * i] + in.dark_e, 0.0f);
    const float time_e2 = in.share[i] * (charge_e + in.variance_e2);
    const float level_e2 = NoiseReducer::doubt_of(in.share[i]) * in.level_e2[i];
    const float way = level_e2 / (level_e2 + time_e2);
    signal_e[2 * i] += way * (mean_e - in.dark_e - signal_e[2 * i]);
  }
}

}  // namespace

void NoiseReducer::reserve(int width, int height, const NoiseReduction& how) {
  const bool small = width > width_ || height > height_ || how.options.level > most_;
  if (how.level && (!denoiser_ || small)) {
    width_ = std::max(width, width_);
    height_ = std::max(height, height_);
    most_ = std::max(how.options.level, most_);
    denoiser_.reset();  // before the next one takes its memory
    denoiser_ = std::make_unique<denoise::Denoiser>(width_, height_, executor_.width(), most_);
  }
  if (!how.temporal) return;
  if (!temporal_ || width != temporal_width_ || height != temporal_height_) {
    temporal_.reset();
    temporal_ = std::make_unique<denoise::TemporalMean>(width, height, executor_.width());
    temporal_width_ = width;
    temporal_height_ = height;
  }
  fit(mean_e_, width, height);
  fit(variance_share_, (width + 1) / 2, (height + 1) / 2);
}

void NoiseReducer::reduce_by_level(const RawElectrons& raw, const NoiseReduction& how, PlaneView<float> out,
                                   NoiseMaps* maps) {
  denoise::DenoiseMaps views;
  if (maps != nullptr) views = views_of(*maps, out.width, out.height);
  denoiser_->run({raw.value.view(), raw.phase}, how.noise, how.options, out, views, executor_);
}

void NoiseReducer::reduce_by_time(const RawElectrons& raw, const NoiseReduction& how) {
  if (how.temporal->restart) temporal_->reset();
  moved_ = temporal_->run({raw.value.view(), raw.phase}, how.noise, how.temporal->light, how.temporal->options,
                          mean_e_.view(), variance_share_.view(), executor_);
}

void NoiseReducer::blend(const RawElectrons& raw, const NoiseReduction& how, const NoiseMaps& maps,
                         PlaneView<float> signal_e) {
  for_each_band(executor_, signal_e.height, [&](RowBand band, int) {
    for (int y = band.first; y < band.last; ++y) {
      for (int column = 0; column < std::min(2, signal_e.width); ++column) {
        const auto colour = static_cast<std::size_t>(colour_at(raw.phase, column, y));
        const BlendSites sites{mean_e_.row(y) + column, variance_share_.row(y / 2),
                               maps.site_variance_e2[colour].row(y / 2),
                               static_cast<float>(how.noise.dark_mean_e[site_of(column, y)]),
                               static_cast<float>(how.noise.variance_e2[colour])};
        blend_sites(sites, (signal_e.width + 1 - column) / 2, signal_e.row(y) + column);
      }
    }
  });
}

SignalElectrons NoiseReducer::run(RawElectrons& raw, const NoiseReduction& how, Plane<float> memory, NoiseMaps* maps) {
  const int width = raw.value.width(), height = raw.value.height();
  fit(memory, width, height);
  reserve(width, height, how);
  for (const denoise::LineOffsets& lines : how.lines) subtract_lines(lines, raw.value.view());
  moved_ = 0;
  if (how.temporal) reduce_by_time(raw, how);
  if (!how.level) {
    for_each_band(executor_, height, [&](RowBand band, int) {
      for (int y = band.first; y < band.last; ++y) {
        const auto& dark = how.noise.dark_mean_e;
        const int left = site_of(0, y);
        const auto even = static_cast<float>(dark[left]), odd = static_cast<float>(dark[left + 1]);
        const float* const mean_e = mean_e_.row(y);
        float* const out = memory.row(y);
        for (int x = 0; x < width; ++x) out[x] = mean_e[x] - ((x & 1) != 0 ? odd : even);
      }
    });
    return {std::move(memory), raw.phase};
  }
  NoiseMaps* const level_maps = maps != nullptr || !how.temporal ? maps : &level_maps_;
  reduce_by_level(raw, how, memory.view(), level_maps);
  if (how.temporal) blend(raw, how, *level_maps, memory.view());
  return {std::move(memory), raw.phase};
}

}  // namespace lowlux::isp
