#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "capture/camera/camera.h"
#include "capture/libcamera/completion_queue.h"

namespace lowlux::capture {

/// Interface of a camera that fills one buffer for each request, in its API's terms: RequestCamera uses it. Integers
/// are 0 or a negative errno. Completions and unplugging are reported to a CompletionQueue, from any thread.
class RequestDevice {
 public:
  virtual ~RequestDevice() = default;
  virtual int start() = 0;
  virtual void stop() = 0;  // no completions come after it returns
  virtual int queue(int buffer) = 0;
  virtual std::span<const std::byte> bytes(int buffer) const = 0;
  virtual bool begin_reading(int buffer) = 0;  // false: the bytes may be stale
  virtual void end_reading(int buffer) = 0;
  /// Errors: no such control (unsupported).
  virtual Result<ExposureControls> take_exposure() = 0;
  virtual void set_exposure(const CameraExposure& exposure) = 0;  // with the next buffer that is queued
};

/// An open device and what was agreed on with it.
struct OpenRequestDevice {
  std::shared_ptr<CompletionQueue> completions;  // reports of the device
  std::unique_ptr<RequestDevice> device;
  std::string name;
  CameraFormat format;
  std::vector<std::string> warnings;
  int buffers = 0;  // each holds frame_bytes(format)
};

/// Returns the error of a device's negative errno; `doing` ("start") is the action on the camera that failed.
Error device_error(int negative_errno, const std::string& doing, const std::string& camera);

/// A camera with requests: counts lost frames, drops frames of the start, keeps track of lent buffers.
class RequestCamera final : public Camera {
 public:
  explicit RequestCamera(OpenRequestDevice open);
  ~RequestCamera() override;
  RequestCamera(const RequestCamera&) = delete;
  RequestCamera& operator=(const RequestCamera&) = delete;

  const std::string& name() const override { return open_.name; }
  const CameraFormat& format() const override { return open_.format; }
  const std::vector<std::string>& warnings() const override { return open_.warnings; }
  Result<void> start() override;
  Result<CameraFrame> next(std::chrono::milliseconds timeout) override;
  void return_buffer(const CameraFrame& frame) override;
  void stop() override;
  Result<ExposureControls> take_exposure() override;
  Result<double> set_exposure(const CameraExposure& exposure) override;

 private:
  Error gone() const;
  Error frame_timeout_error(std::chrono::milliseconds timeout) const;
  Error cancelled();
  void queue(int buffer);
  CameraFrame lend(const Completion& completion);
  std::uint32_t lost_before(std::uint32_t sequence);

  OpenRequestDevice open_;
  bool streaming_ = false;
  int failed_ = 0;                                             // the errno with which a buffer was rejected
  std::optional<std::uint32_t> last_sequence_;                 // last sequence number of this stream
  std::vector<std::optional<std::chrono::nanoseconds>> lent_;  // by buffer: the timestamp of the lent frame
};

}  // namespace lowlux::capture
