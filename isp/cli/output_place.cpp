#include "isp/cli/output_place.h"

#include <filesystem>
#include <system_error>

#include <fmt/format.h>

namespace lowlux::cli {

namespace fs = std::filesystem;

Result<void> check_place(const std::string& file, bool force) {
  std::error_code ignored;
  const fs::path folder = fs::path(file).parent_path();
  if (!folder.empty() && !fs::is_directory(folder, ignored)) {
    return fail(ErrorCode::unwritable,
                fmt::format("cannot write {}: there is no directory {}, create it first", file, folder.string()), file);
  }
  if (fs::is_directory(file, ignored)) {
    return fail(ErrorCode::unwritable, fmt::format("cannot write {}: it is a directory", file), file);
  }
  if (!force && fs::exists(file, ignored)) {
    return fail(ErrorCode::exists, fmt::format("{} exists: use --force to overwrite it", file), file);
  }
  return {};
}

}  // namespace lowlux::cli
