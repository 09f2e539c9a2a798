#include "isp/model/vision/detection.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "isp/base/text.h"
#include "isp/model/vision/seeing.h"

namespace lowlux::isp {
namespace {

// Returns the probability of at least K isomerisations by light and in the dark. Means beyond 1e12 are as certain.
double detected(const DetectionLimit& limit, double luminance_cd_m2) {
  const double light = luminance_cd_m2 > 0 ? std::min(luminance_cd_m2 * limit.patch.counts_per_cd_m2, 1e12) : 0.0;
  return *frequency_of_seeing({light, 1, limit.patch.dark_counts}, limit.threshold);
}

DetectionLimit limit_of(const ReceptorField& patch, double false_alarms) {
  DetectionLimit limit{patch, 1, 0};
  // False alarms fall with K; from the mean on the search takes a few standard deviations.
  limit.threshold = std::max(1, static_cast<int>(patch.dark_counts));
  while (detected(limit, 0) > false_alarms) ++limit.threshold;
  while (limit.threshold > 1) {
    DetectionLimit lower = limit;
    --lower.threshold;
    if (detected(lower, 0) > false_alarms) break;
    limit = lower;
  }
  limit.false_alarm_rate = detected(limit, 0);
  return limit;
}

constexpr double circle_deg2(double diameter_deg) { return std::numbers::pi / 4 * diameter_deg * diameter_deg; }

double either(double a, double b) { return a + (1 - a) * b; }

}  // namespace

Result<SeeingModel> seeing_model(double pupil_mm2, double false_alarms) {
  if (!(pupil_mm2 >= 0) || !std::isfinite(pupil_mm2)) {
    return fail(ErrorCode::invalid_argument,
                "the area of a pupil must be 0 or more and finite [mm2], found " + number_text(pupil_mm2));
  }
  if (!(false_alarms > 0 && false_alarms < 1)) {
    return fail(ErrorCode::invalid_argument,
                "a probability of false alarms must be strictly between 0 and 1, found " + number_text(false_alarms));
  }
  SeeingModel model{limit_of(rods_in(circle_deg2(rod_summation_deg), pupil_mm2), false_alarms / 2),
                    limit_of(cones_in(circle_deg2(cone_summation_deg), pupil_mm2), false_alarms / 2), 0};
  model.false_alarm_rate = either(model.rods.false_alarm_rate, model.cones.false_alarm_rate);
  return model;
}

double probability_of_seeing(const SeeingModel& model, const LuminancePair& light) {
  const double by_rods = detected(model.rods, light.scotopic);
  return by_rods == 1 ? 1 : either(by_rods, detected(model.cones, light.photopic));
}

}  // namespace lowlux::isp
