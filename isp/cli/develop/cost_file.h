#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "isp/base/executor.h"
#include "isp/base/result.h"
#include "isp/cost/speed_probe.h"
#include "isp/pipeline/budget/cost_model.h"

/// Stores the costs of developing on this machine between runs.
namespace lowlux::cli {

/// Returns the number of threads per file if so many are processed at a time: an equal part of the processors, up to 8.
int threads_of_each(int files);

/// Returns the conditions that times depend on: processor, instruction set, version of lowlux. Times of other
/// conditions are rejected.
std::string machine_name();

/// Returns $XDG_CACHE_HOME/lowlux/cost-THREADS.json, or in ~/.cache; nullopt where neither variable is set.
std::optional<std::string> cost_file(int threads);

/// Converts the cost model to JSON, and parse_cost back. Error: not a cost model (malformed).
std::string cost_text(const isp::CostModel& model);
Result<isp::CostModel> parse_cost(std::string_view text);

/// Reads the model of this machine with so many threads from its file. Errors: the file is missing, or it cannot be
/// read; it is of another format, machine, instruction set, version of lowlux or number of threads.
Result<isp::CostModel> kept_cost(int threads);

/// Returns the stored model, else isp::reference_cost(), with a message on stderr that gives the reason.
isp::CostModel cost_of_this_machine(int threads, bool quiet);

/// Estimates the current costs of developing: a machine that has other work too, or is hot, is slower than when it was
/// calibrated.
class MachineSpeed {
 public:
  explicit MachineSpeed(isp::CostModel calibrated) : calibrated_(std::move(calibrated)) {}

  /// Returns the model at the current pace; as calibrated where its own pace is not known. It takes about a tenth of a
  /// second, which includes the extra time of a program's first frame. Errors: those of isp::SpeedProbe.
  Result<std::shared_ptr<const isp::CostModel>> now(Executor& executor);

 private:
  isp::CostModel calibrated_;
  isp::SpeedProbe pace_;
};

/// Measures again and writes the file. @return the model; `written_to` is set to the file's name if it was written
Result<isp::CostModel> calibrate_cost(int threads, bool quiet, std::string& written_to);

}  // namespace lowlux::cli
