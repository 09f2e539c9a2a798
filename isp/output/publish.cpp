#include "isp/output/publish.h"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>

namespace lowlux::isp {
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

/// What the system answers where it, or the file system, does not know a way.
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
