#pragma once

#include <optional>
#include <string>

#include "capture/synthetic/burst_motion.h"
#include "isp/base/result.h"

namespace CLI {
class App;
}  // namespace CLI

namespace lowlux::cli {

/// Holds the options of a burst, and which of them were given where their values do not show it.
struct BurstArgs {
  capture::BurstOptions options;  // the reduction is that of complete_burst()
  std::optional<int> reduction;   // --reduce
  bool mover_speed_given = false;

  /// Returns whether the frames are those of a burst; if not, they are of one scene at rest and one exposure.
  bool is_burst() const { return options.moves() || !options.bracket_ev.empty() || reduction.has_value(); }
};

/// Adds the options of bursts.
void add_burst(CLI::App& app, BurstArgs& args);

/// Completes the options of a burst once all arguments are known: the reduction, and frames as many as the bracket has
/// exposures unless they are given. Errors: an option without another that it needs; frames that are not a multiple of
/// the bracket; motion of a single frame; objects in a dark scene, which shows none.
/// @param frames absent: not given
Result<void> complete_burst(BurstArgs& args, const std::string& scene, std::optional<int>& frames);

}  // namespace lowlux::cli
