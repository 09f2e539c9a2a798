#include "capture/libcamera/request_camera.h"

#include <algorithm>
#include <cassert>
#include <cerrno>
#include <system_error>
#include <utility>

#include "capture/libcamera/raw_stream.h"

namespace lowlux::capture {
namespace {

using std::chrono::milliseconds;

/// Limited so that its sum with the clock does not overflow.
constexpr milliseconds longest_timeout = std::chrono::hours(24);
/// Waiting time for the reason: a camera that is unplugged may cancel its requests first.
constexpr milliseconds patience_after_cancel{200};

}  // namespace

Error device_error(int negative_errno, const std::string& doing, const std::string& camera) {
  const int code = -negative_errno;
  if (code == ENODEV || code == ENXIO)
    return {ErrorCode::not_found, "the camera is no longer available: was it unplugged?", camera};
  if (code == EBUSY) {
    return {ErrorCode::unreadable, "cannot " + doing + " the camera: another program uses it", camera};
  }
  return {ErrorCode::unreadable, "cannot " + doing + " the camera: " + std::generic_category().message(code), camera};
}

RequestCamera::RequestCamera(OpenRequestDevice open)
    : open_(std::move(open)), lent_(static_cast<std::size_t>(open_.buffers)) {
  assert(open_.device && open_.completions && open_.buffers > 0);
}

RequestCamera::~RequestCamera() { stop(); }

Error RequestCamera::gone() const { return device_error(-ENODEV, "read from", open_.name); }

Error RequestCamera::frame_timeout_error(milliseconds timeout) const {
  const auto lent = std::count_if(lent_.begin(), lent_.end(), [](const auto& stamp) { return stamp.has_value(); });
  const std::string held =
      lent == open_.buffers ? ": all " + std::to_string(lent) + " buffers are lent, give one back" : "";
  return {ErrorCode::insufficient, "no frame came within " + std::to_string(timeout.count()) + " ms" + held,
          open_.name};
}

Error RequestCamera::cancelled() {
  if (open_.completions->wait_disconnected(std::chrono::steady_clock::now() + patience_after_cancel)) return gone();
  return {ErrorCode::unreadable, "the camera ended the stream: start it again", open_.name};
}

Result<void> RequestCamera::start() {
  if (streaming_) return {};
  if (open_.completions->is_disconnected()) return tl::make_unexpected(gone());
  open_.completions->clear();
  last_sequence_.reset();
  failed_ = 0;
  if (const int result = open_.device->start(); result < 0) {
    return tl::make_unexpected(device_error(result, "start", open_.name));
  }
  streaming_ = true;
  for (int buffer = 0; buffer < open_.buffers && failed_ == 0; ++buffer) queue(buffer);
  if (failed_ == 0) return {};
  const Error error = device_error(failed_, "give a buffer to", open_.name);
  stop();
  return tl::make_unexpected(error);
}

void RequestCamera::queue(int buffer) {
  const int result = open_.device->queue(buffer);
  if (result < 0) failed_ = result;
  if (result == -ENODEV) open_.completions->set_disconnected();
}

Result<CameraFrame> RequestCamera::next(milliseconds timeout) {
  assert(streaming_);
  const milliseconds wait = std::clamp(timeout, milliseconds(0), longest_timeout);
  const auto deadline = std::chrono::steady_clock::now() + wait;
  for (;;) {
    const auto completion = open_.completions->take(deadline);
    if (!completion) {
      if (open_.completions->is_disconnected()) return tl::make_unexpected(gone());
      if (failed_ != 0) return tl::make_unexpected(device_error(failed_, "give a buffer to", open_.name));
      return tl::make_unexpected(frame_timeout_error(wait));
    }
    if (completion->state == CompletionState::cancelled) return tl::make_unexpected(cancelled());
    if (completion->state != CompletionState::startup) return lend(*completion);
    last_sequence_ = completion->sequence;
    queue(completion->buffer);
    if (std::chrono::steady_clock::now() >= deadline) return tl::make_unexpected(frame_timeout_error(wait));
  }
}

std::uint32_t RequestCamera::lost_before(std::uint32_t sequence) {
  // Counters wrap around; one that repeats or jumps back does not indicate lost frames.
  const std::uint32_t step = last_sequence_ ? sequence - *last_sequence_ : 1;
  last_sequence_ = sequence;
  return step == 0 || step >= 0x80000000U ? 0 : step - 1;
}

CameraFrame RequestCamera::lend(const Completion& completion) {
  const std::size_t needed = frame_bytes(open_.format);
  const bool readable = open_.device->begin_reading(completion.buffer);
  lent_[static_cast<std::size_t>(completion.buffer)] = completion.timestamp;
  return {.bytes = open_.device->bytes(completion.buffer).first(needed),
          .sequence = completion.sequence,
          .lost_before = lost_before(completion.sequence),
          .timestamp = completion.timestamp,
          .damaged = !readable || completion.state == CompletionState::damaged || completion.bytes_used < needed,
          .facts = completion.facts,
          .buffer = completion.buffer};
}

void RequestCamera::return_buffer(const CameraFrame& frame) {
  if (frame.buffer < 0 || frame.buffer >= open_.buffers) return;
  auto& lent = lent_[static_cast<std::size_t>(frame.buffer)];
  if (lent != frame.timestamp) return;  // of a stream that has ended, or given back twice
  lent.reset();
  open_.device->end_reading(frame.buffer);
  queue(frame.buffer);
}

void RequestCamera::stop() {
  if (!streaming_) return;
  streaming_ = false;
  open_.device->stop();
  for (int buffer = 0; buffer < open_.buffers; ++buffer) {
    auto& lent = lent_[static_cast<std::size_t>(buffer)];
    if (lent) open_.device->end_reading(buffer);
    lent.reset();
  }
  open_.completions->clear();
}

Result<ExposureControls> RequestCamera::take_exposure() {
  auto controls = open_.device->take_exposure();
  if (!controls) controls.error().where = open_.name;
  return controls;
}

Result<double> RequestCamera::set_exposure(const CameraExposure& exposure) {
  if (open_.completions->is_disconnected()) return tl::make_unexpected(gone());
  open_.device->set_exposure(exposure);
  return exposure.exposure_s;
}

}  // namespace lowlux::capture
