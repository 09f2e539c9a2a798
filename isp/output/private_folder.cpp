#include "isp/output/private_folder.h"

#include <cerrno>
#include <cstdlib>
#include <system_error>
#include <utility>

namespace lowlux::isp {

Result<PrivateFolder> PrivateFolder::make() {
  std::error_code failed;
  const std::filesystem::path below = std::filesystem::temp_directory_path(failed);
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
  std::error_code ignored;
  if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
}

PrivateFolder::PrivateFolder(PrivateFolder&& other) noexcept : path_(std::exchange(other.path_, {})) {}

}  // namespace lowlux::isp
