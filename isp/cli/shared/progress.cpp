#include "isp/cli/shared/progress.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>

#include <fmt/format.h>

#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/report.h"

namespace lowlux::cli {
namespace {

constexpr std::chrono::seconds patience{1};
constexpr int bar_width = 30;

}  // namespace

Progress::Progress(int total, bool wanted) : total_(total), wanted_(wanted && ::isatty(STDERR_FILENO) == 1) {}

Progress::~Progress() { clear(); }

void Progress::advance(double amount, const std::string& what) {
  const std::lock_guard lock(mutex_);
  done_ += amount;
  if (!wanted_ || std::chrono::steady_clock::now() - start_ < patience) return;
  const int filled = std::min(bar_width, static_cast<int>(bar_width * done_ / total_));
  print_err(fmt::format("\r\033[K[{:<{}}] {:.0f} % {}", std::string(filled, '#'), bar_width, 100 * done_ / total_,
                        one_line(what)));
  std::fflush(stderr);
  shown_ = true;
}

void Progress::print(const std::function<void()>& print) {
  const std::lock_guard lock(mutex_);
  clear();
  print();
}

void Progress::clear() {
  if (!shown_) return;
  print_err("\r\033[K");
  std::fflush(stderr);
  shown_ = false;
}

}  // namespace lowlux::cli
