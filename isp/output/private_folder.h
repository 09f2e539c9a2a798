#pragma once

#include <filesystem>
#include <string>
#include <utility>

#include "isp/base/result.h"

namespace lowlux::isp {

/// A new folder that only this user can read, removed with all its contents by the destructor.
class PrivateFolder {
 public:
  /// Makes the folder below that of temporary files (TMPDIR). Error: unwritable.
  static Result<PrivateFolder> make();
  ~PrivateFolder();
  PrivateFolder(PrivateFolder&& other) noexcept;
  PrivateFolder(const PrivateFolder&) = delete;
  PrivateFolder& operator=(const PrivateFolder&) = delete;

  /// Removes the folders of this process. Threads that make or destroy one block forever from then on: for a process
  /// that is about to end.
  static void abandon_all();

  const std::filesystem::path& path() const { return path_; }

 private:
  explicit PrivateFolder(std::filesystem::path path) : path_(std::move(path)) {}
  std::filesystem::path path_;  // empty: moved from
};

}  // namespace lowlux::isp
