#pragma once

#include <functional>
#include <string>

namespace lowlux::cli {

/// Makes SIGINT, SIGTERM and SIGHUP remove the temporary files and folders of this process, and print a line if there
/// is an InterruptionReport, before they end it as by default. Signals that are ignored (nohup) stay ignored.
void clean_up_on_signals();

/// Sets the text of that line after "lowlux: interrupted:" while the object exists. At most one may exist at a time.
class InterruptionReport {
 public:
  explicit InterruptionReport(std::function<std::string()> text);
  ~InterruptionReport();
  InterruptionReport(const InterruptionReport&) = delete;
  InterruptionReport& operator=(const InterruptionReport&) = delete;
};

}  // namespace lowlux::cli
