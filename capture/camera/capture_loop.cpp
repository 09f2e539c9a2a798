#include "capture/camera/capture_loop.h"

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <utility>

#include "isp/base/text.h"

namespace lowlux::capture {
namespace {

using std::chrono::steady_clock;

constexpr std::chrono::milliseconds longest_wait{100};

double seconds_between(steady_clock::time_point from, steady_clock::time_point to) {
  return std::chrono::duration<double>(to - from).count();
}

/// A running camera, which stops when this goes out of scope.
class Running {
 public:
  explicit Running(Camera& camera) : camera_(camera) {}
  ~Running() { camera_.stop(); }
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;

 private:
  Camera& camera_;
};

class Loop {
 public:
  Loop(Camera& camera, const LoopLimits& limits, const std::atomic<bool>& stop, LoopCount& count)
      : camera_(camera), limits_(limits), stop_(stop), count_(count) {}

  Result<void> run(const FrameCheck& check, const FrameWork& work, const LoopWatch& watch) {
    last_whole_ = steady_clock::now();
    for (bool wanted = true; wanted;) {
      if (stop_) {
        count_.stopped = true;
        return {};
      }
      auto frame = wait();
      if (!frame) return tl::make_unexpected(frame.error());
      if (*frame) {
        const Result<bool> more = take(**frame, check, work);
        camera_.return_buffer(**frame);
        if (!more) return tl::make_unexpected(more.error());
        wanted = *more;
      }
      watch(count_);
    }
    count_.stopped = stop_;
    return {};
  }

 private:
  /// Returns a frame, or nullopt if none came within a tenth of a second and time is left.
  Result<std::optional<CameraFrame>> wait() {
    const auto start = steady_clock::now();
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(last_whole_ + limits_.timeout - start);
    Result<CameraFrame> frame = camera_.next(std::clamp(left, std::chrono::milliseconds(0), longest_wait));
    const auto now = steady_clock::now();
    if (first_) {
      count_.wait_s += seconds_between(start, now);
      count_.seconds = seconds_between(*first_, now);
    }
    if (frame) {
      if (!first_) first_ = now;
      count_.lost += frame->lost_before;
      if (frame->damaged) ++count_.damaged;
      return std::optional(*std::move(frame));
    }
    if (frame.error().code != ErrorCode::insufficient) return tl::make_unexpected(frame.error());
    if (now - last_whole_ < limits_.timeout) return std::nullopt;
    return tl::make_unexpected(frame_timeout_error(frame.error()));
  }

  Error frame_timeout_error(const Error& last) const {
    const std::string limit_s = number_text(std::chrono::duration<double>(limits_.timeout).count());
    std::string text = count_.damaged > 0 ? "no whole frame" : "no frame";
    text += " came within " + limit_s + " s: " + last.message;
    if (count_.damaged > 0) text += ", " + std::to_string(count_.damaged) + " were damaged";
    return {ErrorCode::insufficient, text + "; --timeout allows for longer exposures", last.where};
  }

  Result<bool> take(CameraFrame& frame, const FrameCheck& check, const FrameWork& work) {
    if (frame.damaged) {
      const bool late = steady_clock::now() - last_whole_ >= limits_.timeout;
      if (!late) return true;
      return tl::make_unexpected(
          frame_timeout_error({ErrorCode::insufficient, "the device reports that its frames are damaged", {}}));
    }
    Result<bool> good = check ? check(frame) : Result<bool>(true);
    if (!good) return good;
    Result<bool> more = true;
    if (!*good || count_.skipped < limits_.skip) {
      ++count_.skipped;
    } else {
      more = work(frame);
      if (more && *more) ++count_.taken;
    }
    last_whole_ = steady_clock::now();
    count_.seconds = seconds_between(*first_, last_whole_);
    const bool all = limits_.frames > 0 && count_.taken == limits_.frames;
    return more.map([&](bool wanted) { return wanted && !all; });
  }

  Camera& camera_;
  const LoopLimits& limits_;
  const std::atomic<bool>& stop_;
  LoopCount& count_;
  std::optional<steady_clock::time_point> first_;
  steady_clock::time_point last_whole_;  // or time of the start
};

}  // namespace

Result<void> capture_frames(Camera& camera, const LoopLimits& limits, const std::atomic<bool>& stop,
                            const FrameWork& work, const LoopWatch& watch, LoopCount& count, const FrameCheck& check) {
  const Running running(camera);
  if (auto started = camera.start(); !started) return started;
  return Loop(camera, limits, stop, count).run(check, work, watch);
}

}  // namespace lowlux::capture
