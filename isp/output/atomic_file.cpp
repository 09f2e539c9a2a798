#include "isp/output/atomic_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <filesystem>
#include <system_error>
#include <utility>

#include "isp/output/publish.h"

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
    case ENOSPC:
      return fail(ErrorCode::unwritable, "cannot write " + name + ": the disk is full", path);
    default:
      break;
  }
  return fail(ErrorCode::unwritable, "cannot write " + name + ": " + std::generic_category().message(cause), path);
}

/// Refuses what is in the way of `path`.
Result<void> check_target(const std::string& path, Overwrite overwrite) {
  if (path.empty()) return cannot_write(path, EINVAL);
  struct stat found {};
  if (lstat(path.c_str(), &found) != 0) {
    if (errno == ENOENT) return {};
    return cannot_write(path, errno);
  }
  struct stat behind {};
  if (stat(path.c_str(), &behind) == 0) found = behind;  // else a dangling link, replaced as if it were a file
  if (S_ISDIR(found.st_mode)) {
    return fail(ErrorCode::unwritable, path + " is a directory: name a file in it", path);
  }
  if (!S_ISREG(found.st_mode) && !S_ISLNK(found.st_mode)) {
    return fail(ErrorCode::unwritable, path + " is not a regular file: pictures are written to files only", path);
  }
  if (overwrite == Overwrite::no) return taken(path);
  return {};
}

/// The name to write: the file a link leads to, or `path` itself.
std::string resolve(const std::string& path) {
  std::error_code failed;
  if (!fs::is_symlink(path, failed)) return path;
  const fs::path target = fs::canonical(path, failed);
  return failed ? path : target.string();
}

}  // namespace

AtomicFile::AtomicFile(std::string path, std::string target, Overwrite overwrite)
    : path_(std::move(path)), target_(std::move(target)), overwrite_(overwrite) {}

AtomicFile::AtomicFile(AtomicFile&& other) noexcept
    : path_(std::move(other.path_)),
      target_(std::move(other.target_)),
      temporary_(std::exchange(other.temporary_, {})),
      overwrite_(other.overwrite_),
      file_(std::move(other.file_)) {}

AtomicFile::~AtomicFile() {
  if (!temporary_.empty()) unlink(temporary_.c_str());
}

Result<AtomicFile> AtomicFile::create(const std::string& path, Overwrite overwrite) {
  if (auto free = check_target(path, overwrite); !free) return tl::make_unexpected(free.error());
  static std::atomic<unsigned> counter{0};  // tells this process's files apart; nothing else depends on it
  AtomicFile out(path, resolve(path), overwrite);
  const std::string stem = directory_of(out.target_) + "/.lowlux-" + std::to_string(getpid()) + "-";
  int descriptor = -1;
  std::string name;
  do {
    name = stem + std::to_string(counter.fetch_add(1)) + ".part";
    descriptor = open(name.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  } while (descriptor < 0 && errno == EEXIST);  // left by a killed process of the same number
  if (descriptor < 0) return cannot_write(path, errno);
  out.temporary_ = std::move(name);
  out.file_.reset(fdopen(descriptor, "w+b"));
  if (out.file_ == nullptr) {
    const int cause = errno;
    close(descriptor);
    return cannot_write(path, cause);
  }
  return out;
}

Result<void> AtomicFile::commit() {
  errno = 0;
  const bool sound = std::ferror(file_.get()) == 0 && std::fflush(file_.get()) == 0;
  const int flush_cause = errno;
  // Network file systems report a full disk on closing.
  if (std::fclose(file_.release()) != 0 || !sound) {
    const int cause = flush_cause != 0 ? flush_cause : errno;
    return cannot_write(path_, cause != 0 ? cause : EIO);
  }
  int cause = 0;
  if (overwrite_ == Overwrite::yes) {
    cause = std::rename(temporary_.c_str(), target_.c_str()) == 0 ? 0 : errno;
  } else {
    cause = publish_new(temporary_, target_);
  }
  if (cause == EEXIST) return taken(path_);
  if (cause != 0) return cannot_write(path_, cause);
  temporary_.clear();
  return {};
}

}  // namespace lowlux::isp
