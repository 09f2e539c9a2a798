#include "isp/pipeline/plan/plan_light.h"

#include <algorithm>

#include <fmt/format.h>

#include "isp/base/camera_profile.h"
#include "isp/model/spectrum/spectral_data.h"
#include "isp/model/vision/mesopic.h"
#include "isp/model/vision/night_eye.h"
#include "isp/model/vision/scene_light.h"
#include "isp/model/vision/scotopic_fit.h"
#include "isp/render/output_space.h"

namespace lowlux::isp {
namespace {

Vector3 row_times(const Vector3& row, const Matrix3& m) {
  Vector3 out{};
  for (int j = 0; j < 3; ++j) out[j] = row[0] * m[0][j] + row[1] * m[1][j] + row[2] * m[2][j];
  return out;
}

// Returns the weights of a profile, or those fitted on the channels of the camera; nullopt where neither is known, the
// spectrum of the light is unknown, or the light leaves too little to fit on.
std::optional<RodWeights> weights_of_rods(const FrameInfo& info, const LookChoice& choice) {
  if (!choice.light || !choice.light->spectrum) return std::nullopt;
  if (choice.rod_weights) return RodWeights{"profile", *choice.rod_weights, {}};
  const auto camera = known_camera(choice.camera.empty() ? camera_name(info.make, info.model) : choice.camera);
  if (!camera) return std::nullopt;
  const auto fit = fit_scotopic(*camera_sensitivity(*camera), *choice.light->spectrum, pigment_reflectances());
  if (!fit) return std::nullopt;
  return RodWeights{*camera, fit->weights, fit->relative_error};
}

double ratio_of_white(const std::optional<WhitePoint>& white) {
  const std::optional<Xyz> colour = xyz_of(white ? white->xy : output_white);
  return std::clamp(colour ? scotopic_luminance(*colour) : 0.0, min_scotopic_ratio, max_scotopic_ratio);
}

}  // namespace

void decide_light(const RawFrame& frame, const FrameLight& light, const LookChoice& choice, LookPlan& plan) {
  plan.light_rule = !choice.light ? "white" : choice.light->spectrum ? "spectrum" : "given";
  plan.look.scotopic_ratio_of_white = choice.light ? choice.light->scotopic_ratio : ratio_of_white(light.white);
  if (light.white) plan.rods = weights_of_rods(frame.raw.info, choice);
}

Result<void> decide_adaptation(const FrameLight& light, const DevelopOptions& options, LookPlan& plan) {
  const LookChoice& choice = options.look;
  if (!light.white) return {};
  plan.adaptation_degree =
      choice.adaptation_degree.value_or(choice.light ? degree_of_adaptation(plan.mean_cd_m2) : 1.0);
  if (plan.adaptation_degree == 1) return {};
  const Xy scene = choice.light && choice.light->white ? *choice.light->white : light.white->xy;
  const auto adaptation = incomplete_adaptation(scene, output_white, plan.adaptation_degree);
  if (!adaptation) {
    return fail(
        ErrorCode::invalid_argument,
        fmt::format("CAT02 has no adaptation of degree {:.3g} to a light of this saturation: use --adaptation-degree 1",
                    plan.adaptation_degree));
  }
  const Matrix3 from_xyz = *xyz_to_output(options.space);
  plan.adaptation = from_xyz * *adaptation * *inverse(from_xyz);
  return {};
}

void set_primaries(OutputSpace space, const Matrix3& balanced, LookPlan& plan) {
  const Matrix3 from_xyz = *xyz_to_output(space), to_xyz = *inverse(from_xyz);
  const Vector3 luminance = *luminance_weights(space);
  const Vector3 tint = from_xyz * (*rgb_to_xyz(primaries_rec709) * rod_tint);
  const std::optional<Matrix3> to_camera = inverse(balanced);
  const Vector3 adapted =
      plan.rods && to_camera ? row_times(plan.rods->weights, *to_camera) : row_times(scotopic_weights, to_xyz);
  const double white = adapted[0] + adapted[1] + adapted[2];
  const Vector3 rods = row_times(adapted, *inverse(plan.adaptation));
  for (int j = 0; j < 3; ++j) {
    plan.look.luminance[j] = static_cast<float>(luminance[j]);
    plan.look.rods[j] = static_cast<float>(rods[j] / white);
    plan.look.tint[j] = static_cast<float>(tint[j]);
  }
}

}  // namespace lowlux::isp
