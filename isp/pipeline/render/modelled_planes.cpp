#include "isp/pipeline/render/modelled_planes.h"

#include <cmath>

#include "isp/render/profile_tables.h"

namespace lowlux::isp {

CameraPlanes through_profile(RawToRgb& kernel, const RgbInput& in, const DevelopPlan& plan,
                             const RgbView<float>& planes, Executor& executor) {
  RgbTransform to_light = plan.rendering.transform;
  to_light.move_into_gamut = false;
  kernel.linear(in, to_light, planes, executor);
  const RgbView<const float> light{planes[0], planes[1], planes[2]};
  apply_profile(*plan.rendering.profile, light, planes, executor);
  return {{planes[0], planes[1], planes[2]}, {1, 1, 1}};
}

RgbTransform transform_of_modelled(const DevelopPlan& plan, const LookGrid* look) {
  RgbTransform out;
  out.luminance = plan.rendering.transform.luminance;
  out.clip = INFINITY;
  out.move_into_gamut = plan.rendering.transform.move_into_gamut;
  out.look = look;
  return out;
}

}  // namespace lowlux::isp
