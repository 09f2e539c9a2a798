#pragma once

#include <span>

#include "isp/base/plane.h"
#include "isp/base/sensor.h"
#include "isp/model/sensor/effect_plan.h"

namespace lowlux::isp {

/// What frames whose effects differ are made with; RGGB.
struct ChangedFrame {
  const SensorModel& sensor;
  Exposure exposure;
  const Developing& developing;
};

/// The larger of both, figure by figure.
PredictedChange larger(const PredictedChange& a, const PredictedChange& b);

/// The largest over all whole blocks of effect_block px: CIEDE2000 of their developed means, and the difference of a
/// channel's variance, relative to that of `reference_dn` or variance_floor_dn2 if that is more.
/// @param dn, reference_dn  of one size
PredictedChange measured_change(const ChangedFrame& frame, const Plane<float>& dn, const Plane<float>& reference_dn);

/// The largest that predict_change() says of the blocks, by what the plan keeps in each.
PredictedChange predicted_change(const ChangedFrame& frame, std::span<const BlockLevel> blocks, const EffectPlan& plan);

}  // namespace lowlux::isp
