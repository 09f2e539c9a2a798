#include "isp/cli/shared/raw_files.h"

#include <glob.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <string_view>
#include <system_error>

#include <fmt/format.h>

#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/option_values.h"

namespace lowlux::cli {
namespace {

namespace fs = std::filesystem;

// These are the extensions of cameras, those of formats that cannot be decoded included: such files are then reported.
// A folder may also hold reference images, profiles and notes.
constexpr std::array raw_extensions = std::to_array<std::string_view>(
    {".3fr", ".ari", ".arw", ".bay", ".cap", ".cr2", ".cr3", ".crw", ".cs1", ".dc2", ".dcr", ".dcs",
     ".dng", ".drf", ".eip", ".erf", ".fff", ".gpr", ".ia",  ".iiq", ".k25", ".kc2", ".kdc", ".mdc",
     ".mef", ".mfw", ".mos", ".mrw", ".nef", ".nrw", ".orf", ".ori", ".pef", ".ptx", ".pxn", ".qtk",
     ".raf", ".raw", ".rdc", ".rw2", ".rwl", ".rwz", ".sr2", ".srf", ".srw", ".sti", ".x3f"});

/// Returns whether a name begins with a dot: some systems store notes on files under such names (._IMG_1.DNG).
bool is_hidden(const fs::path& path) { return path.filename().string().starts_with('.'); }

/// Returns whether a name is that of a raw file, and not hidden.
bool is_raw_name(const fs::path& path) {
  std::string extension = path.extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return !is_hidden(path) && std::ranges::find(raw_extensions, extension) != raw_extensions.end();
}

/// Returns whether a folder, without its own sub-folders, has an entry with the name of a raw file.
bool holds_raw_files(const fs::path& folder) {
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    if (is_raw_name(entry->path())) return true;
  }
  return false;
}

Result<std::vector<std::string>> files_in_folder(const std::string& folder, bool quiet) {
  std::vector<std::string> found, sub_folders;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    std::error_code ignored;
    if (is_raw_name(entry->path())) {
      found.push_back(entry->path().string());
    } else if (!is_hidden(entry->path()) && entry->is_directory(ignored)) {
      sub_folders.push_back(entry->path().string());
    }
  }
  if (error) return fail(ErrorCode::unreadable, "the folder cannot be read: " + error.message(), folder);
  std::ranges::sort(sub_folders);
  const auto left_out = std::ranges::find_if(sub_folders, holds_raw_files);  // the first suffices: folders can be many
  if (found.empty()) {
    return fail(ErrorCode::not_found,
                left_out == sub_folders.end()
                    ? "the folder contains no raw files"
                    : fmt::format("the folder contains no raw files, but its sub-folder {} does: name the sub-folder",
                                  *left_out),
                folder);
  }
  if (left_out != sub_folders.end() && !quiet) {
    print_err(one_line(fmt::format("lowlux: {}: warning: raw files in sub-folders, such as {}, are left out; name the "
                                   "sub-folders too to include them",
                                   folder, *left_out)) +
              "\n");
  }
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

Result<std::vector<std::string>> raw_files_of(const std::string& argument, bool quiet) {
  std::error_code ignored;
  if (fs::is_directory(argument, ignored)) return files_in_folder(argument, quiet);
  if (!fs::exists(argument, ignored) && argument.find_first_of("*?[") != std::string::npos) {
    return files_of_pattern(argument);
  }
  return std::vector<std::string>{argument};
}

Result<std::vector<std::string>> raw_files_of_lists(const std::vector<std::string>& arguments, bool quiet) {
  std::vector<std::string> files;
  for (const std::string& argument : arguments) {
    std::error_code ignored;
    const bool one = fs::exists(argument, ignored);
    for (const std::string& name : one ? std::vector<std::string>{argument} : split_at_commas(argument)) {
      auto found = raw_files_of(name, quiet);
      if (!found) return found;
      files.insert(files.end(), found->begin(), found->end());
    }
  }
  return files;
}

}  // namespace lowlux::cli
