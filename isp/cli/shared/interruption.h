#pragma once

#include <functional>
#include <string>

namespace lowlux::cli {

/// From now on SIGINT, SIGTERM and SIGHUP remove the temporary files of this process, and print a line if there is an
/// InterruptionReport, before they end it as they would have. Those that are ignored (nohup) stay so.
void clean_up_on_signals();

/// What that line says after "lowlux: interrupted:" as long as the object lives. At most one at a time.
class InterruptionReport {
 public:
  explicit InterruptionReport(std::function<std::string()> text);
  ~InterruptionReport();
  InterruptionReport(const InterruptionReport&) = delete;
  InterruptionReport& operator=(const InterruptionReport&) = delete;
};

}  // namespace lowlux::cli
