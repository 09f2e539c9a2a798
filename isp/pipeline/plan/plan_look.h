#pragma once

#include <optional>
#include <span>

#include "isp/base/result.h"
#include "isp/pipeline/plan.h"

namespace lowlux::isp {

/// What is known of a frame's light before exposure.
struct FrameLight {
  std::span<const float> block_luminance;  // white balanced, 1 at the white level, signed
  double black_noise_std = 0;              // of one pixel, same unit
};

/// Decides the look: how bright the scene was, how an eye adapted to it sees it, which effects that calls for. Sets
/// plan.look where one is asked for (into the memory of one that is there), and lowers an automatic exposure by the
/// share of the darkness that is kept. Needs the plan's white balance and exposure. Errors: insufficient where the
/// luminance is neither given nor told by the exposure; invalid_argument for figures out of range, or a space without
/// RGB primaries (camera, xyz).
Result<void> plan_look(const RawFrame& frame, const FrameLight& light, DevelopPlan& plan);

/// Tabulates the model of a look that has one, for the scene's white, adaptation, light and noise. Needs
/// plan.transform. Errors: no such model (invalid_argument), those of the model and of make_colour_table.
Result<void> plan_model(DevelopPlan& plan);

}  // namespace lowlux::isp
