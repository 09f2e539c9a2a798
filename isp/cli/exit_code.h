#pragma once

namespace lowlux::cli {

inline constexpr int exit_done = 0;
inline constexpr int exit_failed = 1;  // an input or the work failed
inline constexpr int exit_usage = 2;   // the command line is wrong

}  // namespace lowlux::cli
