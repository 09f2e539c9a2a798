#pragma once

#include <span>
#include <vector>

#include "isp/base/camera_profile.h"
#include "isp/base/packed/raw_format.h"
#include "isp/base/result.h"
#include "isp/model/sensor/exposure_choice.h"

namespace lowlux::calib {

/// Returns gains of a camera for isp::choose_exposure(): system gain, read noise and dark current of the profile at the
/// ISO speed of each, else those that cameras of the format's class have in the median (class_noise). The well holds
/// what the largest code of the lowest gain does.
/// @param factors   analogue gains, rising, above 0; 1 is ISO 100
/// @param white_dn  white level of the stream
/// @param profile   null: none
/// Errors: those of gain_at_iso.
Result<std::vector<isp::GainStep>> exposure_gains(std::span<const double> factors, const RawFormat& format,
                                                  double white_dn, const CameraProfile* profile);

}  // namespace lowlux::calib
