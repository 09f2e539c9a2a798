#pragma once

#include <span>

#include "isp/base/plane.h"
#include "isp/base/sensor.h"
#include "isp/model/sensor/noise_source_plan.h"

namespace lowlux::isp {

/// Data from which frames with different effects are made; RGGB.
struct ChangedFrame {
  const SensorModel& sensor;
  Exposure exposure;
  const Developing& developing;
};

/// Returns the larger of both, member by member.
PredictedChange larger(const PredictedChange& a, const PredictedChange& b);

/// Returns the largest changes over all complete blocks of effect_block px: CIEDE2000 of their developed means, and the
/// difference of a channel's variance, relative to that of `reference_dn` or variance_floor_dn2 if that is more.
/// @param dn, reference_dn  of one size
PredictedChange measured_change(const ChangedFrame& frame, const Plane<float>& dn, const Plane<float>& reference_dn);

/// Returns the largest changes that predict_change() gives for the blocks, by the effects the plan keeps in each.
PredictedChange predicted_change(const ChangedFrame& frame, std::span<const BlockLevel> blocks,
                                 const NoiseSourcePlan& plan);

}  // namespace lowlux::isp
