#include "isp/bench/effect_change.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "isp/bench/simulated_camera.h"
#include "isp/model/colour_difference.h"

namespace lowlux::isp {

PredictedChange larger(const PredictedChange& a, const PredictedChange& b) {
  return {std::max(a.delta_e, b.delta_e), std::max(a.relative_variance, b.relative_variance)};
}

PredictedChange measured_change(const ChangedFrame& frame, const Plane<float>& dn, const Plane<float>& reference_dn) {
  assert(dn.width() == reference_dn.width() && dn.height() == reference_dn.height());
  const auto statistics = [&](const Plane<float>& of) {
    const Plane<float> charge_e = charge_of(of, frame.sensor);
    return box_statistics(std::as_const(charge_e).view(), BayerPhase::rggb, effect_block);
  };
  const auto changed = statistics(dn), reference = statistics(reference_dn);
  const double k = frame.sensor.system_gain_dn_per_e, floor_e2 = variance_floor_dn2 / (k * k);
  PredictedChange out;
  for (std::size_t i = 0; i < changed.size(); ++i) {
    out.delta_e = std::max(out.delta_e, ciede2000(developed_lab(frame.developing, reference[i].mean),
                                                  developed_lab(frame.developing, changed[i].mean)));
    for (std::size_t c = 0; c < 3; ++c) {
      const double change_e2 = std::fabs(changed[i].variance[c] - reference[i].variance[c]);
      out.relative_variance = std::max(out.relative_variance, change_e2 / std::max(reference[i].variance[c], floor_e2));
    }
  }
  return out;
}

PredictedChange predicted_change(const ChangedFrame& frame, std::span<const BlockLevel> blocks,
                                 const EffectPlan& plan) {
  assert(blocks.size() == plan.region_of_block.size());
  PredictedChange out;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    out = larger(out, predict_change(frame.sensor, frame.exposure, frame.developing, blocks[i],
                                     plan.regions[plan.region_of_block[i]].kept));
  }
  return out;
}

}  // namespace lowlux::isp
