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

/// What a camera that fills one buffer for each request does, in its API's terms: RequestCamera drives it. Integers are
/// 0 or a negative errno. Completions and unplugging are told to a CompletionQueue, from any thread.
class RequestDevice {
 public:
  virtual ~RequestDevice() = default;
  virtual int start() = 0;
  virtual void stop() = 0;  // when it returns, no more completions come
  virtual int queue(int buffer) = 0;
  virtual std::span<const std::byte> bytes(int buffer) const = 0;
  virtual bool begin_reading(int buffer) = 0;  // false: the bytes may be stale
  virtual void end_reading(int buffer) = 0;
};

/// An open device and all that was agreed on with it.
struct OpenRequestDevice {
  std::shared_ptr<CompletionQueue> completions;  // what the device tells
  std::unique_ptr<RequestDevice> device;
  std::string name;
  CameraFormat format;
  std::vector<std::string> warnings;
  int buffers = 0;  // each holds frame_bytes(format)
};

/// What a device's negative errno means, in `doing` ("start") something with a camera.
Error device_error(int negative_errno, const std::string& doing, const std::string& camera);

/// A camera made of requests: counts what is lost, drops frames of the start, keeps account of lent buffers.
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
  void give_back(const CameraFrame& frame) override;
  void stop() override;

 private:
  Error gone() const;
  Error none_in_time(std::chrono::milliseconds timeout) const;
  Error cancelled();
  void queue(int buffer);
  CameraFrame lend(const Completion& completion);
  std::uint32_t lost_before(std::uint32_t sequence);

  OpenRequestDevice open_;
  bool streaming_ = false;
  int failed_ = 0;                                             // the errno a buffer was refused with
  std::optional<std::uint32_t> last_sequence_;                 // of this stream
  std::vector<std::optional<std::chrono::nanoseconds>> lent_;  // by buffer: the timestamp of the frame lent
};

}  // namespace lowlux::capture
