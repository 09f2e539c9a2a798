#include "denoise/confidence.h"

#include <cassert>
#include <cmath>

namespace lowlux::denoise {
namespace {

/// 1 / (1 + q^2) for q = noise / what is expected; 0 where there is no such q.
double share_of(double expected_std, double noise_std) {
  if (!(expected_std > 0) || !(noise_std >= 0)) return 0;
  const double q = noise_std / expected_std;
  return std::isnan(q) ? 0 : 1 / (1 + q * q);
}

Vector3 difference(const Vector3& numerator, double neutral) {
  Vector3 out{};
  for (int i = 0; i < 3; ++i) out[i] = numerator[i] - neutral * weight_form[i];
  return out;
}

}  // namespace

ShrunkChroma shrunk_chroma(const XyzEstimate& estimate, const ChromaPrior& prior) {
  assert(prior.std > 0);
  const Vector3 xyz = isp::vector_of(estimate.value);
  const double weight = dot(weight_form, xyz);
  const Vector3 u_row = difference(u_form, prior.neutral.u), v_row = difference(v_form, prior.neutral.v);
  const double noise = std::sqrt((covariance_of(u_row, estimate.covariance, u_row) +  //
                                  covariance_of(v_row, estimate.covariance, v_row)) /
                                 2);
  const double a = weight * prior.std / noise;  // how far the expected chroma stands out of the noise
  const auto moved = [&](const Vector3& row) {
    // w / W as one factor: apart, the one vanishes and the other grows where W does.
    const double r = dot(row, xyz);
    return noise > 0 && std::isfinite(a) ? r / noise * prior.std / (a + 1 / a) : r / weight;
  };
  const double w = share_of(weight * prior.std, noise);
  const isp::UvPrime uv{prior.neutral.u + moved(u_row), prior.neutral.v + moved(v_row)};
  if (!(w > 0) || !std::isfinite(uv.u) || !std::isfinite(uv.v)) return {prior.neutral, 0};
  return {uv, w};
}

double chroma_confidence(const isp::UvCovariance& covariance, double prior_std) {
  assert(prior_std > 0);
  return share_of(prior_std, std::sqrt((covariance.uu + covariance.vv) / 2));
}

double plane_confidence(double luma, double residual_variance, double rho) {
  assert(rho > 0);
  return share_of(luma * rho, std::sqrt(residual_variance));
}

}  // namespace lowlux::denoise
