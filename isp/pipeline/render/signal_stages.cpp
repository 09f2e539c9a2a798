#include "isp/pipeline/render/signal_stages.h"

#include <utility>

#include "isp/pipeline/render/electron_mosaic.h"
#include "isp/pipeline/render/map_views.h"
#include "isp/pipeline/render/pixel_cells.h"
#include "isp/raw/repair.h"
#include "isp/raw/to_linear.h"

namespace lowlux::isp {
namespace {

PlaneView<float> corner_of(Plane<float>& plane, const Rect& region) {
  return plane.view().crop(0, 0, region.width, region.height);
}

}  // namespace

void SignalStages::reserve(const RegionSize& largest, const NoiseReduction& how) {
  fit(raw_, largest.mosaic_width, largest.mosaic_height);
  if (how.reduces() && !NoiseReducer::has_result_memory(how)) {
    fit(signal_, largest.mosaic_width, largest.mosaic_height);
  }
}

void SignalStages::reserve_tiles(const RegionSize& largest, const NoiseReduction& how) {
  reserve(largest, how);
  noise_reducer_.reserve_pieces(largest.mosaic_width, largest.mosaic_height, how);
}

void SignalStages::set_charge(Plane<float> charge_e) {
  has_charge_ = !charge_e.empty();
  if (has_charge_) raw_ = std::move(charge_e);
}

SignalElectronsView SignalStages::electrons(const RawFrame& frame, const DevelopPlan& plan, const Region& region,
                                            NoiseMaps* maps) {
  const NoiseReduction& how = plan.noise_reduction;
  raw_e_ = corner_of(raw_, region.mosaic);
  if (!std::exchange(has_charge_, false)) {
    raw_electrons(frame, plan.levels, region.mosaic, raw_e_, executor_);
    subtract_lines(how.lines, region.mosaic, raw_e_);
  }
  if (how.reduces()) return reduce_noise(frame, how, region, maps);
  subtract_dark(raw_e_, plan.levels.black.dark_mean_e, executor_);
  return {raw_e_, frame.raw.phase};
}

SignalElectronsView SignalStages::reduce_noise(const RawFrame& frame, const NoiseReduction& how, const Region& region,
                                               NoiseMaps* maps) {
  const Rect& active = frame.raw.active;
  const PlaneView<float> signal_e = NoiseReducer::has_result_memory(how)
                                        ? noise_reducer_.result_memory(region.mosaic.width, region.mosaic.height, how)
                                        : corner_of(signal_, region.mosaic);
  denoise::DenoiseMaps views;
  if (maps != nullptr) {
    fit(*maps, active.width, active.height);
    views = views_of(*maps);
  }
  noise_reducer_.run({region.signal, region.mosaic, active.width, active.height, frame.raw.phase}, how, raw_e_,
                     signal_e, views);
  return {signal_e, frame.raw.phase};
}

SignalFractionView SignalStages::fractions(const RawFrame& frame, const DevelopPlan& plan, const Region& region) {
  const PlaneView<float> fraction = corner_of(raw_, region.mosaic);
  subtract_black(frame.raw, plan.levels, region.mosaic, fraction, executor_);
  repair(fraction, {region.mosaic.x, region.mosaic.y}, plan.levels.defects, 2);
  return {fraction, frame.raw.phase};
}

std::span<Plane<float>> SignalStages::noisy_pixels(const RawFrame& frame, const DevelopPlan& plan) {
  const RawDn& raw = frame.raw;
  const std::span planes = std::span(planes_).first(static_cast<std::size_t>(planes_of(raw)));
  std::array<PlaneView<float>, 3> views;
  for (std::size_t c = 0; c < planes.size(); ++c) {
    fit(planes[c], raw.active.width, raw.active.height);
    views[c] = planes[c].view();
  }
  read_pixels(frame, plan.levels, {0, 0, raw.active.width, raw.active.height}, std::span(views).first(planes.size()),
              executor_);
  return planes;
}

std::span<Plane<float>> SignalStages::pixels(const RawFrame& frame, const DevelopPlan& plan, NoiseMaps* maps) {
  const std::span<Plane<float>> planes = noisy_pixels(frame, plan);
  if (plan.noise_reduction.reduces()) pixel_reducer_.run(planes, plan.noise_reduction, noise_reducer_, maps);
  return planes;
}

}  // namespace lowlux::isp
