#include "isp/cli/merge/merge_args.h"

#include <functional>
#include <utility>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "isp/cli/shared/option_values.h"

namespace lowlux::cli {
void add_merging(CLI::App& app, MergeArgs& args) {
  using Alignment = std::optional<isp::MergeAlignment>;
  isp::MergeOptions& options = args.options;
  add_choice<Alignment>(
      app, "--align",
      {{"auto", std::nullopt},
       {"none", isp::MergeAlignment::none},
       {"cells", isp::MergeAlignment::cells},
       {"subpixel", isp::MergeAlignment::subpixel},
       {"stars", isp::MergeAlignment::stars}},
      [&options](Alignment alignment) { options.alignment = alignment; },
      "how frames are aligned (auto: subpixel if the camera moved, else none)");
  add_choice<bool>(
      app, "--foreground", {{"move", false}, {"keep", true}}, [&options](bool keep) { options.keep_foreground = keep; },
      "with --align stars: align the foreground like the stars (move), or keep its position (default: move)");
  add_text(app, "--drizzle", "SCALE", "drizzle to a LinearRaw image of SCALE times the width and height (1 to 3)",
           store_within({1, 3}, args.drizzle_scale));
  add_text(app, "--pixfrac", "SIDE", "with --drizzle: side of the square onto which each pixel is shrunk (default 1)",
           store_within({0.05, 1}, args.pixfrac));
  add_choice<bool>(
      app, "--mean", {{"robust", true}, {"plain", false}}, [&options](bool robust) { options.robust = robust; },
      "average only content that matches the other frames (robust), or everything (default: robust; with --budget-ms "
      "what fits)");
  app.add_option("--reference", args.reference,
                 "raw file to which the others are aligned (default: the first; with --align stars the middle one; in "
                 "a bracket the longest exposure that is at most half saturated)")
      ->type_name("RAW");
  add_text(app, "--false-alarm", "RATE", "fraction of a static scene that is left out by chance (default 0.001)",
           store_within({1e-6, 0.5}, options.false_alarm));
}

std::optional<std::string> settle_merging(MergeArgs& args, bool budgeted) {
  const std::optional<isp::MergeAlignment>& alignment = args.options.alignment;
  const bool stars = alignment == isp::MergeAlignment::stars;
  if (args.options.keep_foreground && !stars) return "--foreground keep needs --align stars";
  if (args.options.keep_foreground && args.options.robust == false) return "--foreground keep needs --mean robust";
  if (budgeted && (stars || args.drizzle_scale))
    return "--budget-ms does not know the times of --align stars and --drizzle: leave it out";
  if (args.pixfrac && !args.drizzle_scale) return "--pixfrac needs --drizzle";
  if (!args.drizzle_scale) return std::nullopt;
  if (alignment == isp::MergeAlignment::none)
    return "--drizzle needs displaced frames, and --align none assumes a camera at rest";
  if (args.options.keep_foreground) {
    return "--drizzle and --foreground keep are mutually exclusive";
  }
  args.options.drizzle = merge::DrizzleOptions{.scale = *args.drizzle_scale, .pixfrac = args.pixfrac.value_or(1)};
  return std::nullopt;
}

}  // namespace lowlux::cli
