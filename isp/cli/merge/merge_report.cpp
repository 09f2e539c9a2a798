#include "isp/cli/merge/merge_report.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "isp/base/json_text.h"
#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/saturation_report.h"

namespace lowlux::cli {
namespace {

std::string_view alignment_name(isp::MergeAlignment alignment) {
  switch (alignment) {
    case isp::MergeAlignment::none:
      return "none";
    case isp::MergeAlignment::cells:
      return "cells";
    case isp::MergeAlignment::subpixel:
      return "subpixel";
    case isp::MergeAlignment::stars:
      return "stars";
  }
  return {};
}

constexpr double little_used = 0.1;  // fraction of the image; frames used less are reported

std::string reason_of(const isp::FrameUse& use, bool is_reference, bool by_stars) {
  if (!use.aligned) return by_stars ? "its stars do not match" : "its displacement could not be found";
  if (!use.is_compared) return is_reference ? "it is the reference" : "it was averaged without comparing it";
  if (use.used_fraction > 0.99) return "it matches the reference";
  const bool has_differences = use.mean_chi_square > 0 || use.outliers > 0;
  if (use.used_fraction == 0 && !has_differences)
    return "no part of it can be compared, for example because one frame is saturated";
  if (use.mean_chi_square > 2 || use.used_fraction < little_used)
    return "it differs from the reference by more than the noise";
  return "parts of it do not match the reference";
}

std::string method_name(const isp::MergeMethod& method) {
  return fmt::format("{} mean, alignment {}", method.robust ? "robust" : "plain", alignment_name(method.alignment));
}

/// Returns why no better method was chosen.
std::string reason_of(const isp::MergePlan& plan) {
  if (!plan.fits) return "no method fits into the time; this one is the fastest";
  if (plan.better) return fmt::format("{} would take {:.0f} ms", method_name(*plan.better), 1e3 * plan.better_s);
  return "no better method can be chosen";
}

std::string budget_text(const isp::MergePlan& plan) {
  return fmt::format("{:.0f} ms: {}; predicted {:.0f} ms, took {:.0f} ms; {}", 1e3 * plan.budget_s,
                     method_name(plan.method), 1e3 * plan.predicted_s, 1e3 * plan.taken_s, reason_of(plan));
}

nlohmann::ordered_json budget_json(const isp::MergePlan& plan) {
  return {{"budget_ms", 1e3 * plan.budget_s},
          {"mean", plan.method.robust ? "robust" : "plain"},
          {"alignment", alignment_name(plan.method.alignment)},
          {"predicted_ms", 1e3 * plan.predicted_s},
          {"taken_ms", 1e3 * plan.taken_s},
          {"motion_measured", plan.motion_measured},
          {"fits", plan.fits},
          {"reason", reason_of(plan)}};
}

}  // namespace

std::optional<std::string> unmatched_frames_warning(const std::vector<std::string>& inputs,
                                                    const isp::MergedRaw& merged) {
  std::string first;
  int count = 0;
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    const isp::FrameUse& use = merged.frames[i];
    // Frames at rest are compared with what most of them show, the first one too.
    const bool is_reference = merged.alignment != isp::MergeAlignment::none && static_cast<int>(i) == merged.reference;
    if (is_reference || !use.aligned || use.used_fraction >= little_used) continue;
    if (++count == 1) first = fmt::format("{}: {}", inputs[i], reason_of(use, false, false));
  }
  if (count == 0) return std::nullopt;
  return fmt::format(
      "{} of {} frames match{} the reference in less than {:.0f} % of the image ({}); leave these frames out; "
      "--explain lists them",
      count, inputs.size(), count == 1 ? "es" : "", 100 * little_used, first);
}

std::string merge_text(const MergeReport& report) {
  const auto& [inputs, merged, origin] = report;
  Lines out;
  const bool by_stars = merged.alignment == isp::MergeAlignment::stars;
  std::string frames = fmt::format("{}, alignment {}", inputs.size(), alignment_name(merged.alignment));
  if (!merged.bracket) frames += fmt::format("; noise of a mean of {:.2f}", merged.mean_count);
  out.add("frames", frames);
  if (origin) out.add("noise model", origin_text(*origin));
  if (merged.saturation) out.add("saturation", saturation_text(*merged.saturation));
  if (merged.plan) out.add("budget", budget_text(*merged.plan));
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    const isp::FrameUse& use = merged.frames[i];
    const bool moved = merged.alignment != isp::MergeAlignment::none;
    const bool is_reference = static_cast<int>(i) == merged.reference;
    if (moved && !by_stars && is_reference) {
      out.add(i == 0 ? "used" : "", fmt::format("{}: 100 %: it is the reference", inputs[i]));
      continue;
    }
    std::string text =
        fmt::format("{}: {:.1f} %: {}", inputs[i], 100 * use.used_fraction, reason_of(use, is_reference, by_stars));
    if (moved && use.aligned)
      text += fmt::format("; moved by up to {:.2f} px (+- {:.2f})", use.largest_shift_px, use.shift_error_px);
    if (by_stars && !is_reference)
      text += fmt::format("; {} of {} stars", use.stars_matched, merged.stars);
    else if (by_stars && use.is_compared)
      text += "; it is the reference";
    if (merged.bracket) text += fmt::format("; {:.4g} times the light", use.light);
    if (use.outliers > 0) text += fmt::format("; {} sites left out", use.outliers);
    out.add(i == 0 ? "used" : "", text);
  }
  if (merged.still_fraction > 0) {
    out.add("foreground", fmt::format("{:.1f} % of the image does not move", 100 * merged.still_fraction));
  }
  return out.text();
}

std::string merge_json(const MergeReport& report) {
  const auto& [inputs, merged, origin] = report;
  using Json = nlohmann::ordered_json;
  const bool by_stars = merged.alignment == isp::MergeAlignment::stars;
  Json frames = Json::array();
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    const isp::FrameUse& use = merged.frames[i];
    const bool is_reference = static_cast<int>(i) == merged.reference;
    frames.push_back({{"file", inputs[i]},
                      {"reference", is_reference},
                      {"used_fraction", use.used_fraction},
                      {"outliers", use.outliers},
                      {"stars_matched", use.stars_matched},
                      {"light", use.light},
                      {"mean_chi_square", use.mean_chi_square},
                      {"aligned", use.aligned},
                      {"largest_shift_px", use.aligned ? Json(use.largest_shift_px) : Json()},
                      {"shift_error_px", use.aligned ? Json(use.shift_error_px) : Json()},
                      {"reason", reason_of(use, is_reference, by_stars)}});
  }
  Json times = Json::array();
  for (const isp::StageTime& time : merged.times) times.push_back({{"stage", time.stage}, {"seconds", time.seconds}});
  const NoiseProfile& noise = *merged.frame.noise;
  Json json{{"alignment", alignment_name(merged.alignment)},
            {"bracket", merged.bracket},
            {"saturation", Json::parse(saturation_json(merged.saturation))},
            {"mean_count", merged.bracket ? Json() : Json(merged.mean_count)},
            {"stars", merged.stars},
            {"still_fraction", merged.still_fraction},
            {"empty_fraction", merged.empty_fraction},
            {"noise_profile", {{"scale", noise.scale}, {"offset", noise.offset}}},
            {"frames", frames},
            {"warnings", merged.warnings},
            {"times", times}};
  if (origin) json["noise_model"] = Json::parse(origin_json(*origin));
  if (merged.plan) json["budget"] = budget_json(*merged.plan);
  return json_text(json, 2);
}

}  // namespace lowlux::cli
