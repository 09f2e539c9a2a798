#pragma once

#include <optional>
#include <string>

#include "isp/cli/look_args.h"
#include "isp/pipeline/plan.h"

namespace CLI {
class App;
}

namespace lowlux::cli {

/// What `develop` is to decide for itself, and in what time.
struct EffectsArgs {
  std::optional<double> budget_ms;            // for each frame
  std::optional<double> budget_mpps;          // megapixels in a second
  std::optional<isp::EffectsChoice> effects;  // without the budget, which depends on the frame
  bool budgeted() const { return budget_ms || budget_mpps; }
};

/// --budget-ms, --budget-mpps; --effects and --tolerance are the look's too.
void add_budget(CLI::App& app, EffectsArgs& args);

/// What is asked for, of these options and those of the look. @return what is wrong with them together, or nothing
std::optional<std::string> complete_effects(const LookArgs& look, EffectsArgs& args);

/// The budget for a frame of this size [s]. Precondition: args.budgeted().
double budget_s(const EffectsArgs& args, double megapixels);

}  // namespace lowlux::cli
