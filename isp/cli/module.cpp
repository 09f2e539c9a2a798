#include "isp/cli/module.h"

#include <dlfcn.h>

#include <algorithm>
#include <filesystem>
#include <system_error>

#include <fmt/format.h>

namespace lowlux::cli {

Result<void*> load_module(const Module& module) {
  std::error_code failed;
  const std::filesystem::path folder = std::filesystem::read_symlink("/proc/self/exe", failed).parent_path();
  if (failed) return fail(ErrorCode::unreadable, "cannot tell where the command lies: is /proc mounted?");
  std::string said;
  for (const std::filesystem::path& place : {folder, folder / LOWLUX_MODULE_FOLDER}) {
    void* loaded = dlopen((place / module.file).c_str(), RTLD_NOW | RTLD_LOCAL);
    if (loaded == nullptr) {
      const char* reason = dlerror();  // NOLINT(concurrency-mt-unsafe): glibc keeps one for each thread
      said += fmt::format("{}{}", said.empty() ? "" : "; ", reason != nullptr ? reason : "no reason given");
      continue;
    }
    void* found = dlsym(loaded, module.function.c_str());
    if (found != nullptr) return found;
    said += fmt::format("{} is of another version", module.file);
  }
  std::replace(said.begin(), said.end(), '\n', ' ');
  return fail(ErrorCode::unreadable,
              fmt::format("{} needs {} and {}: {}", module.purpose, module.file, module.needs, said));
}

}  // namespace lowlux::cli
