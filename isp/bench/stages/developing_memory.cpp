#include "isp/bench/stages/developing_memory.h"

#include <fcntl.h>
#include <malloc.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>

namespace lowlux::isp {
namespace {

double largest_resident_bytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return 1024.0 * static_cast<double>(usage.ru_maxrss);
}

/// Resets the largest resident set to the current one. Returns false if the system does not support it.
bool forget_largest_resident() {
  const int file = open("/proc/self/clear_refs", O_WRONLY | O_CLOEXEC);
  const bool forgotten = file >= 0 && write(file, "5", 1) == 1;
  if (file >= 0) close(file);
  return forgotten;
}

/// Runs the work in the child and sends the added memory to the parent.
[[noreturn]] void tell(int to, const std::function<bool()>& work) {
  malloc_trim(0);  // freed memory would otherwise be reused and not counted
  const bool forgotten = forget_largest_resident();
  const double before = largest_resident_bytes();
  const double added = forgotten && work() ? largest_resident_bytes() - before : -1;
  const bool told = write(to, &added, sizeof added) == static_cast<ssize_t>(sizeof added);
  _exit(told ? 0 : 1);
}

}  // namespace

std::optional<double> peak_bytes_of(const std::function<bool()>& work) {
  std::array<int, 2> ends{};
  if (pipe(ends.data()) != 0) return std::nullopt;
  const pid_t child = fork();
  if (child == 0) tell(ends[1], work);
  close(ends[1]);
  double added = -1;
  const bool heard = child > 0 && read(ends[0], &added, sizeof added) == static_cast<ssize_t>(sizeof added);
  close(ends[0]);
  if (child > 0) waitpid(child, nullptr, 0);
  if (!heard || added < 0) return std::nullopt;
  return added;
}

double physical_bytes() {
  return static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE));
}

}  // namespace lowlux::isp
