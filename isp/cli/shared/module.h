#pragma once

#include <filesystem>
#include <string>

#include "calib/chart/chart_detector.h"
#include "capture/libcamera/libcamera_module.h"
#include "isp/base/result.h"
#include "isp/bench/peers/nl_means.h"

namespace lowlux::cli {

/// Returns the folder of the running command. Error: unreadable, where /proc is not mounted.
Result<std::filesystem::path> command_folder();

/// Returns the folder of test pictures: `given`, or if that is empty, `pictures` next to the command, which its build
/// makes.
std::string pictures_folder(const std::string& given);

/// Describes a part of the command that is loaded on demand, because of the libraries it depends on.
struct Module {
  std::string file;      // liblowlux_....so
  std::string function;  // exported by it, extern "C"
  std::string purpose;   // "finding charts"
  std::string needs;     // "OpenCV's mcc module (Debian: ...)"
};

/// Returns the address of the module's function. The module is searched for in the command's folder, then in the
/// installation's library folder, then next to lowlux's library, which Python loads; it stays loaded.
/// Errors: unreadable, with the loader's message (a library is not installed, the file is missing), or that the module
/// is of another build: it carries the version and a hash of all headers, the compiler and its flags, which must be
/// those of the command.
Result<void*> load_module(const Module& module);

/// Returns the chart detector, loaded once from liblowlux_chart.so in the command's folder or the installation's
/// library folder; it stays loaded. OpenCV is loaded only when a chart is searched for (calib/chart/chart_detector.h).
/// Errors: unreadable, with the loader's message (OpenCV's mcc is not installed, the file is missing).
Result<calib::DetectCharts*> load_chart_detector();

/// Returns libcamera's cameras, loaded from liblowlux_libcamera.so; see module.h. libcamera is loaded only when a
/// camera is opened (capture/libcamera/libcamera_module.h).
/// Errors: unreadable, as load_module(); also where lowlux was built without libcamera.
Result<capture::LibcameraModule> load_libcamera();

/// Returns OpenCV's non-local means, loaded from liblowlux_nlm.so (isp/bench/peers). Errors: as load_module().
Result<const isp::NlMeans*> load_nl_means();

}  // namespace lowlux::cli
