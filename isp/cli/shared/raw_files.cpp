#include "isp/cli/shared/raw_files.h"

#include <glob.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <string_view>
#include <system_error>

#include "isp/cli/shared/option_values.h"

namespace lowlux::cli {
namespace {

namespace fs = std::filesystem;

// These are the extensions of cameras; a folder may also hold reference images, profiles and notes.
constexpr std::array<std::string_view, 24> raw_extensions{
    ".dng", ".cr2", ".cr3", ".crw", ".nef", ".nrw", ".arw", ".srf", ".sr2", ".raf", ".orf", ".rw2",
    ".pef", ".srw", ".3fr", ".fff", ".iiq", ".mos", ".mrw", ".kdc", ".dcr", ".erf", ".rwl", ".raw"};

/// Returns whether a name is that of a raw file. Names that begin with a dot are hidden: some systems store notes on
/// files under such names (._IMG_1.DNG).
bool is_raw_name(const fs::path& path) {
  std::string extension = path.extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return !path.filename().string().starts_with('.') &&
         std::ranges::find(raw_extensions, extension) != raw_extensions.end();
}

Result<std::vector<std::string>> files_in_folder(const std::string& folder) {
  std::vector<std::string> found;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    std::error_code ignored;
    if (entry->is_regular_file(ignored) && is_raw_name(entry->path())) found.push_back(entry->path().string());
  }
  if (error) return fail(ErrorCode::unreadable, "the folder cannot be read: " + error.message(), folder);
  if (found.empty()) return fail(ErrorCode::not_found, "the folder holds no raw files", folder);
  std::ranges::sort(found);
  return found;
}

Result<std::vector<std::string>> files_of_pattern(const std::string& pattern) {
  glob_t matches{};
  const int failure = glob(pattern.c_str(), 0, nullptr, &matches);  // NOLINT(concurrency-mt-unsafe): one thread yet
  std::vector<std::string> found(matches.gl_pathv, matches.gl_pathv + (failure == 0 ? matches.gl_pathc : 0));
  globfree(&matches);
  if (found.empty()) return fail(ErrorCode::not_found, "no file matches", pattern);
  return found;
}

}  // namespace

Result<std::vector<std::string>> raw_files_of(const std::string& argument) {
  std::error_code ignored;
  if (fs::is_directory(argument, ignored)) return files_in_folder(argument);
  if (!fs::exists(argument, ignored) && argument.find_first_of("*?[") != std::string::npos) {
    return files_of_pattern(argument);
  }
  return std::vector<std::string>{argument};
}

Result<std::vector<std::string>> raw_files_of_lists(const std::vector<std::string>& arguments) {
  std::vector<std::string> files;
  for (const std::string& argument : arguments) {
    std::error_code ignored;
    const bool one = fs::exists(argument, ignored);
    for (const std::string& name : one ? std::vector<std::string>{argument} : words_of(argument)) {
      auto found = raw_files_of(name);
      if (!found) return found;
      files.insert(files.end(), found->begin(), found->end());
    }
  }
  return files;
}

}  // namespace lowlux::cli
