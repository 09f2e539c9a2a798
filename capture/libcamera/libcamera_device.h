#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "capture/camera/camera.h"
#include "capture/libcamera/completion_queue.h"
#include "capture/libcamera/mapped_plane.h"
#include "capture/libcamera/raw_stream.h"
#include "capture/libcamera/request_camera.h"
#include "capture/libcamera/start_controls.h"
#include "isp/base/result.h"

namespace libcamera {
class Camera;
class CameraConfiguration;
class CameraManager;
class FrameBufferAllocator;
class Request;
}  // namespace libcamera

namespace lowlux::capture {

/// Returns the one manager that libcamera allows in a process, which runs as long as it is referenced. Errors:
/// unreadable.
Result<std::shared_ptr<libcamera::CameraManager>> libcamera_manager();

/// Returns a camera's name for display: its model if it states one.
std::string libcamera_name(const libcamera::Camera& camera);

/// Returns the formats that a configuration's first stream offers; none without a configuration.
std::vector<OfferedStream> offered_streams(const libcamera::CameraConfiguration* configuration);

/// Returns the configuration for a raw stream alone; null if the camera has none.
std::unique_ptr<libcamera::CameraConfiguration> raw_configuration(libcamera::Camera& camera);

/// A libcamera camera, acquired. Its resources are released in the order that libcamera requires: requests, mappings,
/// buffers, configuration, camera, manager.
class LibcameraDevice final : public RequestDevice {
 public:
  LibcameraDevice(std::shared_ptr<libcamera::CameraManager> manager, std::shared_ptr<libcamera::Camera> camera);
  ~LibcameraDevice() override;
  LibcameraDevice(const LibcameraDevice&) = delete;
  LibcameraDevice& operator=(const LibcameraDevice&) = delete;

  /// These three functions are called once, in this order. Errors: as LibcameraModule::open.
  Result<void> acquire();
  Result<CameraFormat> configure(const CameraRequest& request, std::vector<std::string>& warnings);
  Result<int> allocate(const CameraRequest& request, std::vector<std::string>& warnings);
  std::shared_ptr<CompletionQueue> completions() const { return completions_; }

  int start() override;
  void stop() override;
  int queue(int buffer) override;
  std::span<const std::byte> bytes(int buffer) const override;
  bool begin_reading(int buffer) override;
  void end_reading(int buffer) override;
  Result<ExposureControls> take_exposure() override;
  void set_exposure(const CameraExposure& exposure) override;

 private:
  Result<void> add_buffer(int buffer);
  void request_completed(libcamera::Request* request);
  void disconnected();

  std::shared_ptr<libcamera::CameraManager> manager_;
  std::shared_ptr<libcamera::Camera> camera_;
  std::string name_;
  bool acquired_ = false;
  CameraFormat format_;
  CameraRequest request_;
  OfferedControls offered_;
  StartControls controls_;
  bool controls_are_due_ = false;  // to be set in the next request
  std::shared_ptr<CompletionQueue> completions_;
  std::unique_ptr<libcamera::CameraConfiguration> configuration_;
  std::unique_ptr<libcamera::FrameBufferAllocator> allocator_;
  std::vector<MappedPlane> planes_;
  std::vector<std::unique_ptr<libcamera::Request>> requests_;
};

}  // namespace lowlux::capture
