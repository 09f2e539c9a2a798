#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "isp/pipeline/options.h"
#include "isp/pipeline/plan/look.h"

namespace CLI {
class App;
}

namespace CLI {
class App;
}

namespace lowlux::cli {

/// --look and what goes with it.
struct LookArgs {
  isp::LookChoice choice;
  bool noise_limit_given = false;
  std::string coefficients;             // file of a table for Shin's model; empty: the substitute
  std::optional<double> display_cd_m2;  // white of the display pictures are made for
  std::vector<std::string> given;       // options that do not go with every look
};

void add_look(CLI::App& app, LookArgs& args);

/// Who decides what a frame calls for: the look alone, or a planner that also decides about corrections, to which
/// --effects auto, --effects all and --tolerance belong whatever the look.
enum class Planner : std::uint8_t { of_look, of_everything };

/// The choice with defaults filled in. @return what is wrong with the options together, or nothing
std::optional<std::string> complete_look(const LookArgs& args, Planner planner, isp::LookChoice& choice);

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
