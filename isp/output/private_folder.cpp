#include "isp/output/private_folder.h"

#include <cerrno>
#include <cstdlib>
#include <system_error>
#include <utility>

namespace lowlux::isp {
namespace {

namespace fs = std::filesystem;

/// Gives the owner all rights in a folder and those below it, without which what they hold cannot be removed. Symbolic
/// links are not followed.
void open_folders(const fs::path& folder) {
  std::error_code ignored, failed;
  fs::permissions(folder, fs::perms::owner_all, fs::perm_options::add, ignored);
  for (fs::directory_iterator at(folder, failed), end; !failed && at != end; at.increment(failed)) {
    if (fs::is_directory(at->symlink_status(ignored))) open_folders(at->path());
  }
}

}  // namespace

Result<PrivateFolder> PrivateFolder::make() {
  std::error_code failed;
  const fs::path below = fs::temp_directory_path(failed);
  if (failed) {
    return fail(ErrorCode::unwritable, "cannot use the folder for temporary files (TMPDIR): " + failed.message());
  }
  std::string name = (below / "lowlux-XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) {
    return fail(ErrorCode::unwritable, "no folder can be made here: " + std::generic_category().message(errno),
                below.string());
  }
  return PrivateFolder(name);
}

PrivateFolder::~PrivateFolder() {
  if (path_.empty()) return;
  std::error_code failed;
  fs::remove_all(path_, failed);
  if (!failed) return;
  open_folders(path_);
  fs::remove_all(path_, failed);
}

PrivateFolder::PrivateFolder(PrivateFolder&& other) noexcept : path_(std::exchange(other.path_, {})) {}

}  // namespace lowlux::isp
