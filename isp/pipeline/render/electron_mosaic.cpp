#include "isp/pipeline/render/electron_mosaic.h"

#include <utility>

#include "isp/raw/subtract_dark_frame.h"
#include "isp/raw/to_linear.h"

namespace lowlux::isp {
namespace {

Rect whole_of(const RawDn& raw) { return {0, 0, raw.active.width, raw.active.height}; }

}  // namespace

void take_black_off(const RawDn& raw, const DevelopPlan& plan, PlaneView<float> out, Executor& executor) {
  take_black_off(raw, plan, whole_of(raw), out, executor);
}

void take_black_off(const RawDn& raw, const DevelopPlan& plan, const Rect& part, PlaneView<float> out,
                    Executor& executor) {
  if (plan.options.dark_frame) {
    to_fraction(raw, *plan.options.dark_frame, plan.black, part, out, executor);
  } else {
    to_fraction(raw, plan.black, part, out, executor);
  }
}

RawElectrons raw_electrons(const RawFrame& frame, const DevelopPlan& plan, Plane<float> memory, Executor& executor) {
  const RawDn& raw = frame.raw;
  if (memory.width() != raw.active.width || memory.height() != raw.active.height) {
    memory = Plane<float>(raw.active.width, raw.active.height);
  }
  raw_electrons(frame, plan, whole_of(raw), memory.view(), executor);
  return {std::move(memory), raw.phase};
}

void raw_electrons(const RawFrame& frame, const DevelopPlan& plan, const Rect& part, PlaneView<float> out,
                   Executor& executor) {
  if (plan.options.dark_frame) {
    take_black_off(frame.raw, plan, part, out, executor);
    count_electrons(out, *plan.electrons_at_white, executor);
  } else {
    to_electrons(frame.raw, plan.black, *plan.electrons_at_white, part, out, executor);
  }
  repair(out, {part.x, part.y}, plan.defects, 2);
}

PerSite<float> of_crop(const PerSite<double>& active, const Rect& crop) {
  PerSite<float> out{};
  for (int site = 0; site < 4; ++site) {
    out[site] = static_cast<float>(active[site_of(crop.x + (site & 1), crop.y + (site >> 1))]);
  }
  return out;
}

PerSite<float> site_gains(const RawDn& raw, const DevelopPlan& plan, const PerSite<double>& units_at_white,
                          const Rect& crop) {
  PerSite<double> gain{};
  for (int site = 0; site < 4; ++site) {
    const int colour = static_cast<int>(colour_at(raw.phase, site & 1, site >> 1));
    gain[site] = plan.white_gain[colour] / units_at_white[site];
  }
  return of_crop(gain, crop);
}

PerSite<float> site_gains(const RawDn& raw, const DevelopPlan& plan, const Rect& crop) {
  return site_gains(raw, plan, plan.electrons_at_white.value_or(PerSite<double>{1, 1, 1, 1}), crop);
}

}  // namespace lowlux::isp
