#include "isp/cli/simulate/burst_args.h"

#include <cstddef>
#include <functional>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "isp/cli/shared/option_values.h"

namespace lowlux::cli {
namespace {

constexpr const char* group = "Bursts (their motion is written to OUT.truth.json)";
constexpr int default_reduction = 2;

/// Stores X,Y.
OptionStore pair_store(std::function<void(double, double)> store) {
  return [store = std::move(store)](const std::string& text) -> ArgumentError {
    const auto numbers = numbers_of(text, 2);
    if (!numbers || numbers->size() != 2) return "is not X,Y in pixels";
    store((*numbers)[0], (*numbers)[1]);
    return std::nullopt;
  };
}

ArgumentError set_bracket(const std::string& text, std::vector<double>& bracket_ev) {
  const auto numbers = numbers_of(text, 100);
  if (!numbers) return "is not EV,EV... of 1 to 100 exposures";
  bracket_ev = *numbers;
  return std::nullopt;
}

void add_motion(CLI::App& app, capture::BurstOptions& o) {
  add_number(app, "--shake", "PX", "hand shake: displace each frame by a random 0 to PX pixels", [&o](double px) {
    o.shake_px = px;
  })->group(group);
  add_number(app, "--roll", "DEG", "rotate each frame about the image centre by a random -DEG to DEG",
             [&o](double deg) { o.roll_deg = deg; })
      ->group(group);
  add_number(app, "--dither", "PX", "displace frames evenly over a square of -PX to PX pixels", [&o](double px) {
    o.dither_px = px;
  })->group(group);
  add_number(app, "--field-rotation", "DEG", "rotate the sky clockwise by DEG from each frame to the next",
             [&o](double deg) { o.field_rotation_deg = deg; })
      ->group(group);
  add_text(app, "--field-centre", "X,Y", "centre of --field-rotation in frame 0 (default: image centre)",
           pair_store([&o](double x, double y) {
             o.field_centre = capture::ImagePoint{x, y};
           }))
      ->group(group);
  add_text(app, "--drift", "X,Y", "displace the sky by X,Y pixels from each frame to the next",
           pair_store([&o](double x, double y) { o.drift_x_px = x, o.drift_y_px = y; }))
      ->group(group);
  app.add_option("--horizon", o.horizon_px, "first row of a foreground that stays as the sky moves (default: none)")
      ->type_name("ROW")
      ->group(group);
}

void add_objects(CLI::App& app, BurstArgs& args) {
  capture::BurstOptions& o = args.options;
  app.add_option("--movers", o.movers, "add N square objects that move in front of the scene (default 0)")
      ->type_name("N")
      ->group(group);
  add_number(app, "--mover-size", "PX", "side of moving objects (default: 1/8 of the image's shorter side)",
             [&o](double px) { o.mover_size_px = px; })
      ->group(group);
  add_number(app, "--mover-speed", "PX", "displacement of moving objects from frame to frame (default 8)",
             [&args](double px) {
               args.options.mover_speed_px = px;
               args.mover_speed_given = true;
             })
      ->group(group);
}

/// Returns the first option that does nothing without another, and why; empty if there is none.
std::string without_effect(const BurstArgs& args, const std::string& scene) {
  const capture::BurstOptions& o = args.options;
  if (o.field_centre && o.field_rotation_deg == 0) return "--field-centre has no effect without --field-rotation";
  if (o.horizon_px && !o.sky_moves()) return "--horizon has no effect without --field-rotation or --drift";
  if (o.movers == 0 && o.mover_size_px) return "--mover-size has no effect without --movers";
  if (o.movers == 0 && args.mover_speed_given) return "--mover-speed has no effect without --movers";
  if (o.movers != 0 && scene == "dark") return "--movers has no effect on the scene dark";
  return {};
}

/// Returns the first option that moves frames other than the first; null if there is none.
const char* motion_option(const capture::BurstOptions& o) {
  if (o.shake_px != 0) return "--shake";
  if (o.roll_deg != 0) return "--roll";
  if (o.dither_px != 0) return "--dither";
  if (o.field_rotation_deg != 0) return "--field-rotation";
  return o.sky_moves() ? "--drift" : nullptr;
}

}  // namespace

void add_burst(CLI::App& app, BurstArgs& args) {
  add_motion(app, args.options);
  add_objects(app, args);
  add_text(app, "--bracket", "EV[,EV...]",
           "exposure times of the frames, repeated in this order: --exposure times 2^EV",
           [&args](const std::string& text) { return set_bracket(text, args.options.bracket_ev); })
      ->group(group);
  app.add_option("--reduce", args.reduction,
                 "samples of the scene per pixel along each axis, 1 to 8 (default 2 if frames move)")
      ->type_name("N")
      ->group(group);
}

Result<void> complete_burst(BurstArgs& args, const std::string& scene, std::optional<int>& frames) {
  const auto wrong = [](const std::string& what) { return fail(ErrorCode::invalid_argument, what); };
  if (const std::string what = without_effect(args, scene); !what.empty()) return wrong(what);
  capture::BurstOptions& o = args.options;
  const int exposures = static_cast<int>(o.bracket_ev.size());
  if (exposures > 0 && frames && *frames % exposures != 0) {
    return wrong(fmt::format("--frames: {} is not a multiple of the {} exposures of --bracket", *frames, exposures));
  }
  if (exposures > 0 && !frames) frames = exposures;
  if (const char* motion = motion_option(o); motion != nullptr && frames.value_or(1) == 1) {
    return wrong(fmt::format("{} has no effect without --frames: frame 0 is never moved", motion));
  }
  constexpr int max_reduction = 8;
  if (args.reduction && (*args.reduction < 1 || *args.reduction > max_reduction)) {
    return wrong(fmt::format("--reduce: {} is not a whole number of 1 to {}", *args.reduction, max_reduction));
  }
  const bool uniform = scene == "dark" || scene == "flat";  // no reduction changes it
  o.reduction = args.reduction;
  if (!o.reduction && o.moves()) o.reduction = uniform ? 1 : default_reduction;
  return {};
}

}  // namespace lowlux::cli
