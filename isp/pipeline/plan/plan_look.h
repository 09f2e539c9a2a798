#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "isp/base/frame.h"
#include "isp/base/matrix3.h"
#include "isp/base/result.h"
#include "isp/model/colour/camera_colour.h"
#include "isp/pipeline/options.h"
#include "isp/pipeline/plan/look.h"
#include "isp/raw/kernel/raw_to_rgb.h"

namespace lowlux::isp {

/// Holds what a look is decided by: the light of a frame, and how it would be rendered without the look.
struct FrameLight {
  std::span<const float> block_luminance;  // white balanced, 1 at the white level, signed
  double black_noise_std = 0;              // standard deviation of the noise of one black pixel, in the same unit
  std::optional<WhitePoint> white;         // absent without a colour calibration
  double exposure_ev = 0;
  Matrix3 balanced = identity3();  // result of balanced_to_output()
  double headroom_ev = 0;          // by which the tone curve's range is extended
  double light_range = 1;          // Thumbnail::light_range
};

/// Decides the look: how bright the scene was, how an eye adapted to it perceives it, which effects that requires, and
/// by how much an automatic exposure is lowered for it (LookPlan::dimming_ev). Returns nullopt where none is requested.
/// Allocates only to report an error, and where a light of known spectrum is stated. Errors: insufficient where the
/// luminance is neither given nor known from the exposure; invalid_argument for values out of range, or a space without
/// RGB primaries (camera, xyz).
Result<std::optional<LookPlan>> plan_look(const RawFrame& frame, const FrameLight& light,
                                          const DevelopOptions& options);

/// Holds what the table of a model depends on in addition to the look.
struct ModelBasis {
  std::optional<WhitePoint> white;
  std::array<float, 3> white_gain{1, 1, 1};
  RgbTransform transform;
  double exposure_ev = 0;
};

/// Holds a model's table and the warnings about it.
struct ModelTable {
  ColourTable table;
  std::vector<std::string> warnings;
};

/// Tabulates the model of a look that has one, for the scene's white, adaptation, light and noise. Errors: no such
/// model (invalid_argument), those of the model and of make_colour_table.
Result<ModelTable> tabulate_model(const LookPlan& look, const ModelBasis& basis, const DevelopOptions& options);

}  // namespace lowlux::isp
