#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "isp/base/executor.h"
#include "isp/base/result.h"
#include "isp/bench/pace.h"
#include "isp/pipeline/budget/cost_model.h"

/// What developing costs on this machine, kept between runs.
namespace lowlux::cli {

/// Threads that work on one file where so many are taken at a time: the processors' share, up to 8.
int threads_of_each(int files);

/// What times depend on: processor, instruction set, version of lowlux. Another machine's times are not believed.
std::string machine_name();

/// $XDG_CACHE_HOME/lowlux/cost-THREADS.json, or in ~/.cache; nullopt where neither variable is set.
std::optional<std::string> cost_file(int threads);

/// The cost model as JSON, and back. Error: it is none (malformed).
std::string cost_text(const isp::CostModel& model);
Result<isp::CostModel> parse_cost(std::string_view text);

/// The model of this machine with so many threads from its file. Errors: there is none, or it cannot be read; it is of
/// another format, machine, instruction set, version of lowlux or number of threads.
Result<isp::CostModel> kept_cost(int threads);

/// The kept model or, where there is none, isp::reference_cost(), with a message on stderr that gives the reason.
isp::CostModel cost_of_this_machine(int threads, bool quiet);

/// What developing costs at the moment: a machine that has other work too, or is hot, is slower than when it was
/// calibrated.
class MachineSpeed {
 public:
  explicit MachineSpeed(isp::CostModel calibrated) : calibrated_(std::move(calibrated)) {}

  /// The model with the pace of now; as it was calibrated where its own pace is not known. Takes about a tenth of a
  /// second, and with it goes what the first frame of a program takes more. Errors: those of isp::Pace.
  Result<std::shared_ptr<const isp::CostModel>> now(Executor& executor);

 private:
  isp::CostModel calibrated_;
  isp::Pace pace_;
};

/// Measures anew and writes the file. @return its name, empty where there is no place for one
Result<isp::CostModel> calibrate_cost(int threads, bool quiet, std::string& written_to);

}  // namespace lowlux::cli
