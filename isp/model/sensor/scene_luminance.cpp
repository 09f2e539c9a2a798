#include "isp/model/sensor/scene_luminance.h"

#include <cmath>

namespace lowlux::isp {
namespace {

bool is_positive(const std::optional<double>& value) { return value && std::isfinite(*value) && *value > 0; }

}  // namespace

std::optional<double> saturation_luminance_cd_m2(const FrameInfo& info) {
  if (!is_positive(info.f_number) || !is_positive(info.iso) || !is_positive(info.exposure_s)) return std::nullopt;
  const double luminance = 78.0 * *info.f_number * *info.f_number / (0.65 * *info.iso * *info.exposure_s);
  if (!std::isfinite(luminance) || luminance <= 0) return std::nullopt;
  return luminance;
}

}  // namespace lowlux::isp
