#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/camera/camera.h"
#include "isp/base/executor.h"
#include "isp/base/result.h"
#include "isp/cli/capture/capture_args.h"

namespace lowlux::cli {

/// What frames were turned into so far.
struct CaptureWork {
  double process_s = 0;  // reading a frame's memory and making a picture of it
  double write_s = 0;
  std::optional<std::array<std::uint64_t, 5>> steps;  // frames at each LOWLUX_STAGE_STEP; none: without a budget
  std::vector<std::string> files;
  std::vector<std::string> warnings;  // each once
};

/// Keeps a warning that was not given before.
void warn_once(std::string warning, CaptureWork& work);

/// What takes a camera's frames, one after the other.
class CaptureSink {
 public:
  virtual ~CaptureSink() = default;
  /// false: no more are wanted. Errors name the file concerned.
  virtual Result<bool> take(const capture::CameraFrame& frame, CaptureWork& work) = 0;
};

/// What is known of the frames to come. Outlived by what it is given to.
struct CaptureStream {
  capture::CameraFormat format;
  std::string camera;  // its name
};

/// Picture files, each made as `develop` makes it of the raw file of the same frame. Errors: those of the profile and
/// of options that do not go with the format (invalid_argument, before any camera is needed).
Result<std::unique_ptr<CaptureSink>> make_picture_sink(const CaptureArgs& args, const CaptureStream& stream,
                                                       Executor& executor);

/// Raw files (DNG).
std::unique_ptr<CaptureSink> make_raw_sink(const CaptureArgs& args, const CaptureStream& stream);

/// A film on the file descriptor `out`, through the stage of lowlux_stage.h. A reader that leaves ends it.
/// Errors: those of the stage.
Result<std::unique_ptr<CaptureSink>> make_live_sink(const CaptureArgs& args, const CaptureStream& stream, int out,
                                                    const std::atomic<bool>& stop);

}  // namespace lowlux::cli
