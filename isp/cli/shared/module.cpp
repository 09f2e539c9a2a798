#include "isp/cli/shared/module.h"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <system_error>

#include <dlfcn.h>
#include <fmt/format.h>

extern "C" const char lowlux_module_stamp[];

namespace lowlux::cli {
namespace {

/// Returns the function of an open module; nullptr if the module was not built with this command.
void* function_of(void* loaded, const Module& module) {
  const void* stamp = dlsym(loaded, "lowlux_module_stamp");
  const bool ours = stamp != nullptr && std::strcmp(static_cast<const char*>(stamp), lowlux_module_stamp) == 0;
  return ours ? dlsym(loaded, module.function.c_str()) : nullptr;
}

}  // namespace

Result<std::filesystem::path> command_folder() {
  std::error_code failed;
  const std::filesystem::path command = std::filesystem::read_symlink("/proc/self/exe", failed);
  if (failed) return fail(ErrorCode::unreadable, "cannot find the folder of the command: is /proc mounted?");
  return command.parent_path();
}

std::string pictures_folder(const std::string& given) {
  const auto folder = command_folder();
  return given.empty() && folder ? (*folder / "pictures").string() : given;
}

Result<void*> load_module(const Module& module) {
  const auto folder = command_folder();
  if (!folder) return tl::make_unexpected(folder.error());
  std::string said;
  for (const std::filesystem::path& place : {*folder, *folder / LOWLUX_MODULE_FOLDER}) {
    void* loaded = dlopen((place / module.file).c_str(), RTLD_NOW | RTLD_LOCAL);
    if (loaded == nullptr) {
      const char* reason = dlerror();  // NOLINT(concurrency-mt-unsafe): glibc keeps one for each thread
      said += fmt::format("{}{}", said.empty() ? "" : "; ", reason != nullptr ? reason : "no reason given");
      continue;
    }
    if (void* found = function_of(loaded, module); found != nullptr) return found;
    dlclose(loaded);
    said += fmt::format("{}{} is of another build of lowlux: build or install it again", said.empty() ? "" : "; ",
                        (place / module.file).string());
  }
  std::replace(said.begin(), said.end(), '\n', ' ');
  return fail(ErrorCode::unreadable,
              fmt::format("{} needs {} and {}: {}", module.purpose, module.file, module.needs, said));
}

Result<calib::DetectCharts*> load_chart_detector() {
  const auto found = load_module({.file = "liblowlux_chart.so",
                                  .function = calib::detect_charts_name,
                                  .purpose = "finding charts",
                                  .needs = "OpenCV's mcc module (Debian: libopencv-contrib-dev)"});
  if (!found) return tl::make_unexpected(found.error());
  return reinterpret_cast<calib::DetectCharts*>(*found);
}

Result<capture::LibcameraModule> load_libcamera() {
  const auto found = load_module({.file = "liblowlux_libcamera.so",
                                  .function = capture::libcamera_module_name,
                                  .purpose = "libcamera's cameras",
                                  .needs = "the libcamera it was built with (Debian: libcamera-dev)"});
  if (!found) return tl::make_unexpected(found.error());
  return *reinterpret_cast<capture::GetLibcameraModule*>(*found)();
}

}  // namespace lowlux::cli
