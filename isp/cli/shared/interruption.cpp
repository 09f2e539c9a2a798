#include "isp/cli/shared/interruption.h"

#include <semaphore.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "isp/cli/shared/lines.h"
#include "isp/output/atomic_file.h"
#include "isp/output/private_folder.h"

namespace lowlux::cli {
namespace {

constexpr std::array signals{SIGINT, SIGTERM, SIGHUP};

sem_t arrived;  // posted by the handler, in which few functions are allowed
std::atomic<int> arrived_signal{0};
static_assert(std::atomic<int>::is_always_lock_free);

struct Report {
  std::mutex mutex;
  std::function<std::string()> text;
};

Report& report() {
  static Report& only = *new Report;  // never destroyed: the thread below outlives main()
  return only;
}

void note(int number) {
  const int kept = errno;
  arrived_signal = number;
  sem_post(&arrived);
  errno = kept;
}

void end_when_asked() {
  while (sem_wait(&arrived) != 0) continue;
  isp::AtomicFile::abandon_all();  // first: no file is made in the folders from here on
  isp::PrivateFolder::abandon_all();
  alarm(2);  // ends the process if the reader of stderr has stopped
  {
    Report& current = report();
    const std::lock_guard guard(current.mutex);
    const char* const clear_line = ::isatty(STDERR_FILENO) == 1 ? "\r\033[K" : "";
    if (current.text) print_err(fmt::format("{}lowlux: interrupted: {}\n", clear_line, current.text()));
  }
  const int number = arrived_signal;
  std::signal(number, SIG_DFL);
  std::raise(number);
}

}  // namespace

void clean_up_on_signals() {
  if (sem_init(&arrived, 0, 0) != 0) return;
  try {
    std::thread(end_when_asked).detach();
  } catch (const std::system_error&) {
    return;  // without the thread signals end the process as by default
  }
  for (const int number : signals) {
    struct sigaction before {};
    if (sigaction(number, nullptr, &before) != 0 || before.sa_handler == SIG_IGN) continue;
    struct sigaction wanted {};
    wanted.sa_handler = note;
    wanted.sa_flags = static_cast<int>(SA_RESETHAND | SA_RESTART);  // a second signal ends the process at once
    sigaction(number, &wanted, nullptr);
  }
}

InterruptionReport::InterruptionReport(std::function<std::string()> text) {
  const std::lock_guard guard(report().mutex);
  report().text = std::move(text);
}

InterruptionReport::~InterruptionReport() {
  const std::lock_guard guard(report().mutex);
  report().text = nullptr;
}

}  // namespace lowlux::cli
