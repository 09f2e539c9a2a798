#pragma once

#include "isp/model/vision/retina.h"

namespace lowlux::isp {

/// Describes how rods, or L and M cones, detect light against their own dark light: a patch of the area over which they
/// sum completely (Ricco's area) is seen if at least `threshold` isomerisations happen in it in the integration time.
struct DetectionLimit {
  ReceptorField patch;
  int threshold = 1;            // K: the smallest whose false alarms are as rare as requested
  double false_alarm_rate = 0;  // probability of K isomerisations without light
};

/// Describes detection by both kinds of receptors, which is seeing.
struct SeeingModel {
  DetectionLimit rods;
  DetectionLimit cones;
  double false_alarm_rate = 0;  // probability that the patch is seen without light: by rods or cones
};

/// Gives the probability of false alarms that thresholds are chosen for, half of it for each kind of receptor; chosen.
inline constexpr double requested_false_alarms = 0.01;

/// Gives the diameters of Ricco's areas: of rods 48 minutes of arc, the mean of ten young observers at 6 degrees
/// (schefrin-1998); of cones 5 minutes in the fovea (davila-geisler-1991).
inline constexpr double rod_summation_deg = 48.0 / 60, cone_summation_deg = 5.0 / 60;

/// Returns the model of an eye with this pupil.
/// @param false_alarms  largest probability of false alarms, 0 to 1 exclusive
/// Errors: false_alarms outside its range; a pupil that is negative or not finite.
Result<SeeingModel> seeing_model(double pupil_mm2, double false_alarms = requested_false_alarms);

/// Returns the probability that a patch of Ricco's area with these luminances, shown for the integration time in front
/// of a dark-adapted eye, is seen: 1 - (1 - P_rods) (1 - P_cones), each by frequency_of_seeing(). It is
/// false_alarm_rate without light, and never falls when a luminance rises. Luminances below 0 or not numbers count as
/// 0.
double probability_of_seeing(const SeeingModel& model, const LuminancePair& light);

}  // namespace lowlux::isp
