#pragma once

#include <cstdint>
#include <string>

namespace lowlux::isp {

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
