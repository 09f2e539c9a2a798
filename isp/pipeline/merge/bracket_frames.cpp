#include "isp/pipeline/merge/bracket_frames.h"

#include <cmath>
#include <utility>

#include "isp/merge/exposure.h"
#include "isp/merge/placement.h"

namespace lowlux::isp {

BracketFrames::BracketFrames(int width, int height, Executor& executor)
    : width_(width), height_(height), executor_(executor) {}

Plane<float> BracketFrames::remove_saturated(FrameElectrons& frame) const {
  Plane<float> saturated(width_, height_);
  merge::remove_saturated(frame.signal_e.view(), frame.phase, frame.saturation_e, saturated.view(), executor_);
  return saturated;
}

void BracketFrames::begin(FrameElectrons& reference) {
  saturated_ = remove_saturated(reference);
  least_light_ = 1;
}

Plane<float> BracketFrames::placed_weights(const FrameElectrons& frame, double light,
                                           const merge::Motion& motion) const {
  Plane<float> weight(width_, height_), placed(width_, height_);
  merge::inverse_variance_weights(view_of(frame), light, frame.saturation_e, weight.view(), executor_);
  merge::place_nearest(std::as_const(weight).view(), frame.phase, motion, {}, placed.view(), executor_);
  return placed;
}

double BracketFrames::measured_light(const merge::FrameView& reference, const FrameElectrons& frame,
                                     const merge::Motion& motion, double stated) const {
  Plane<float> placed(width_, height_);
  merge::place_nearest(frame.signal_e.view(), frame.phase, motion, {}, placed.view(), executor_);
  const auto found = merge::measure_light_ratio(
      reference, {std::as_const(placed).view(), frame.phase, frame.variance_e2}, stated, executor_);
  return found && std::fabs(found->ratio - stated) > 3 * found->standard_error ? found->ratio : stated;
}

void BracketFrames::add(const FrameElectrons& frame, double light, const Plane<float>& saturated,
                        const merge::Motion& motion) {
  if (light >= least_light_) return;
  least_light_ = light;
  merge::place_nearest(saturated.view(), frame.phase, motion, {}, saturated_.view(), executor_);
}

}  // namespace lowlux::isp
