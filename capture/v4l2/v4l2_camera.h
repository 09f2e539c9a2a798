#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/camera/camera.h"
#include "capture/v4l2/v4l2_buffers.h"
#include "capture/v4l2/v4l2_device.h"
#include "capture/v4l2/v4l2_exposure.h"
#include "capture/v4l2/v4l2_negotiation.h"

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

/// A V4L2 node with which a format was agreed. It holds memory and streams from start() to stop().
class V4l2Camera final : public Camera {
 public:
  V4l2Camera(std::unique_ptr<V4l2Device> device, V4l2Agreement agreement, V4l2Options options);

  const std::string& name() const override { return device_->name(); }
  const CameraFormat& format() const override { return agreement_.format; }
  const std::vector<std::string>& warnings() const override { return agreement_.warnings; }
  Result<void> start() override;
  Result<CameraFrame> next(std::chrono::milliseconds timeout) override;
  void return_buffer(const CameraFrame& frame) override;
  void stop() override;
  Result<ExposureControls> take_exposure() override;
  Result<double> set_exposure(const CameraExposure& exposure) override;

 private:
  Result<void> check_unchanged();
  std::optional<Error> not_ready() const;
  std::optional<Error> wait(std::chrono::nanoseconds until, short events, short* happened);
  Result<CameraFrame> deliver(const V4l2Taken& taken);
  std::optional<Error> contradiction(const V4l2Taken& taken) const;
  std::chrono::nanoseconds timestamp_of(const V4l2Taken& taken);
  void requeue(std::size_t index);

  std::unique_ptr<V4l2Device> device_;  // first: the members below refer to it and are destroyed before it
  V4l2Agreement agreement_;
  V4l2Options options_;
  std::optional<V4l2AutoExposure> exposure_;  // once taken
  std::unique_ptr<V4l2Buffers> buffers_;      // while streaming
  FrameFacts facts_;
  std::optional<std::uint32_t> last_sequence_;
  std::optional<Error> failure_;  // failure that occurred where none can be returned
  int session_ = 0;               // counts the starts, to identify frames of an earlier one
  bool warned_of_clock_ = false;
};

}  // namespace lowlux::capture
