#pragma once

#include "isp/base/result.h"
#include "isp/model/sensor/sensor_db.h"
#include "isp/model/spectrum/spectral_response.h"

namespace lowlux::isp {

/// Rejects figures that would have no effect, because another one they depend on is missing or replaces them: hot
/// pixels without their dark current and vice versa, telegraph noise without its pixels and vice versa, and the
/// position and length of an absent amplifier glow; DSNU, or the dark current's temperature, doubling, activation
/// energy or floor, of a sensor without dark current; a doubling next to an activation energy; a pixel pitch without
/// peak quantum efficiency, unless the luminance that fills a pixel is given; an ISO speed next to that luminance. A
/// fraction of 0 means that the sensor does not have the effect, and needs no other figure.
/// @param sensor  made by sensor_named() of these figures
/// Errors: invalid_argument; the message names the option that does nothing and the other one.
Result<void> check_given_figures(const SensorFigures& given, const NamedSensor& sensor, const Optics& optics);

}  // namespace lowlux::isp
