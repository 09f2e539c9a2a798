#include "isp/output/atomic_file.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <mutex>
#include <set>
#include <string_view>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

namespace lowlux::isp {
namespace {

namespace fs = std::filesystem;

std::string directory_of(const std::string& path) {
  const fs::path parent = fs::path(path).parent_path();
  return parent.empty() ? "." : parent.string();
}

tl::unexpected<Error> taken(const std::string& path) {
  return fail(ErrorCode::exists, path + " exists: use --force to overwrite it", path);
}

tl::unexpected<Error> cannot_write(const std::string& path, int cause) {
  const std::string name = path.empty() ? "an output without a name" : path;
  switch (cause) {
    case ENOENT:
    case ENOTDIR:
      return fail(ErrorCode::unwritable,
                  "cannot write " + name + ": there is no directory " + directory_of(path) + ", create it first", path);
    case EACCES:
    case EPERM:
      return fail(ErrorCode::unwritable, "cannot write " + name + ": no permission to write in " + directory_of(path),
                  path);
    case EROFS:
      return fail(ErrorCode::unwritable, "cannot write " + name + ": the file system is read-only", path);
    case ENOSPC:
    case EDQUOT:
      return fail(ErrorCode::unwritable, "cannot write " + name + ": the disk is full", path);
    default:
      break;
  }
  return fail(ErrorCode::unwritable, "cannot write " + name + ": " + std::generic_category().message(cause), path);
}

/// Returns an error if `path` cannot be written or replaced.
Result<void> check_target(const std::string& path, Overwrite overwrite) {
  if (path.empty()) return cannot_write(path, EINVAL);
  struct stat found {};
  if (lstat(path.c_str(), &found) != 0) {
    if (errno == ENOENT) return {};
    return cannot_write(path, errno);
  }
  struct stat behind {};
  if (stat(path.c_str(), &behind) == 0) found = behind;  // else a dangling link, replaced like a file
  if (S_ISDIR(found.st_mode)) {
    return fail(ErrorCode::unwritable, path + " is a directory: name a file in it", path);
  }
  if (!S_ISREG(found.st_mode) && !S_ISLNK(found.st_mode)) {
    return fail(ErrorCode::unwritable, path + " is not a regular file: images are written to files only", path);
  }
  if (overwrite == Overwrite::no) return taken(path);
  return {};
}

/// Returns the name to write: the target of a link, or `path` itself.
std::string resolve(const std::string& path) {
  std::error_code failed;
  if (!fs::is_symlink(path, failed)) return path;
  const fs::path target = fs::canonical(path, failed);
  return failed ? path : target.string();
}

/// Holds the temporary files of this process. A thread that makes, publishes or removes one holds the mutex.
struct Unfinished {
  std::mutex mutex;
  std::set<std::string> names;
  std::set<std::string> swept;  // directories without remnants of dead processes
  unsigned made = 0;
};

/// Returns the temporary files. They are never destroyed: a thread that handles signals may use them while the process
/// ends.
Unfinished& unfinished() {
  static Unfinished& all = *new Unfinished;
  return all;
}

/// Returns the prefix of this host's temporary files: other hosts that mount the directory may not see a lock.
std::string temporary_prefix() {
  char host[256] = {};
  gethostname(host, sizeof host - 1);
  return std::string(".lowlux-") + host + "-";
}

/// Returns whether a name is the prefix followed only by a process and a number. Prefixes of other hosts may begin the
/// same.
bool is_temporary(const std::string& name, const std::string& prefix) {
  constexpr std::string_view suffix = ".part";
  if (!name.starts_with(prefix) || !name.ends_with(suffix) || name.size() < prefix.size() + suffix.size()) return false;
  const std::string_view middle =
      std::string_view(name).substr(prefix.size(), name.size() - prefix.size() - suffix.size());
  return std::ranges::count(middle, '-') == 1 && middle.find_first_not_of("0123456789-") == std::string_view::npos;
}

bool has_name(int descriptor) {
  struct stat found {};
  return fstat(descriptor, &found) == 0 && found.st_nlink > 0;
}

/// Removes temporary files whose process is dead: no process holds their lock.
void sweep(const std::string& directory, const std::string& prefix) {
  std::error_code failed;
  for (fs::directory_iterator entry(directory, failed), end; !failed && entry != end; entry.increment(failed)) {
    const std::string name = entry->path().filename().string();
    if (!is_temporary(name, prefix)) continue;
    const int descriptor = open(entry->path().c_str(), O_RDWR | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    if (descriptor < 0) continue;
    if (flock(descriptor, LOCK_EX | LOCK_NB) == 0 && has_name(descriptor)) unlink(entry->path().c_str());
    close(descriptor);
  }
}

struct Temporary {
  std::string name;
  int descriptor = -1;
  int cause = 0;  // errno if there is no descriptor
};

/// Creates a new locked file. Another process may consider it abandoned between its creation and its locking; then the
/// next name is tried.
Temporary make_temporary(const std::string& directory) {
  Unfinished& all = unfinished();
  const std::lock_guard guard(all.mutex);
  const std::string prefix = temporary_prefix();
  if (all.swept.insert(directory).second) sweep(directory, prefix);
  std::string stem = directory;
  stem.append("/").append(prefix).append(std::to_string(getpid())).append("-");
  constexpr int max_tries = 1000;  // on some file systems no file ever seems to have a name
  for (int tries = 0; tries < max_tries; ++tries) {
    Temporary out;
    out.name = stem + std::to_string(all.made++) + ".part";
    out.descriptor = open(out.name.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (out.descriptor < 0 && errno == EEXIST) continue;  // belongs to another process with the same number
    if (out.descriptor < 0) {
      out.cause = errno;
      return out;
    }
    const bool taken_for_dead = flock(out.descriptor, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK;
    if (!taken_for_dead && has_name(out.descriptor)) {
      all.names.insert(out.name);
      return out;
    }
    close(out.descriptor);
  }
  return {.cause = EAGAIN};
}

/// Writes a directory to the disk. @return 0 or an errno
int sync_directory(const std::string& directory) {
  const int descriptor = open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return errno;
  const int cause = fsync(descriptor) == 0 || errno == EINVAL ? 0 : errno;  // EINVAL: not supported for directories
  close(descriptor);
  return cause;
}

}  // namespace

AtomicFile::AtomicFile(std::string path, std::string target, Overwrite overwrite, Sync sync)
    : path_(std::move(path)), target_(std::move(target)), overwrite_(overwrite), sync_(sync) {}

AtomicFile::AtomicFile(AtomicFile&& other) noexcept
    : path_(std::move(other.path_)),
      target_(std::move(other.target_)),
      temporary_(std::exchange(other.temporary_, {})),
      overwrite_(other.overwrite_),
      sync_(other.sync_),
      locked_(std::exchange(other.locked_, -1)),
      file_(std::move(other.file_)) {}

AtomicFile::~AtomicFile() {
  if (!temporary_.empty()) {
    Unfinished& all = unfinished();
    const std::lock_guard guard(all.mutex);
    unlink(temporary_.c_str());
    all.names.erase(temporary_);
  }
  if (locked_ >= 0) close(locked_);
}

Result<AtomicFile> AtomicFile::create(const std::string& path, Overwrite overwrite, Sync sync) {
  if (auto free = check_target(path, overwrite); !free) return tl::make_unexpected(free.error());
  AtomicFile out(path, resolve(path), overwrite, sync);
  Temporary made = make_temporary(directory_of(out.target_));
  if (made.descriptor < 0) return cannot_write(path, made.cause);
  out.temporary_ = std::move(made.name);
  out.locked_ = made.descriptor;
  const int second = fcntl(made.descriptor, F_DUPFD_CLOEXEC, 0);
  if (second >= 0) out.file_.reset(fdopen(second, "w+b"));
  if (out.file_ == nullptr) {
    const int cause = errno;
    if (second >= 0) close(second);
    return cannot_write(path, cause);
  }
  return out;
}

void AtomicFile::abandon_all() {
  Unfinished& all = unfinished();
  all.mutex.lock();  // never unlocked
  for (const std::string& name : all.names) unlink(name.c_str());
}

Result<void> AtomicFile::close_file() {
  errno = 0;
  const bool sound =
      std::ferror(file_.get()) == 0 && std::fflush(file_.get()) == 0 && (sync_ == Sync::no || fsync(locked_) == 0);
  const int flush_cause = errno;
  // Network file systems report a full disk on closing.
  if (std::fclose(file_.release()) == 0 && sound) return {};
  const int cause = flush_cause != 0 ? flush_cause : errno;
  return cannot_write(path_, cause != 0 ? cause : EIO);
}

Result<void> AtomicFile::publish() {
  Unfinished& all = unfinished();
  const std::lock_guard guard(all.mutex);
  int cause = 0;
  if (overwrite_ == Overwrite::yes) {
    cause = std::rename(temporary_.c_str(), target_.c_str()) == 0 ? 0 : errno;
  } else {
    cause = publish_new(temporary_, target_);
  }
  if (cause == EEXIST) return taken(path_);
  if (cause != 0) return cannot_write(path_, cause);
  all.names.erase(std::exchange(temporary_, {}));
  return {};
}

/// Removes the published file, if it did not replace another one.
void AtomicFile::withdraw() const {
  if (overwrite_ == Overwrite::no) unlink(target_.c_str());
}

Result<void> AtomicFile::sync_name() const {
  const int cause = sync_ == Sync::yes ? sync_directory(directory_of(target_)) : 0;
  if (cause != 0) return cannot_write(path_, cause);
  return {};
}

Result<void> AtomicFile::commit_all(std::span<AtomicFile> files) {
  for (AtomicFile& file : files) {
    if (auto closed = file.close_file(); !closed) return closed;
  }
  for (std::size_t i = 0; i < files.size(); ++i) {
    auto published = files[i].publish();
    if (published) continue;
    for (const AtomicFile& earlier : files.first(i)) earlier.withdraw();
    return published;
  }
  for (const AtomicFile& file : files) {
    if (auto synced = file.sync_name(); !synced) return synced;
  }
  return {};
}

namespace {

int by_rename(const char* from, const char* to) {
  return renameat2(AT_FDCWD, from, AT_FDCWD, to, RENAME_NOREPLACE) == 0 ? 0 : errno;
}

int by_link(const char* from, const char* to) {
  if (link(from, to) != 0) return errno;
  unlink(from);
  return 0;
}

int by_claim(const char* from, const char* to) {
  const int claimed = open(to, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (claimed < 0) return errno;
  close(claimed);
  if (std::rename(from, to) == 0) return 0;
  const int cause = errno;
  unlink(to);
  return cause;
}

/// Returns whether an errno means that the system, or the file system, does not support a way.
bool not_offered(int cause) {
  return cause == EINVAL || cause == ENOSYS || cause == EOPNOTSUPP || cause == EPERM || cause == EMLINK;
}

}  // namespace

int publish_new(const std::string& from, const std::string& to, Publish way) {
  switch (way) {
    case Publish::rename_noreplace:
      return by_rename(from.c_str(), to.c_str());
    case Publish::hard_link:
      return by_link(from.c_str(), to.c_str());
    case Publish::claim:
      break;
  }
  return by_claim(from.c_str(), to.c_str());
}

int publish_new(const std::string& from, const std::string& to) {
  int cause = 0;
  for (const Publish way : {Publish::rename_noreplace, Publish::hard_link, Publish::claim}) {
    cause = publish_new(from, to, way);
    if (!not_offered(cause)) break;
  }
  return cause;
}

}  // namespace lowlux::isp
