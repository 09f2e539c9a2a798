#include "isp/pipeline/electron_mosaic.h"

#include <utility>

#include "isp/raw/subtract_dark_frame.h"
#include "isp/raw/to_linear.h"

namespace lowlux::isp {

void take_black_off(const RawDn& raw, const DevelopPlan& plan, PlaneView<float> out, Executor& executor) {
  if (plan.options.dark_frame) {
    to_fraction(raw, *plan.options.dark_frame, plan.black, out, executor);
  } else {
    to_fraction(raw, plan.black, out, executor);
  }
}

RawElectrons raw_electrons(const RawFrame& frame, const DevelopPlan& plan, Plane<float> memory, Executor& executor) {
  const RawDn& raw = frame.raw;
  if (memory.width() != raw.active.width || memory.height() != raw.active.height) {
    memory = Plane<float>(raw.active.width, raw.active.height);
  }
  RawElectrons out;
  if (plan.options.dark_frame) {
    take_black_off(raw, plan, memory.view(), executor);
    out = to_electrons(RawFraction{std::move(memory), raw.phase}, *plan.electrons_at_white, executor);
  } else {
    to_electrons(raw, plan.black, *plan.electrons_at_white, memory.view(), executor);
    out = {std::move(memory), raw.phase};
  }
  repair(out.value.view(), plan.defects, 2);
  return out;
}

}  // namespace lowlux::isp
