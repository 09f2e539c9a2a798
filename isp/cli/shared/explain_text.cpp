#include <array>
#include <cmath>
#include <span>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/report.h"
#include "isp/cli/shared/saturation_report.h"
#include "isp/pipeline/budget/cost_model.h"

namespace lowlux::cli {
namespace {

void add_noise(Lines& out, const isp::NoiseReduction& noise, const std::optional<NoiseOrigin>& origin) {
  if (noise.snr) {
    const std::array<double, 3> variance = noise.pixel_variance_e2();
    out.add("noise", origin ? origin_text(*origin) : fmt::format("of the {}", name_of(noise.source)));
    out.add("", fmt::format("without light, with quantisation: {:.3g} {:.3g} {:.3g} e- (R, G, B)",
                            std::sqrt(variance[0]), std::sqrt(variance[1]), std::sqrt(variance[2])));
    if (origin && !origin->unmeasurable.empty()) out.add("", "not measured on the image: " + origin->unmeasurable);
    for (const std::string& doubt : origin ? origin->doubts : std::vector<std::string>()) out.add("", "note: " + doubt);
    if (noise.noise_ratio) out.add("", ratio_text(*noise.noise_ratio));
  }
  out.add("denoise", fmt::format("{}: {}", noise.level ? denoise::name_of(*noise.level) : "off", noise.reason));
  for (const denoise::LineOffsets& lines : noise.lines) {
    out.add("", fmt::format("{} noise: {:.3g} e- subtracted, {:.3g} e- left",
                            lines.lines == denoise::Lines::rows ? "row" : "column", lines.line_std_e,
                            lines.residual_std_e));
  }
}

void add_time(Lines& out, const isp::StepPlan& effects, const isp::ProcessingGoal& choice) {
  if (!effects.predicted_s) {
    out.add("time", "not predicted: run `lowlux bench --calibrate-cost` once to measure the speed of this machine");
    return;
  }
  const double predicted_ms = 1e3 * *effects.predicted_s;
  if (!choice.budget_s) {
    out.add("time", fmt::format("predicted {:.1f} ms for one file at a time", predicted_ms));
    return;
  }
  std::string text = fmt::format("{:.1f} ms; predicted {:.1f} ms", 1e3 * *choice.budget_s, predicted_ms);
  if (choice.cost->machine == isp::reference_machine) {
    text += fmt::format(", roughly ({:.2f} times that of {}); `lowlux bench --calibrate-cost` measures this machine",
                        choice.cost->pace, isp::reference_machine);
  } else if (choice.cost->pace_s > 0) {
    text +=
        fmt::format(" (the machine now takes {:.2f} times as long as when its speed was measured)", choice.cost->pace);
  }
  out.add("budget", text);
}

void add_effects(Lines& out, const isp::StepPlan& effects, const isp::ProcessingGoal& choice) {
  out.add("effects", choice.all ? std::string("all")
                     : choice.tolerance_delta_e
                         ? fmt::format("auto, tolerance {:.2g} CIEDE2000", *choice.tolerance_delta_e)
                         : std::string("auto, the most accurate plan within the time"));
  for (const isp::PlannedStep& effect : effects.effects) {
    std::string text = fmt::format("{}: {}", effect.name, effect.used ? "applied" : "skipped");
    text += std::isfinite(effect.size)
                ? fmt::format("; changes the image by {:.2g} CIEDE2000, error that remains {:.2g}", effect.size,
                              effect.left)
                : std::string();
    if (effect.seconds)
      text += fmt::format("; {}{:.1f} ms", effect.used ? "takes " : "would take ", 1e3 * *effect.seconds);
    out.add("", text + " (" + effect.decision + ")");
  }
  add_time(out, effects, choice);
}

std::string look_name(const isp::DevelopPlan& plan) {
  return plan.rendering.look->kind == isp::Look::model ? plan.options.look.model : "eye";
}

void add_look_effects(Lines& out, std::span<const isp::LookEffect> effects) {
  for (const isp::LookEffect& effect : effects) {
    const std::string size = std::isfinite(effect.size) ? fmt::format("up to {:.2g} CIEDE2000", effect.size)
                                                        : std::string("applied on request only");
    out.add("", fmt::format("{} {}: {}", effect.name, effect.used ? "applied" : "skipped", size));
  }
}

void add_light(Lines& out, const isp::LookPlan& look, const isp::SceneLight* light) {
  const std::string name = light != nullptr && !light->name.empty() ? light->name + ", " : "";
  out.add("light", fmt::format("{}S/P ratio {:.3g} (scotopic to photopic, {}), degree of adaptation {:.2f}", name,
                               look.look.scotopic_ratio_of_white, look.light_rule, look.adaptation_degree));
  if (look.rods) {
    out.add("", fmt::format("response of the rods from {}{}", look.rods->source == "profile" ? "the " : "",
                            look.rods->source) +
                    (look.rods->relative_error
                         ? fmt::format(", rms error {:.1f} % over surface colours", 100 * *look.rods->relative_error)
                         : std::string()));
  }
}

void add_retina(Lines& out, const isp::RetinaPlan& retina) {
  out.add(
      "retina",
      fmt::format("pupil {:.1f} mm; photons absorbed at the mean of the scene: {:.3g}/s in a rod, {:.3g}/s in a cone",
                  retina.pupil_mm, retina.mean.rods, retina.mean.cones));
  if (!retina.seen_fraction) return;
  const isp::SeeingModel& seeing = retina.seeing;
  out.add("seeing", fmt::format("{:.1f} % of the image is detected more often than not, from {} photons absorbed in "
                                "rods or {} in cones; {:.2g} % false alarms",
                                100 * *retina.seen_fraction, seeing.rods.threshold, seeing.cones.threshold,
                                100 * seeing.false_alarm_rate));
}

void add_look(Lines& out, const isp::LookPlan& look, const std::string& name, const std::string& coefficients,
              bool noise_known) {
  if (look.kind != isp::Look::camera) {
    out.add("look", fmt::format("{}; scene {:.3g} cd/m2 ({}), adaptation m {:.2f}, darkened by {:+.2f} EV", name,
                                look.mean_cd_m2, look.luminance_rule, look.state.m, look.dimming_ev));
    if (look.effects) add_look_effects(out, *look.effects);
    if (look.retina) add_retina(out, *look.retina);
  }
  if (look.table) {
    out.add("",
            fmt::format(
                "table of {0} x {0} chromaticities, {1} levels: error {2:.2f} CIEDE2000 on average, {3:.2f} at most",
                look.table->cells, look.table->levels, look.table->error.mean, look.table->error.largest));
    if (look.table->by_noise) out.add("", "colours weighted by the local residual noise");
    if (name == "shin") out.add("", fmt::format("coefficients = {}", coefficients));
  }
  if (look.noise_limit) {
    out.add("noise limit",
            noise_known ? fmt::format("{:.3g} CIE L*", *look.noise_limit) : "none: the noise is not known");
  }
}

void add_table(Lines& out, const char* head, const char* name, const isp::HueSatMap& map) {
  out.add(head,
          fmt::format("{} of {} hues, {} saturations and {} values", name, map.hues, map.saturations, map.values));
}

void add_profile(Lines& out, const isp::ProfileRendering& profile) {
  if (profile.map) add_table(out, "profile", "embedded, map", *profile.map);
  if (profile.look)
    add_table(out, profile.map ? "" : "profile", profile.map ? "look table" : "embedded, look table", *profile.look);
  if (profile.curve) {
    out.add(profile.map || profile.look ? "" : "profile",
            fmt::format("tone curve of {} points", profile.curve->points));
  }
}

std::string dark_text(const isp::DevelopPlan& plan) {
  const isp::DarkCharge& dark = plan.dark;
  std::string text;
  if (dark.mean_e) {
    text = fmt::format("{:.3g} e-", *dark.mean_e);
    if (dark.standard_error_e) text += fmt::format(" (standard error {:.2g} e-)", *dark.standard_error_e);
    text += ", ";
  }
  switch (dark.state) {
    case isp::DarkCharge::State::not_examined:
      return "not examined: " + dark.reason;
    case isp::DarkCharge::State::not_expected:
      return "none expected: " + dark.reason;
    case isp::DarkCharge::State::unknown:
      return fmt::format("unknown, at most {:.0f} % of the median signal: {}", 100 * *dark.max_fraction, dark.reason);
    case isp::DarkCharge::State::in_black_point:
      text += "subtracted with the black level";
      break;
    case isp::DarkCharge::State::estimated:
      text += "estimated from the frame, ";
      text += plan.levels.black.dark_mean_e == PerSite<double>{} ? "not subtracted" : "subtracted";
      break;
  }
  text += ": " + dark.reason;
  if (dark.alpha && *dark.mean_e > 0) {
    text += fmt::format("; if not subtracted, it reduces the median saturation by {:.0f} % (alpha {:.3f})",
                        100 * (1 - *dark.alpha), *dark.alpha);
  }
  return text;
}

std::string dark_frame_text(const DarkFrame& dark) {
  return fmt::format(
      "mean of {} exposures{} in {} file{}; adds {:.3g} % to the variance without light; {} pixels unknown",
      dark.frames, dark.estimated ? " (estimated from the noise)" : "", dark.files, dark.files == 1 ? "" : "s",
      100 * dark.noise_fraction, dark.unknown.size());
}

std::string flat_text(const calib::FlatField& flat) {
  return fmt::format(
      "mean of {} frame{}; gains to {:.3g}; PRNU {:.2g} %, {:.0f} % of it divided out; adds {:.2g} % of the signal as "
      "noise",
      flat.frames, flat.frames == 1 ? "" : "s", flat.max_gain, 100 * flat.prnu, 100 * flat.pixel_fraction,
      100 * flat.noise);
}

std::string gain_text(const isp::DevelopPlan& plan) {
  std::string text = fmt::format("{:+.2f} EV, {}", plan.rendering.exposure_ev, plan.rendering.exposure_rule);
  const double offset_ev = plan.options.exposure_offset_ev;
  if (!plan.options.exposure_ev && offset_ev != 0) text += fmt::format(", changed by {:+.2f} EV", offset_ev);
  return text;
}

std::string framing_text(const isp::Framing& framing) {
  const Rect& kept = framing.pixels;
  std::string text = fmt::format("{} x {} pixels from column {}, row {} (before orientation)", kept.width, kept.height,
                                 kept.x, kept.y);
  if (framing.shrinks()) text += fmt::format(", shrunk to {} x {}", framing.size.width, framing.size.height);
  return text;
}

}  // namespace

std::string explain_text(const DevelopOutcome& outcome) {
  const isp::DevelopPlan& plan = *outcome.plan;
  Lines out;
  out.add(
      "black [DN]",
      fmt::format("{:.2f} from {}{}", fmt::join(plan.levels.black.pedestal_dn, " "), name_of(plan.levels.black.source),
                  plan.levels.black.holds == BlackPoint::Holds::pedestal_and_dark ? ", includes dark signal" : ""));
  if (plan.levels.saturation) out.add("saturation", saturation_text(*plan.levels.saturation));
  if (const DarkFrame* const dark = plan.levels.dark_frame.get()) {
    out.add(dark->is_bias ? "bias frame" : "dark frame", dark_frame_text(*dark));
  }
  if (outcome.flat) out.add("flat field", flat_text(*outcome.flat));
  out.add("dark signal", dark_text(plan));
  if (plan.effects) add_effects(out, *plan.effects, *plan.options.effects);
  out.add("defects", fmt::format("{} pixels repaired", plan.levels.defects.size()));
  add_noise(out, plan.noise_reduction, outcome.noise);
  if (!outcome.clean_raw.empty()) out.add("clean raw", outcome.clean_raw);
  if (!plan.demosaic.reason.empty()) {
    out.add("demosaic", fmt::format("{}: {}", name_of(plan.demosaic.demosaic.method), plan.demosaic.reason));
  }
  out.add("white", plan.rendering.white
                       ? fmt::format("{}, {:.0f} K", plan.rendering.white_balance_rule, plan.rendering.white->cct_k)
                       : std::string(plan.rendering.white_balance_rule));
  out.add("exposure", gain_text(plan));
  if (plan.options.highlights == isp::Highlights::reconstruct) {
    out.add("highlights", fmt::format("reconstructed up to {:.2f} times the scene's white", plan.rendering.limit));
  }
  if (plan.options.local_tone > 0) {
    out.add("local tone", fmt::format("{:g}, {}", plan.options.local_tone,
                                      plan.local_tone_by_noise ? "shadows as far as their noise allows"
                                                               : "without a limit by noise, which is not known"));
  }
  if (plan.sharpen_px) out.add("sharpening", fmt::format("of a blur of {:g} pixels", *plan.sharpen_px));
  if (plan.framing) out.add("framing", framing_text(*plan.framing));
  if (plan.rendering.profile) add_profile(out, *plan.rendering.profile);
  if (plan.rendering.look) {
    add_look(out, *plan.rendering.look, look_name(plan), coefficients_of(plan.options.look),
             plan.rendering.look->noise || plan.noise_reduction.has_level());
    if (plan.rendering.look->kind != isp::Look::camera) {
      add_light(out, *plan.rendering.look, plan.options.look.light.get());
    }
  }
  if (plan.display) {
    const isp::DisplayTarget& display = *plan.display;
    out.add("display",
            fmt::format("{:g} to {:g} cd/m2, coefficients {}, error of the table {:.2f} CIEDE2000 on average",
                        display.source_cd_m2, display.display_cd_m2, display.coefficients,
                        display.made.error.mean_ciede2000));
  }
  return out.text();
}

std::string_view name_of(BlackPoint::Source source) {
  switch (source) {
    case BlackPoint::Source::masked_pixels:
      return "masked-pixels";
    case BlackPoint::Source::tag:
      return "tag";
    case BlackPoint::Source::given:
      return "given";
    case BlackPoint::Source::profile:
      return "profile";
    case BlackPoint::Source::dark_frame:
      return "dark-frame";
    case BlackPoint::Source::format_default:
      return "format-default";
  }
  return "";
}

std::string_view name_of(isp::DarkCharge::State state) {
  switch (state) {
    case isp::DarkCharge::State::not_examined:
      return "not-examined";
    case isp::DarkCharge::State::not_expected:
      return "not-expected";
    case isp::DarkCharge::State::in_black_point:
      return "in-black-point";
    case isp::DarkCharge::State::estimated:
      return "estimated";
    case isp::DarkCharge::State::unknown:
      return "unknown";
  }
  return "";
}

std::string_view name_of(NoiseProfile::Source source) {
  switch (source) {
    case NoiseProfile::Source::file:
      return "file";
    case NoiseProfile::Source::profile:
      return "profile";
    case NoiseProfile::Source::picture:
      return "picture";
  }
  return "";
}

}  // namespace lowlux::cli
