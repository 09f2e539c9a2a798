#include "denoise/patch_estimate.h"

#include <algorithm>
#include <cassert>

namespace lowlux::denoise {

XyzEstimate xyz_estimate(const Matrix3& camera_to_xyz, const PatchMean& patch) {
  const double noise_e2 = patch.noise_std_e * patch.noise_std_e;
  Vector3 signal_e{}, variance_e2{};
  for (int k = 0; k < 3; ++k) {
    assert(patch.dark_e[k] >= 0 && patch.pixels[k] > 0 && patch.noise_std_e >= 0);
    signal_e[k] = patch.charge_e[k] - patch.dark_e[k];
    variance_e2[k] = (std::max(patch.charge_e[k], 0.0) + noise_e2) / patch.pixels[k];
    if (!patch.dark_pixels) continue;
    assert((*patch.dark_pixels)[k] > 0);
    variance_e2[k] += (patch.dark_e[k] + noise_e2) / (*patch.dark_pixels)[k];
  }
  const Matrix3& a = camera_to_xyz;
  const Matrix3 transposed{{{a[0][0], a[1][0], a[2][0]}, {a[0][1], a[1][1], a[2][1]}, {a[0][2], a[1][2], a[2][2]}}};
  return {isp::xyz_of(a * signal_e), a * diagonal3(variance_e2) * transposed};
}

}  // namespace lowlux::denoise
