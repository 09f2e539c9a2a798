#include "capture/libcamera/libcamera_device.h"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <mutex>
#include <utility>

#include <libcamera/camera.h>
#include <libcamera/camera_manager.h>
#include <libcamera/control_ids.h>
#include <libcamera/framebuffer_allocator.h>
#include <libcamera/logging.h>
#include <libcamera/property_ids.h>
#include <libcamera/request.h>

#include "capture/libcamera/libcamera_facts.h"
#include "capture/libcamera/libcamera_values.h"

namespace lowlux::capture {
namespace {

/// The shared manager: libcamera ends the process when a second one is made, so all cameras use one.
struct SharedManager {
  std::mutex mutex;
  std::unique_ptr<libcamera::CameraManager> manager;
  int uses = 0;
};

SharedManager& shared_manager() {
  static SharedManager shared;
  return shared;
}

void leave_manager(libcamera::CameraManager* /*manager*/) {
  SharedManager& shared = shared_manager();
  const std::lock_guard lock(shared.mutex);
  if (--shared.uses > 0) return;
  shared.manager->stop();
  shared.manager.reset();
}

/// Silences libcamera's log on standard error, unless its own environment variables request it.
void silence_log() {
  // NOLINTNEXTLINE(concurrency-mt-unsafe): nothing here sets variables
  if (std::getenv("LIBCAMERA_LOG_LEVELS") == nullptr && std::getenv("LIBCAMERA_LOG_FILE") == nullptr) {
    libcamera::logSetTarget(libcamera::LoggingTargetNone);
  }
}

void add_size(const libcamera::Size& size, std::vector<FrameSize>& sizes) {
  if (size.width < 1 || size.height < 1 || size.width > 65535 || size.height > 65535) return;
  const FrameSize added{static_cast<int>(size.width), static_cast<int>(size.height)};
  if (std::find(sizes.begin(), sizes.end(), added) == sizes.end()) sizes.push_back(added);
}

OfferedStream offered_stream(const libcamera::PixelFormat& format) {
  return {.drm_fourcc = format.fourcc(), .drm_modifier = format.modifier(), .sizes = {}};
}

/// Converts exceptions of libcamera's calls, for lack of memory, to an errno; its own errors are integers.
template <class Work>
int without_exceptions(const Work& work) noexcept {
  try {
    return work();
  } catch (...) {
    return -ENOMEM;
  }
}

}  // namespace

Result<std::shared_ptr<libcamera::CameraManager>> libcamera_manager() {
  SharedManager& shared = shared_manager();
  const std::lock_guard lock(shared.mutex);
  if (!shared.manager) {
    silence_log();
    auto manager = std::make_unique<libcamera::CameraManager>();
    if (const int result = manager->start(); result < 0) {
      return tl::make_unexpected(device_error(result, "look for", "libcamera"));
    }
    shared.manager = std::move(manager);
  }
  ++shared.uses;
  return std::shared_ptr<libcamera::CameraManager>(shared.manager.get(), leave_manager);
}

std::string libcamera_name(const libcamera::Camera& camera) {
  const auto model = camera.properties().get(libcamera::properties::Model);
  return model ? std::string(*model) : camera.id();
}

std::unique_ptr<libcamera::CameraConfiguration> raw_configuration(libcamera::Camera& camera) {
  auto configuration = camera.generateConfiguration({libcamera::StreamRole::Raw});
  if (configuration && configuration->empty()) configuration.reset();
  return configuration;
}

std::vector<OfferedStream> offered_streams(const libcamera::CameraConfiguration* configuration) {
  std::vector<OfferedStream> offered;
  if (configuration == nullptr) return offered;
  const libcamera::StreamConfiguration& stream = configuration->at(0);
  for (const auto& format : stream.formats().pixelformats()) {
    OfferedStream one = offered_stream(format);
    for (const auto& size : stream.formats().sizes(format)) add_size(size, one.sizes);
    add_size(stream.formats().range(format).max, one.sizes);
    offered.push_back(std::move(one));  // NOLINT(performance-inefficient-vector-operation): a handful
  }
  const bool listed = std::any_of(offered.begin(), offered.end(), [&](const OfferedStream& one) {
    return one.drm_fourcc == stream.pixelFormat.fourcc() && one.drm_modifier == stream.pixelFormat.modifier();
  });
  if (!listed) {
    offered.push_back(offered_stream(stream.pixelFormat));
    add_size(stream.size, offered.back().sizes);
  }
  return offered;
}

LibcameraDevice::LibcameraDevice(std::shared_ptr<libcamera::CameraManager> manager,
                                 std::shared_ptr<libcamera::Camera> camera)
    : manager_(std::move(manager)), camera_(std::move(camera)), name_(libcamera_name(*camera_)) {}

LibcameraDevice::~LibcameraDevice() {
  if (!acquired_) return;
  camera_->requestCompleted.disconnect(this);
  camera_->disconnected.disconnect(this);
  requests_.clear();
  planes_.clear();
  allocator_.reset();
  configuration_.reset();
  camera_->release();
}

Result<void> LibcameraDevice::acquire() {
  if (const int result = camera_->acquire(); result < 0) {
    return tl::make_unexpected(device_error(result, "open", name_));
  }
  acquired_ = true;
  return {};
}

Result<CameraFormat> LibcameraDevice::configure(const CameraRequest& request, std::vector<std::string>& warnings) {
  configuration_ = raw_configuration(*camera_);
  const auto choice = choose_raw_stream(offered_streams(configuration_.get()), request, name_);
  if (!choice) return tl::make_unexpected(choice.error());
  libcamera::StreamConfiguration& stream = configuration_->at(0);
  stream.pixelFormat = libcamera::PixelFormat(choice->drm_fourcc, choice->drm_modifier);
  if (choice->size != FrameSize{}) {
    stream.size = {static_cast<unsigned>(choice->size.width), static_cast<unsigned>(choice->size.height)};
  }
  stream.bufferCount = static_cast<unsigned>(request.buffers);
  set_flips(request, *configuration_);
  if (configuration_->validate() == libcamera::CameraConfiguration::Invalid) {
    return fail(ErrorCode::unsupported, "libcamera has no valid configuration for a raw stream alone", name_);
  }
  if (!has_flips(request, *configuration_)) {
    warnings.emplace_back("the camera does not support the requested flip: the image is as the sensor reads it");
  }
  const AgreedStream agreed{.drm_fourcc = stream.pixelFormat.fourcc(),
                            .drm_modifier = stream.pixelFormat.modifier(),
                            .width = stream.size.width,
                            .height = stream.size.height,
                            .stride_bytes = stream.stride,
                            .frame_bytes = stream.frameSize,
                            .buffers = stream.bufferCount};
  auto format = agreed_format(agreed, *choice, request, warnings);
  if (!format) {
    format.error().where = name_;
    return format;
  }
  if (const int result = camera_->configure(configuration_.get()); result < 0) {
    return tl::make_unexpected(device_error(result, "configure", name_));
  }
  format_ = *format;
  return format;
}

Result<int> LibcameraDevice::allocate(const CameraRequest& request, std::vector<std::string>& warnings) {
  allocator_ = std::make_unique<libcamera::FrameBufferAllocator>(camera_);
  const int count = allocator_->allocate(configuration_->at(0).stream());
  if (count < 0) return tl::make_unexpected(device_error(count, "get buffers of", name_));
  if (count < 1 || count > 64) {
    return fail(ErrorCode::unreadable, "the camera has " + std::to_string(count) + " buffers, not 1 to 64", name_);
  }
  completions_ = std::make_shared<CompletionQueue>(count);
  for (int buffer = 0; buffer < count; ++buffer) {
    if (auto added = add_buffer(buffer); !added) {
      added.error().where = name_;
      return tl::make_unexpected(added.error());
    }
  }
  request_ = request;
  offered_ = offered_controls(camera_->controls());
  controls_ = start_controls(request_, offered_);
  warnings.insert(warnings.end(), controls_.warnings.begin(), controls_.warnings.end());
  camera_->requestCompleted.connect(this, &LibcameraDevice::request_completed);
  camera_->disconnected.connect(this, &LibcameraDevice::disconnected);
  return count;
}

Result<void> LibcameraDevice::add_buffer(int buffer) {
  libcamera::Stream* stream = configuration_->at(0).stream();
  const auto& frame_buffer = allocator_->buffers(stream)[static_cast<std::size_t>(buffer)];
  if (frame_buffer->planes().empty()) return fail(ErrorCode::malformed, "a buffer of the camera has no memory");
  const auto& plane = frame_buffer->planes()[0];
  auto mapped = MappedPlane::map({.fd = plane.fd.get(), .offset = plane.offset, .length = plane.length});
  if (!mapped) return tl::make_unexpected(mapped.error());
  if (mapped->bytes().size() < frame_bytes(format_)) {
    return fail(ErrorCode::malformed, "a buffer of the camera has " + std::to_string(mapped->bytes().size()) +
                                          " bytes in its first plane, a frame takes " +
                                          std::to_string(frame_bytes(format_)));
  }
  auto request = camera_->createRequest(static_cast<std::uint64_t>(buffer));
  if (!request || request->addBuffer(stream, frame_buffer.get()) < 0) {
    return fail(ErrorCode::unreadable, "libcamera cannot create a request for a buffer of the camera");
  }
  planes_.push_back(std::move(*mapped));
  requests_.push_back(std::move(request));
  return {};
}

int LibcameraDevice::start() {
  return without_exceptions([&] {
    libcamera::ControlList list(libcamera::controls::controls);
    add_controls(controls_, list);
    controls_are_due_ = true;
    return camera_->start(&list);
  });
}

void LibcameraDevice::stop() {
  without_exceptions([&] { return camera_->stop(); });
}

int LibcameraDevice::queue(int buffer) {
  return without_exceptions([&] {
    libcamera::Request& request = *requests_[static_cast<std::size_t>(buffer)];
    request.reuse(libcamera::Request::ReuseBuffers);
    // Most pipelines ignore the controls given at the start of a stream, and apply those of its first request.
    if (std::exchange(controls_are_due_, false)) add_controls(controls_, request.controls());
    return camera_->queueRequest(&request);
  });
}

std::span<const std::byte> LibcameraDevice::bytes(int buffer) const {
  return planes_[static_cast<std::size_t>(buffer)].bytes();
}

bool LibcameraDevice::begin_reading(int buffer) { return planes_[static_cast<std::size_t>(buffer)].begin_reading(); }

void LibcameraDevice::end_reading(int buffer) { planes_[static_cast<std::size_t>(buffer)].end_reading(); }

Result<ExposureControls> LibcameraDevice::take_exposure() { return exposure_controls(request_, offered_); }

void LibcameraDevice::set_exposure(const CameraExposure& exposure) {
  controls_ = exposure_settings(request_, exposure, offered_);
  controls_are_due_ = true;
}

void LibcameraDevice::request_completed(libcamera::Request* request) {
  Completion completion{.buffer = static_cast<int>(request->cookie()), .state = CompletionState::cancelled};
  if (request->status() == libcamera::Request::RequestComplete && !request->buffers().empty()) {
    const libcamera::FrameMetadata& frame = request->buffers().begin()->second->metadata();
    completion.state = completion_state(static_cast<int>(frame.status));
    completion.sequence = frame.sequence;
    completion.timestamp = std::chrono::nanoseconds(frame.timestamp);
    if (!frame.planes().empty()) completion.bytes_used = frame.planes()[0].bytesused;
    completion.facts = frame_facts(libcamera_values(request->metadata()), format_.raw.bits);
  }
  completions_->push(completion);
}

void LibcameraDevice::disconnected() { completions_->set_disconnected(); }

}  // namespace lowlux::capture
