#include "capture/v4l2/v4l2_camera.h"

#include <linux/videodev2.h>
#include <poll.h>

#include <algorithm>
#include <cassert>
#include <cerrno>
#include <cstdint>
#include <string>
#include <utility>

#include "capture/file/pass_on.h"
#include "capture/v4l2/v4l2_exposure.h"
#include "isp/base/text.h"

namespace lowlux::capture {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

// A wait may continue after a device vanishes: the node is tested again after at most this time.
constexpr milliseconds longest_slice{500};
constexpr milliseconds max_wait = std::chrono::hours(24);
// Pause after a buffer that was announced but not available.
constexpr int pause_ms = 1;

// CameraFrame::buffer holds the index in the low bits and the start above.
constexpr int index_bits = 5;
constexpr int max_sessions = 1 << 20;

/// Returns the number of frames missing after `last`; 0 if the count repeats itself or goes back.
std::uint32_t lost_between(std::uint32_t last, std::uint32_t now) {
  const std::uint32_t step = now - last;  // modulo 2^32, as drivers count
  return step == 0 || step > std::uint32_t{1} << 31 ? 0 : step - 1;
}

tl::unexpected<Error> unsupported(const V4l2Device& device, const std::string& why) {
  return fail(ErrorCode::unsupported, "automatic exposure: " + why, device.path());
}

Result<V4l2Control> gain_for(V4l2Device& device, const std::vector<CameraGain>& codes) {
  const auto gain = find_gain(device);
  if (!gain || !gain->writable)
    return unsupported(device, "the driver has no control of its gain: leave the codes out");
  for (const CameraGain& one : codes) {
    if (one.code >= gain->minimum && one.code <= gain->maximum &&
        (std::int64_t{one.code} - gain->minimum) % gain->step == 0)
      continue;
    return fail(ErrorCode::invalid_argument,
                "gain code " + std::to_string(one.code) + " is not one of the driver's " + range_text(*gain) +
                    (gain->step > 1 ? " in steps of " + std::to_string(gain->step) : ""),
                device.path());
  }
  if (!end_automatic_gain(device)) return unsupported(device, "the driver's automatic gain cannot be switched off");
  return *gain;
}

}  // namespace

V4l2Camera::V4l2Camera(std::unique_ptr<V4l2Device> device, V4l2Agreement agreement, V4l2Options options)
    : device_(std::move(device)), agreement_(std::move(agreement)), options_(std::move(options)) {}

Result<void> V4l2Camera::start() {
  if (buffers_) return {};
  if (device_->gone()) return tl::make_unexpected(device_->disconnected_error());
  auto buffers =
      V4l2Buffers::request(*device_, options_.memory, options_.request.buffers, frame_bytes(agreement_.format));
  if (!buffers) return pass_on(buffers);
  if (auto unchanged = check_unchanged(); !unchanged) return unchanged;
  facts_ = read_facts(*device_, agreement_.format);
  if (auto started = (*buffers)->start_streaming(); !started) return started;
  buffers_ = *std::move(buffers);
  last_sequence_.reset();
  failure_.reset();
  session_ = (session_ + 1) % max_sessions;
  return {};
}

/// Checks that the format is unchanged. Once buffers are allocated no other program can change it; before that any can.
Result<void> V4l2Camera::check_unchanged() {
  auto now = read_layout(*device_);
  if (!now) return pass_on(now);
  if (*now == agreement_.layout) return {};
  return fail(ErrorCode::unreadable,
              "another program changed the format to " + format_text(now->fourcc) + " " + std::to_string(now->width) +
                  "x" + std::to_string(now->height) + ": end that program and open the camera again",
              device_->path());
}

void V4l2Camera::stop() { buffers_.reset(); }

std::optional<Error> V4l2Camera::not_ready() const {
  if (device_->gone()) return device_->disconnected_error();
  if (failure_) return failure_;
  if (!buffers_) return Error{ErrorCode::insufficient, "the camera delivers nothing before it is started", {}};
  if (buffers_->queued() == 0) {
    return Error{ErrorCode::insufficient,
                 "no frame can come: all " + std::to_string(buffers_->count()) +
                     " buffers are in use, give one back or ask for more",
                 device_->path()};
  }
  return std::nullopt;
}

Result<CameraFrame> V4l2Camera::next(milliseconds timeout) {
  if (auto error = not_ready()) return tl::make_unexpected(*std::move(error));
  const V4l2System& system = device_->system();
  const nanoseconds until = system.now(system.context) + nanoseconds(std::clamp(timeout, milliseconds(0), max_wait));
  short happened = 0;
  for (;;) {
    V4l2Taken taken;
    const int code = buffers_->take(taken);
    if (code == 0) return deliver(taken);
    if (code == EBADMSG) {
      return fail(ErrorCode::malformed, "the driver of " + name() + " delivers a buffer that it does not have",
                  device_->path());
    }
    if (code != EAGAIN) return tl::make_unexpected(device_->error(code, "the next frame cannot be read"));
    if ((happened & (POLLERR | POLLNVAL)) != 0) {
      return fail(ErrorCode::unreadable, "the driver of " + name() + " has stopped streaming: start the camera again",
                  device_->path());
    }
    const bool announced = (happened & POLLIN) != 0;
    if (auto error = wait(until, announced ? 0 : POLLIN, &happened)) return tl::make_unexpected(*std::move(error));
  }
}

/// Waits for `events`, or briefly for none, at most one slice. Returns an Error when the time is over or the device is
/// gone.
std::optional<Error> V4l2Camera::wait(nanoseconds until, short events, short* happened) {
  const V4l2System& system = device_->system();
  const nanoseconds left = until - system.now(system.context);
  if (left <= nanoseconds(0)) {
    return Error{ErrorCode::insufficient, "no frame came in time from " + name(), device_->path()};
  }
  const auto slice = std::min(std::chrono::ceil<milliseconds>(left), longest_slice);
  const int timeout_ms = events == 0 ? pause_ms : static_cast<int>(slice.count());
  *happened = 0;
  if (system.poll(system.context, device_->file(), events, timeout_ms, happened) < 0) {
    *happened = 0;
    const int code = errno;
    if (code != EINTR && code != EAGAIN) return device_->error(code, "waiting for a frame failed");
  }
  if ((*happened & POLLHUP) != 0) {
    device_->set_disconnected();
    return device_->disconnected_error();
  }
  return std::nullopt;
}

Result<CameraFrame> V4l2Camera::deliver(const V4l2Taken& taken) {
  if (auto error = contradiction(taken)) {
    requeue(taken.index);
    return tl::make_unexpected(*std::move(error));
  }
  if (const int code = buffers_->begin_access(taken.index)) {
    requeue(taken.index);
    return tl::make_unexpected(device_->error(code, "the DMA buffer of a frame cannot be made ready"));
  }
  const std::size_t whole = frame_bytes(agreement_.format);
  CameraFrame frame;
  frame.bytes = buffers_->bytes(taken.index).subspan(taken.data_offset, whole);
  frame.sequence = taken.sequence;
  frame.lost_before = last_sequence_ ? lost_between(*last_sequence_, taken.sequence) : 0;
  frame.timestamp = timestamp_of(taken);
  frame.damaged = (taken.flags & V4L2_BUF_FLAG_ERROR) != 0 || taken.bytes_used < taken.data_offset + whole;
  frame.facts = facts_;
  // Frames under way may have the setting before the last one.
  if (exposure_) frame.facts.exposure_s.reset();
  if (exposure_ && !exposure_->controls().gains.empty()) frame.facts.analogue_gain.reset();
  frame.buffer = session_ << index_bits | static_cast<int>(taken.index);
  last_sequence_ = taken.sequence;
  return frame;
}

/// Returns an error if the driver's description of a frame does not fit in its buffer.
std::optional<Error> V4l2Camera::contradiction(const V4l2Taken& taken) const {
  const std::size_t held = buffers_->bytes(taken.index).size();
  const std::size_t whole = frame_bytes(agreement_.format);
  if (taken.bytes_used <= held && taken.data_offset <= held - whole) return std::nullopt;
  return Error{ErrorCode::malformed,
               "the driver of " + name() + " says that " + std::to_string(taken.bytes_used) + " bytes, from byte " +
                   std::to_string(taken.data_offset) + " on, are in a buffer of " + std::to_string(held),
               device_->path()};
}

nanoseconds V4l2Camera::timestamp_of(const V4l2Taken& taken) {
  constexpr std::int64_t max_seconds = 9'000'000'000;  // limit of nanoseconds in 64 bits
  const bool monotonic = (taken.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  const bool sane =
      taken.seconds >= 0 && taken.seconds < max_seconds && taken.microseconds >= 0 && taken.microseconds < 1'000'000;
  if (monotonic && sane) return std::chrono::seconds(taken.seconds) + std::chrono::microseconds(taken.microseconds);
  if (!warned_of_clock_) {
    agreement_.warnings.emplace_back("the driver's timestamps are not of the monotonic clock: frames have none");
    warned_of_clock_ = true;
  }
  return nanoseconds(0);
}

void V4l2Camera::requeue(std::size_t index) {
  if (const int code = buffers_->queue(index)) {
    failure_ = device_->error(code, "the driver does not take its buffer back");
  }
}

void V4l2Camera::return_buffer(const CameraFrame& frame) {
  if (!buffers_ || frame.buffer < 0 || frame.buffer >> index_bits != session_) return;
  const auto index = static_cast<std::size_t>(frame.buffer & ((1 << index_bits) - 1));
  if (index >= buffers_->count() || buffers_->is_queued(index)) return;
  if (const int code = buffers_->end_access(index)) {
    failure_ = device_->error(code, "the DMA buffer of a frame cannot be handed back");
  }
  requeue(index);
}

Result<ExposureControls> V4l2Camera::take_exposure() {
  auto taken = V4l2AutoExposure::take(*device_, options_, agreement_.format);
  if (!taken) return pass_on(taken);
  exposure_ = *std::move(taken);
  return exposure_->controls();
}

Result<double> V4l2Camera::set_exposure(const CameraExposure& exposure) {
  assert(exposure_);
  return exposure_->set(*device_, exposure);
}

Result<V4l2AutoExposure> V4l2AutoExposure::take(V4l2Device& device, const V4l2Options& options,
                                                const CameraFormat& format) {
  const bool stays = end_automatic_exposure(device);
  V4l2AutoExposure out;
  const auto time = find_exposure_time(device, format);
  if (device.gone()) return tl::make_unexpected(device.disconnected_error());
  if (!time || !time->control.writable) {
    return unsupported(device, "the driver has no control of the exposure time whose unit is known");
  }
  if (!stays) return unsupported(device, "the driver's own cannot be switched off");
  out.time_ = *time;
  const double unit_s = time->unit_s;
  const int first = std::max(time->control.minimum, time->control.minimum > 0 ? 0 : time->control.step);
  out.controls_.min_s = first * unit_s;
  out.controls_.max_s = time->max_s();
  out.controls_.step_s = time->control.step * unit_s;
  if (!(out.controls_.max_s >= out.controls_.min_s)) {
    return unsupported(device, "the driver states exposure times of " + range_text(time->control));
  }
  if (options.gain_codes.empty()) return out;
  auto gain = gain_for(device, options.gain_codes);
  if (!gain) return pass_on(gain);
  out.gain_ = *gain;
  out.controls_.gains = options.gain_codes;
  return out;
}

Result<double> V4l2AutoExposure::set(V4l2Device& device, const CameraExposure& exposure) {
  if (gain_ && exposure.gain && exposure.gain->code != code_) {
    const int wanted = exposure.gain->code;
    auto set = write_control(device, *gain_, wanted);
    if (!set) return pass_on(set);
    if (*set != wanted) {
      return unsupported(device, "the driver sets gain code " + std::to_string(*set) + " where " +
                                     std::to_string(wanted) + " was asked for: leave that code out");
    }
    code_ = wanted;
  }
  auto set_s = set_exposure_time(device, time_, exposure.exposure_s);
  if (set_s && *set_s <= 0)
    return unsupported(device, "the driver sets an exposure time of " + number_text(*set_s) + " s");
  return set_s;
}

}  // namespace lowlux::capture
