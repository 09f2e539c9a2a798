#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "capture/camera/camera.h"
#include "capture/camera/capture_loop.h"
#include "capture/v4l2/v4l2_source.h"
#include "isp/cli/capture/exposure_args.h"
#include "isp/cli/develop/develop_args.h"

namespace lowlux::cli {

/// Names the output made of the frames.
enum class CaptureKind : std::uint8_t { pictures, raw, live };

/// Holds the arguments of `capture`, checked as far as that is possible without a camera.
struct CaptureArgs {
  DevelopArgs develop;  // output, force, quiet, json, and options of images
  bool list = false;
  std::string v4l2;       // device; empty: libcamera
  std::string libcamera;  // id, index in the list, or part of a name
  capture::CameraRequest request;
  capture::V4l2Memory memory = capture::V4l2Memory::mmap;
  std::optional<int> gain_code;
  AutoExposureArgs auto_exposure;
  capture::LoopLimits limits;
  CaptureKind kind = CaptureKind::pictures;
  std::string extension;  // extension of files in a folder, without dot
  bool folder = false;    // develop.output is a folder
  bool temporal = false;
  std::optional<double> budget_ms;  // for each frame of a video
};

Parsed<CaptureArgs> parse_capture(const std::vector<std::string>& words);

/// Returns the name of frame `index`, from 1: the output itself for a single frame, else with -NNNN before its
/// extension; in a folder frame-NNNN.
std::string frame_file(const CaptureArgs& args, std::uint64_t index);

}  // namespace lowlux::cli
