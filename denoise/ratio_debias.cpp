#include "denoise/ratio_debias.h"

#include <algorithm>
#include <cmath>

namespace lowlux::denoise {

std::optional<DebiasedChroma> debiased_chroma(const XyzEstimate& estimate) {
  const Vector3 xyz = isp::vector_of(estimate.value);
  const double weight = dot(weight_form, xyz);
  const double variance = covariance_of(weight_form, estimate.covariance, weight_form);
  if (!(weight > 0) || !(variance >= 0)) return std::nullopt;
  const double floor = std::max(weight, 3 * std::sqrt(variance));  // the estimate stays bounded where W vanishes
  const auto debiased = [&](const Vector3& form) {
    const double ratio = dot(form, xyz) / weight;
    const double covariance = covariance_of(form, estimate.covariance, weight_form);
    return ratio - (ratio * (variance / floor) - covariance / floor) / floor;
  };
  const isp::UvPrime uv{debiased(u_form), debiased(v_form)};
  if (!std::isfinite(uv.u) || !std::isfinite(uv.v)) return std::nullopt;
  return DebiasedChroma{uv, weight / std::sqrt(variance)};
}

}  // namespace lowlux::denoise
