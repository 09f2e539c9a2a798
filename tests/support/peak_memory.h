#pragma once

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdint>

namespace lowlux::test {

/// Returns the maximum memory [bytes] that a process of its own has at a time while it does `work`, this program
/// included. The expectations of `work` count as usual; it must not have threads to wait for.
template <class Work>
std::int64_t peak_bytes(const Work& work) {
  const pid_t child = fork();
  if (child == 0) {
    work();
    _exit(testing::Test::HasFailure() ? 1 : 0);
  }
  int status = 0;
  rusage used{};
  EXPECT_EQ(wait4(child, &status, 0, &used), child);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  return std::int64_t{used.ru_maxrss} << 10;
}

}  // namespace lowlux::test
