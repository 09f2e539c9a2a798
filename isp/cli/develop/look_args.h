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

/// Holds the arguments of --look and its related options.
struct LookArgs {
  isp::LookChoice choice;
  bool noise_limit_given = false;
  std::string light_file;               // spectrum of the light (.csv); empty: choice.light
  std::string coefficients;             // file of a table for Shin's model; empty: the substitute
  std::optional<double> display_cd_m2;  // white of the display for which images are made
  std::vector<std::string> given;       // options that are not valid for every look
};

void add_look(CLI::App& app, LookArgs& args);
/// Adds --seeing-map, which only developing files has.
void add_seeing_map(CLI::App& app, LookArgs& args);

/// Names what decides on corrections: the look alone, or a planner for all corrections, for which --effects auto,
/// --effects all and --tolerance are valid with any look.
enum class Planner : std::uint8_t { of_look, of_everything };

/// Completes the choice with defaults. @return the error of the options in combination, or nothing
std::optional<std::string> complete_look(const LookArgs& args, Planner planner, isp::LookChoice& choice);

/// Holds the decisions that `develop` takes itself, and their time budget.
struct EffectsArgs {
  std::optional<double> budget_ms;             // for each frame
  std::optional<double> budget_mpps;           // megapixels in a second
  std::optional<isp::ProcessingGoal> effects;  // excludes the budget, which depends on the frame
  bool budgeted() const { return budget_ms || budget_mpps; }
};

/// Adds --budget-ms and --budget-mpps; --effects and --tolerance belong to the look's options too.
void add_budget(CLI::App& app, EffectsArgs& args);

/// Adds --budget-ms of merging.
void add_merge_budget(CLI::App& app, EffectsArgs& args);

/// Combines these options with those of the look. @return the error of their combination, or nothing
std::optional<std::string> complete_effects(const LookArgs& look, EffectsArgs& args);

/// Returns the budget for a frame of this size [s]. Precondition: args.budgeted().
double budget_s(const EffectsArgs& args, double megapixels);

}  // namespace lowlux::cli
