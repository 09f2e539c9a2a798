#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "isp/base/memory.h"
#include "isp/base/result.h"

namespace lowlux::isp {

#if defined(LOWLUX_SANITIZED)
/// lowlux as a command needs the address space for its sanitizer.
inline constexpr bool command_memory_is_limited = false;
#else
inline constexpr bool command_memory_is_limited = true;
#endif

/// Limits of one run of a command.
struct CommandLimits {
  double max_wall_s = 120;
  std::uint64_t max_file_bytes = std::uint64_t{1} << 30;    // largest size of each file that it writes
  std::uint64_t max_memory_bytes = std::uint64_t{4} << 30;  // writable memory of each of its processes
};

/// Holds the resources that a command used.
struct CommandUse {
  double wall_s = 0;
  double cpu_s = 0;       // processor time of all its processes that it waited for
  double peak_bytes = 0;  // largest resident memory of one of them
};

/// Runs a command line of /bin/sh to its end, in the current folder, without standard input, with all its output in
/// files of `folder`, which is also its TMPDIR. When it ends, when the time is over, or when this process dies, all
/// that is left of its process group is killed. For the duration of the run this process adopts orphans of its
/// descendants (PR_SET_CHILD_SUBREAPER), so that peak memory is that of the command, without this process's own.
/// Runs of several threads take turns.
/// @param folder  a private folder of this run; removed if this process dies during it
/// Errors, with the last line that the command printed: it cannot be started; its exit code is not 0; a signal ended
/// it; one of the limits was reached.
Result<CommandUse> run_contained(const std::string& command, const std::filesystem::path& folder,
                                 const CommandLimits& limits);

/// Returns a word that /bin/sh reads as this text, in quotes where it needs them.
std::string shell_word(const std::string& text);

}  // namespace lowlux::isp
