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

/// Summarises the work done on frames so far.
struct CaptureWork {
  double process_s = 0;  // reading a frame's memory and making an image of it
  double write_s = 0;
  std::optional<std::array<std::uint64_t, 5>> steps;  // frames at each LOWLUX_STAGE_STEP; none: without a budget
  std::vector<std::string> files;
  std::vector<std::string> warnings;  // each once
};

/// Stores a warning that was not stored before.
void warn_once(std::string warning, CaptureWork& work);

/// Processes a camera's frames, one after the other.
class CaptureSink {
 public:
  virtual ~CaptureSink() = default;
  /// Takes a frame. Returns false when no more are wanted. Errors name the file concerned.
  virtual Result<bool> take(const capture::CameraFrame& frame, CaptureWork& work) = 0;
};

/// Properties of the stream of frames. Sinks outlive it, and copy it.
struct CaptureStream {
  capture::CameraFormat format;
  std::string camera;  // its name
};

/// Makes a sink for image files, each developed as `develop` would from the raw file of the same frame. Errors: those
/// of the profile and of options that are not valid for the format (invalid_argument, before any camera is needed).
Result<std::unique_ptr<CaptureSink>> make_picture_sink(const CaptureArgs& args, const CaptureStream& stream,
                                                       Executor& executor);

/// Makes a sink for raw files (DNG).
std::unique_ptr<CaptureSink> make_raw_sink(const CaptureArgs& args, const CaptureStream& stream);

/// Makes a sink for a video on the file descriptor `out`, through the stage of lowlux_stage.h. It ends when the reader
/// closes the descriptor.
/// Errors: those of the stage.
Result<std::unique_ptr<CaptureSink>> make_live_sink(const CaptureArgs& args, const CaptureStream& stream, int out,
                                                    const std::atomic<bool>& stop);

}  // namespace lowlux::cli
