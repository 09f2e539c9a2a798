#pragma once

#include <optional>
#include <vector>

#include "capture/camera/camera.h"
#include "capture/v4l2/v4l2_device.h"
#include "capture/v4l2/v4l2_exposure.h"

namespace lowlux::capture {

/// Sets exposure time and gain of a node while it streams, by its controls.
class V4l2AutoExposure {
 public:
  /// Ends the driver's own automatics and finds the controls. Errors: as Camera::take_exposure.
  static Result<V4l2AutoExposure> take(V4l2Device& device, const V4l2Options& options, const CameraFormat& format);

  const ExposureControls& controls() const { return controls_; }
  /// Errors: as Camera::set_exposure.
  Result<double> set(V4l2Device& device, const CameraExposure& exposure);

 private:
  V4l2ExposureTime time_;
  std::optional<V4l2Control> gain_;  // present if it is to be set
  std::optional<int> code_;          // set last
  ExposureControls controls_;
};

}  // namespace lowlux::capture
