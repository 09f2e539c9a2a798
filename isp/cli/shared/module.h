#pragma once

#include <filesystem>
#include <string>

#include "calib/chart/chart_detector.h"
#include "capture/libcamera/libcamera_module.h"
#include "isp/base/result.h"

namespace lowlux::cli {

/// The folder of the running command. Error: unreadable, where /proc is not mounted.
Result<std::filesystem::path> command_folder();

/// The folder of test pictures: `given`, or if that is empty, `pictures` next to the command, which its build makes.
std::string pictures_folder(const std::string& given);

/// A part of the command that is loaded only by what needs it, because of the libraries that come with it.
struct Module {
  std::string file;      // liblowlux_....so
  std::string function;  // exported by it, extern "C"
  std::string purpose;   // "finding charts"
  std::string needs;     // "OpenCV's mcc module (Debian: ...)"
};

/// The address of its function. The module is looked for in the command's folder, then in the installation's library
/// folder; it stays loaded.
/// Errors: unreadable, with what the loader says (a library is not installed, the file is missing), or that the module
/// is of another build: it carries the version and a hash of all headers, the compiler and its flags, which must be
/// those of the command.
Result<void*> load_module(const Module& module);

/// The chart detector, loaded from liblowlux_chart.so beside the command or in the installation's library folder, once;
/// it stays. Only who looks for a chart pays for OpenCV (calib/chart/chart_detector.h).
/// Errors: unreadable, with what the loader says (OpenCV's mcc is not installed, the file is missing).
Result<calib::DetectCharts*> load_chart_detector();

/// libcamera's cameras, loaded from liblowlux_libcamera.so; see module.h. Only who opens a camera pays for libcamera
/// (capture/libcamera/libcamera_module.h).
/// Errors: unreadable, as load_module(); so too where lowlux was built without libcamera.
Result<capture::LibcameraModule> load_libcamera();

}  // namespace lowlux::cli
