#include "isp/cli/shared/module.h"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <vector>

#include <dlfcn.h>
#include <fmt/format.h>

#include "calib/profile/profile_io.h"

extern "C" const char lowlux_module_stamp[];

namespace lowlux::cli {
namespace {

/// Returns the function of an open module; nullptr if the module was not built with this command.
void* function_of(void* loaded, const Module& module) {
  const void* stamp = dlsym(loaded, "lowlux_module_stamp");
  const bool ours = stamp != nullptr && std::strcmp(static_cast<const char*>(stamp), lowlux_module_stamp) == 0;
  return ours ? dlsym(loaded, module.function.c_str()) : nullptr;
}

/// Returns the folder of lowlux's library, which programs other than the command load; empty if it is not known.
std::filesystem::path library_folder() {
  Dl_info info{};
  if (dladdr(reinterpret_cast<void*>(&calib::parse_profile), &info) == 0 || info.dli_fname == nullptr) return {};
  std::error_code failed;
  const std::filesystem::path library = std::filesystem::canonical(info.dli_fname, failed);
  return failed ? std::filesystem::path() : library.parent_path();
}

/// Returns the files that a module may be: those of the command's installation, and those next to lowlux's library
/// where they exist.
std::vector<std::filesystem::path> candidates(const std::filesystem::path& folder, const std::string& file) {
  std::vector<std::filesystem::path> out{folder / file, folder / LOWLUX_MODULE_FOLDER / file};
  const std::filesystem::path library = library_folder();
  for (const std::filesystem::path& place : {library / file, library / "lowlux" / file}) {
    std::error_code ignored;
    if (!library.empty() && std::filesystem::exists(place, ignored)) out.push_back(place);
  }
  return out;
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
  for (const std::filesystem::path& place : candidates(*folder, module.file)) {
    void* loaded = dlopen(place.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (loaded == nullptr) {
      const char* reason = dlerror();  // NOLINT(concurrency-mt-unsafe): glibc keeps one for each thread
      said += fmt::format("{}{}", said.empty() ? "" : "; ", reason != nullptr ? reason : "no reason given");
      continue;
    }
    if (void* found = function_of(loaded, module); found != nullptr) return found;
    dlclose(loaded);
    said += fmt::format("{}{} belongs to another build of lowlux: build or install it again", said.empty() ? "" : "; ",
                        place.string());
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

Result<const isp::NlMeans*> load_nl_means() {
  const auto found = load_module({.file = "liblowlux_nlm.so",
                                  .function = isp::nl_means_name,
                                  .purpose = "OpenCV's non-local means",
                                  .needs = "OpenCV's photo module (Debian: libopencv-photo-dev)"});
  if (!found) return tl::make_unexpected(found.error());
  return reinterpret_cast<isp::GetNlMeans*>(*found)();
}

}  // namespace lowlux::cli
