#include "isp/pipeline/electron_mosaic.h"

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

}  // namespace lowlux::isp
