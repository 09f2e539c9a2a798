#pragma once

#include <cstdint>
#include <cstdio>
#include <memory>
#include <span>
#include <string>

#include "isp/base/result.h"

namespace lowlux::isp {

enum class Overwrite : std::uint8_t { no, yes };

/// Selects whether commit() waits until file and directory are on the disk. Without it, a crash of the program leaves
/// the old file or the new one, but a power failure in the seconds after commit() may not.
enum class Sync : std::uint8_t { no, yes };

/// Writes a file that appears under its name complete or not at all. It is written under a hidden temporary name in the
/// same directory (".lowlux-HOST-PID-N.part") and gets its own by commit(); without commit() the temporary is removed.
/// A symbolic link to an existing file is kept: the file it points to is replaced. Permissions follow the umask.
///
/// A process holds a lock (flock) on its temporary files. Those of a killed process of this host are not locked: they
/// are removed when a process creates its first file in their directory.
class AtomicFile {
 public:
  /// Creates the temporary file. Errors: the name is taken and `overwrite` is no; it is a directory or a device; the
  /// directory is missing or not writable.
  static Result<AtomicFile> create(const std::string& path, Overwrite overwrite, Sync sync = Sync::no);

  /// Removes the temporary files of this process. Threads that create, commit or destroy an AtomicFile block forever
  /// from then on: for a process that is about to end.
  static void abandon_all();

  AtomicFile(AtomicFile&& other) noexcept;
  AtomicFile& operator=(AtomicFile&&) = delete;
  ~AtomicFile();

  /// Returns the file, open for reading and writing, at its start; owned by this object.
  std::FILE* file() const { return file_.get(); }

  /// Flushes and closes the file, then gives it its name in one step. Without Overwrite::yes a file that has appeared
  /// under that name since create() is kept, and that is an error. Call it once.
  Result<void> commit() { return commit_all({this, 1}); }

  /// Commits files in their order, all or none: all are on the file system before the first gets its name. If one
  /// cannot get its name, the earlier ones are removed, except for those that were allowed to replace a file.
  static Result<void> commit_all(std::span<AtomicFile> files);

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  AtomicFile(std::string path, std::string target, Overwrite overwrite, Sync sync);
  Result<void> close_file();
  Result<void> publish();
  void withdraw() const;
  Result<void> sync_name() const;

  std::string path_;       // path that the caller gave
  std::string target_;     // after resolving symbolic links
  std::string temporary_;  // empty once it is removed or renamed
  Overwrite overwrite_;
  Sync sync_;
  int locked_ = -1;  // a second descriptor of the file, which keeps its lock until it has its name
  std::unique_ptr<std::FILE, Close> file_;
};

/// Lists ways to give a finished file its name only if that name is free, best first. Each is one step for other
/// processes: the second one learns that the name is taken, and no file is lost.
enum class Publish : std::uint8_t {
  rename_noreplace,  // renameat2 with RENAME_NOREPLACE: Linux, most local file systems
  hard_link,         // link, then unlink the old name: also NFS
  claim,             // create the name empty (O_EXCL), then rename over it: also file systems without links
};

/// Moves `from` to the free name `to` by the given way. @return 0, or an errno: EEXIST if the name is taken.
int publish_new(const std::string& from, const std::string& to, Publish way);

/// Moves `from` to the free name `to` by the first way that the file system supports. @return 0, or an errno.
int publish_new(const std::string& from, const std::string& to);

}  // namespace lowlux::isp
