#include "isp/cli/chart_module.h"

#include <dlfcn.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <string>
#include <system_error>

#include <fmt/format.h>

namespace lowlux::cli {
namespace {

constexpr const char* module_name = "liblowlux_chart.so";

}  // namespace

Result<calib::DetectCharts*> load_chart_detector() {
  std::error_code failed;
  const std::filesystem::path folder = std::filesystem::read_symlink("/proc/self/exe", failed).parent_path();
  if (failed) return fail(ErrorCode::unreadable, "cannot tell where the command lies: is /proc mounted?");
  std::string said;
  for (const std::filesystem::path& place : {folder, folder / LOWLUX_MODULE_FOLDER}) {
    void* module = dlopen((place / module_name).c_str(), RTLD_NOW | RTLD_LOCAL);
    if (module == nullptr) {
      const char* reason = dlerror();  // NOLINT(concurrency-mt-unsafe): glibc keeps one for each thread
      said += fmt::format("{}{}", said.empty() ? "" : "; ", reason != nullptr ? reason : "no reason given");
      continue;
    }
    void* found = dlsym(module, calib::detect_charts_name);
    if (found != nullptr) return reinterpret_cast<calib::DetectCharts*>(found);
    said += fmt::format("{} is of another version", module_name);
  }
  std::replace(said.begin(), said.end(), '\n', ' ');
  return fail(ErrorCode::unreadable,
              fmt::format("finding charts needs {} and OpenCV's mcc module (Debian: libopencv-contrib406): {}",
                          module_name, said));
}

}  // namespace lowlux::cli
