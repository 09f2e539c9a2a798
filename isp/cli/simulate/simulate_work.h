#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "isp/base/frame.h"
#include "isp/base/image.h"
#include "isp/base/result.h"
#include "isp/cli/simulate/simulate_args.h"
#include "isp/cli/simulate/simulate_report.h"

namespace lowlux::cli {

/// Holds what a simulation makes, for callers that keep it in memory.
struct SimulatedData {
  std::vector<RawFrame> frames;
  std::optional<SceneLinear> truth;    // linear sRGB with the scene's white at 1
  std::optional<SceneLinear> truth_e;  // mean electrons of R, G, B at each pixel
  std::string burst_truth;             // JSON, see burst_truth_json; empty: not a burst
};

/// Takes what a simulation makes, one after the other, each after its file is written; functions may be empty. An error
/// ends the simulation.
struct SimulationTaker {
  /// Takes a frame, its index and the results so far, which lack later files and times.
  std::function<Result<void>(const RawFrame& frame, int index, const SimulateOutcome& so_far)> frame;
  // The truths are those of SimulatedData. They are made for these functions even if they have no file.
  std::function<Result<void>(const SceneLinear& truth)> truth;
  std::function<Result<void>(const SceneLinear& truth_e)> truth_e;
};

/// Does the work of `simulate`: writes the files that the arguments name, and prints nothing.
/// @param keep  set: frames and truths are also put there; arguments without an output then write no file
/// @param take  arguments without an output then write no file
/// Errors: outputs that exist, those of scene, sensor, writers and `take`; frames that take more memory than there is.
Result<SimulateOutcome> simulate(const SimulateArgs& args, SimulatedData* keep = nullptr,
                                 const SimulationTaker& take = {});

}  // namespace lowlux::cli
