#include "isp/reproduce/sensor_scenario.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "isp/metrics/statistics.h"
#include "isp/model/colour/colour_difference.h"
#include "isp/model/colour/dark_desaturation.h"

namespace lowlux::isp {
namespace {

// Holds signal, dark and the variance of their sum [e-, e-^2] in each channel.
struct Charge {
  Vector3 signal_e;
  Vector3 total_e;
  Vector3 variance_e2;
};

Charge charge_of(const ThesisCamera& camera, const Patch& patch, double level, const Noises& noises) {
  const double gain = camera.sensor.system_gain_dn_per_e;
  const double read_e2 = noises.read ? camera.sensor.read_noise_e * camera.sensor.read_noise_e : 0;
  const double converter_e2 = noises.converter ? 1 / (12 * gain * gain) : 0;
  const Vector3 dark_e = noises.dark ? dark_charge_e(camera) : Vector3{};
  Charge out{};
  for (int k = 0; k < 3; ++k) {
    out.signal_e[k] = level * patch.signal_e[k];
    out.total_e[k] = out.signal_e[k] + dark_e[k];
    out.variance_e2[k] = out.total_e[k] + read_e2 + converter_e2;
  }
  return out;
}

Result<PatchResult> run_patch(const ThesisCamera& camera, const Patch& patch, double level, const Scenario& scenario,
                              const PatchPlace& place) {
  const Charge charge = charge_of(camera, patch, level, scenario.noises);
  const auto truth = xy_of(xyz_of_charge(camera, charge.signal_e));
  const auto expected = sensor_cloud(camera, charge.total_e, charge.variance_e2);
  if (!truth || !expected)
    return fail(ErrorCode::insufficient, "the camera's matrix gives " + patch.name + " no colour");
  PatchResult out;
  out.truth = *truth;
  out.expected = *expected;
  const PatchSamples samples = photograph(camera, patch, level, scenario.noises, place, scenario.samples);
  out.saturated = samples.saturated;
  out.unsaturated = static_cast<int>(samples.dn.size());
  out.xy = chromaticities(camera, samples.dn);
  out.sampled = cloud_of(out.xy);
  out.delta_e_ab = mean_delta_e_ab(camera, xyz_of_charge(camera, charge.signal_e), samples.dn);
  out.codes = static_cast<int>(std::set<Vector3>(samples.dn.begin(), samples.dn.end()).size());
  if (const auto code = mean_code(samples.dn)) {
    const Xyz measured = xyz_of(camera.dn_to_xyz * *code);
    const Xyz dark = scenario.noises.dark ? xyz_of_charge(camera, dark_charge_e(camera)) : Xyz{};
    out.mean_code_xy = xy_of(measured);
    out.undone_xy = resaturated(measured, dark);
  }
  return out;
}

}  // namespace

double mean_delta_e_ab(const ThesisCamera& camera, const Xyz& truth, const std::vector<Vector3>& dn) {
  const auto lab = [](const Xyz& c) { return lab_of({c.x / c.y, 1, c.z / c.y}, *xyz_of(white_d65)); };
  double sum = 0;
  int counted = 0;
  for (const Vector3& code : dn) {
    const Xyz sample = xyz_of(camera.dn_to_xyz * code);
    if (!(sample.y > 0)) continue;
    sum += delta_e_ab(lab(truth), lab(sample));
    ++counted;
  }
  return counted > 0 ? sum / counted : std::nan("");
}

Result<std::vector<LevelResult>> run_scenario(const ThesisCamera& camera, const std::vector<Patch>& patches,
                                              const Scenario& scenario, std::uint64_t seed) {
  std::vector<LevelResult> out;
  for (const double level : scenario.levels) {
    LevelResult result{level, {}};
    PatchPlace place{seed, scenario.frame + static_cast<std::uint32_t>(out.size()), 0};
    for (const Patch& patch : patches) {
      auto one = run_patch(camera, patch, scenario.light_factor * level, scenario, place);
      if (!one) return tl::make_unexpected(one.error());
      result.patches.push_back(*std::move(one));
      ++place.patch;
    }
    out.push_back(std::move(result));
  }
  return out;
}

double worst_mean_error(const std::vector<LevelResult>& levels) {
  double worst = 0;
  for (const LevelResult& level : levels) {
    for (const PatchResult& patch : level.patches) {
      if (patch.saturated > 0 || !patch.mean_code_xy) continue;
      const auto n = static_cast<std::size_t>(patch.unsaturated);
      worst = std::max(worst, mean_error(*patch.mean_code_xy, patch.expected.mean, patch.expected.covariance, n));
    }
  }
  return worst;
}

}  // namespace lowlux::isp
