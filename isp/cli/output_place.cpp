#include "isp/cli/output_place.h"

#include <filesystem>
#include <map>
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

bool same_name(const std::string& a, const std::string& b) {
  std::error_code ignored;
  return a == b || fs::weakly_canonical(a, ignored) == fs::weakly_canonical(b, ignored);
}

std::string wrong_names(const std::vector<std::string>& outputs, const std::vector<std::string>& inputs) {
  std::map<fs::path, bool> is_output;
  const auto added = [&](const std::string& name, bool output) {
    std::error_code ignored;
    return is_output.emplace(fs::weakly_canonical(name, ignored), output);
  };
  for (const std::string& name : inputs) {
    if (!name.empty() && !added(name, false).second) return fmt::format("{} is given twice", name);
  }
  for (const std::string& name : outputs) {
    if (name.empty()) continue;
    const auto [place, is_new] = added(name, true);
    if (is_new) continue;
    return place->second ? fmt::format("two outputs have the name {}", name)
                         : fmt::format("{} would replace a file that is read", name);
  }
  return {};
}

}  // namespace lowlux::cli
