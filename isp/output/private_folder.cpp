#include "isp/output/private_folder.h"

#include <cerrno>
#include <cstdlib>
#include <mutex>
#include <set>
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

/// Removes a folder and all it holds.
void remove_folder(const fs::path& folder) {
  std::error_code failed;
  fs::remove_all(folder, failed);
  if (!failed) return;
  open_folders(folder);
  fs::remove_all(folder, failed);
}

/// Holds the folders of this process.
struct Folders {
  std::mutex mutex;
  std::set<fs::path> all;
};

/// Returns the folders. They are never destroyed: a thread that handles signals may use them while the process ends.
Folders& folders() {
  static Folders& only = *new Folders;
  return only;
}

}  // namespace

Result<PrivateFolder> PrivateFolder::make() {
  std::error_code failed;
  const fs::path below = fs::temp_directory_path(failed);
  if (failed) {
    return fail(ErrorCode::unwritable, "cannot use the folder for temporary files (TMPDIR): " + failed.message());
  }
  std::string name = (below / "lowlux-XXXXXX").string();
  Folders& made = folders();
  const std::lock_guard guard(made.mutex);
  if (mkdtemp(name.data()) == nullptr) {
    return fail(ErrorCode::unwritable, "no folder can be created here: " + std::generic_category().message(errno),
                below.string());
  }
  made.all.insert(name);
  return PrivateFolder(name);
}

void PrivateFolder::abandon_all() {
  Folders& made = folders();
  made.mutex.lock();  // never unlocked
  for (const fs::path& folder : made.all) remove_folder(folder);
}

PrivateFolder::~PrivateFolder() {
  if (path_.empty()) return;
  Folders& made = folders();
  const std::lock_guard guard(made.mutex);
  remove_folder(path_);
  made.all.erase(path_);
}

PrivateFolder::PrivateFolder(PrivateFolder&& other) noexcept : path_(std::exchange(other.path_, {})) {}

}  // namespace lowlux::isp
