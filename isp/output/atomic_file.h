#pragma once

#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>

#include "isp/base/result.h"

namespace lowlux::isp {

enum class Overwrite : std::uint8_t { no, yes };

/// Whether commit() waits until file and folder are on the disk. Without, a crash of the program leaves the old file or
/// the new one, a power cut in the seconds after commit() may not.
enum class Sync : std::uint8_t { no, yes };

/// A file that appears under its name whole or not at all. It is written under a hidden temporary name in the same
/// directory (".lowlux-HOST-PID-N.part") and gets its own by commit(); without commit() the temporary is removed.
/// A symbolic link to an existing file stays: the file it points to is the one replaced. Permissions follow the umask.
///
/// A process holds a lock (flock) on its temporary files. Those that a killed process of this host has left are not
/// locked: they are removed when a process creates its first file in their directory.
class AtomicFile {
 public:
  /// Errors: the name is taken and `overwrite` is no; it is a directory or a device; the directory is missing or
  /// may not be written.
  static Result<AtomicFile> create(const std::string& path, Overwrite overwrite, Sync sync = Sync::no);

  /// Removes the temporary files of this process. Threads that create, commit or destroy an AtomicFile wait for ever
  /// from then on: for a process that is about to end.
  static void abandon_all();

  AtomicFile(AtomicFile&& other) noexcept;
  AtomicFile& operator=(AtomicFile&&) = delete;
  ~AtomicFile();

  /// Open for reading and writing, at its start; owned by this object.
  std::FILE* file() const { return file_.get(); }

  /// Flushes and closes the file, then gives it its name in one step. Without Overwrite::yes a file that has appeared
  /// under that name since create() is kept, and that is an error. To be called once.
  Result<void> commit();

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  AtomicFile(std::string path, std::string target, Overwrite overwrite, Sync sync);
  Result<void> close_file();
  Result<void> publish();

  std::string path_;       // as the caller named it
  std::string target_;     // behind symbolic links
  std::string temporary_;  // empty once it is gone
  Overwrite overwrite_;
  Sync sync_;
  int locked_ = -1;  // a second descriptor of the file, which keeps its lock until it has its name
  std::unique_ptr<std::FILE, Close> file_;
};

/// Ways to give a finished file its name only if that name is free, best first. Each is one step for other
/// processes: whoever comes second learns that the name is taken, and nobody's file is lost.
enum class Publish : std::uint8_t {
  rename_noreplace,  // renameat2 with RENAME_NOREPLACE: Linux, most local file systems
  hard_link,         // link, then unlink the old name: also NFS
  claim,             // create the name empty (O_EXCL), then rename over it: also file systems without links
};

/// Moves `from` to the free name `to`. @return 0, or an errno: EEXIST if the name is taken.
int publish_new(const std::string& from, const std::string& to, Publish way);

/// The same by the first way the file system offers.
int publish_new(const std::string& from, const std::string& to);

}  // namespace lowlux::isp
