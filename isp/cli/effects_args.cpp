#include "isp/cli/effects_args.h"

#include <algorithm>

#include <CLI/CLI.hpp>

#include "isp/cli/option_values.h"

namespace lowlux::cli {
namespace {

constexpr double least_budget = 1e-3, most_budget = 1e9;

bool is_given(const LookArgs& look, const char* option) {
  return std::ranges::find(look.given, option) != look.given.end();
}

void add_positive(CLI::App& app, const char* flag, const char* type, const char* unit, const char* help,
                  std::optional<double>& out) {
  add_text(app, flag, type, help, [&out, unit](const std::string& text) -> std::optional<std::string> {
    out = quantity_of(text, unit);
    if (out && *out >= least_budget && *out <= most_budget) return std::nullopt;
    return "is not a number from 0.001 to 1e9";
  });
}

}  // namespace

void add_budget(CLI::App& app, EffectsArgs& args) {
  add_positive(
      app, "--budget-ms", "MS", "ms",
      "time for developing each frame, from decoded codes to a finished picture (files are read and written "
      "besides): the most accurate way that is predicted to fit, or with --tolerance the fastest within it. "
      "Times are rough estimates until bench --calibrate-cost has measured this machine; before each file how busy it "
      "is is measured, which takes a tenth of a second or two more; one file at a time",
      args.budget_ms);
  add_positive(app, "--budget-mpps", "MP_PER_S", "MP/s", "the same as megapixels in a second", args.budget_mpps);
}

std::optional<std::string> complete_effects(const LookArgs& look, EffectsArgs& args) {
  using Which = isp::LookChoice::Which;
  if (args.budget_ms && args.budget_mpps) return "--budget-ms and --budget-mpps are two words for one thing: give one";
  const bool all = look.choice.which == Which::all;
  if (all && is_given(look, "--tolerance")) return "--effects all leaves nothing out: --tolerance goes with auto";
  if (all && args.budgeted()) return "--effects all leaves nothing out: a budget goes with auto";
  args.effects.emplace().all = all;
  if (args.budgeted() && !is_given(look, "--tolerance")) {
    args.effects->tolerance_delta_e.reset();
  } else {
    args.effects->tolerance_delta_e = look.choice.tolerance;
  }
  return std::nullopt;
}

double budget_s(const EffectsArgs& args, double megapixels) {
  return args.budget_ms ? 1e-3 * *args.budget_ms : megapixels / *args.budget_mpps;
}

}  // namespace lowlux::cli
