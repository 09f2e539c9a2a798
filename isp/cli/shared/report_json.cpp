#include <cmath>

#include <nlohmann/json.hpp>

#include "calib/profile/profile_use.h"
#include "isp/base/json_text.h"
#include "isp/cli/shared/report.h"
#include "isp/cli/shared/saturation_report.h"
#include "isp/model/colour/camera_colour.h"
#include "isp/model/sensor/scene_luminance.h"
#include "isp/raw/black_point.h"
#include "isp/raw/to_linear.h"

namespace lowlux::cli {
namespace {

using Json = nlohmann::ordered_json;

// Returns JSON text. Names are bytes on Linux: invalid UTF-8 is replaced, so that the output is valid JSON.
std::string dumped(const Json& json) { return json_text(json, 2); }

Json rect_json(const Rect& r) { return {{"x", r.x}, {"y", r.y}, {"width", r.width}, {"height", r.height}}; }

template <class T>
Json optional_json(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}

Json black_json(const BlackPoint& black) {
  return {{"source", name_of(black.source)},
          {"pedestal_dn", black.pedestal_dn},
          {"standard_error_dn", black.pedestal_standard_error_dn},
          {"noise_std_dn", black.noise_std_dn},
          {"holds_dark", black.holds == BlackPoint::Holds::pedestal_and_dark}};
}

Json dark_charge_json(const isp::DevelopPlan& plan) {
  const isp::DarkCharge& dark = plan.dark;
  const BlackPoint& black = plan.levels.black;
  const bool is_subtracted =
      black.holds == BlackPoint::Holds::pedestal_and_dark || black.dark_mean_e != PerSite<double>{};
  return {{"state", name_of(dark.state)},
          {"mean_e", optional_json(dark.mean_e)},
          {"standard_error_e", optional_json(dark.standard_error_e)},
          {"subtracted", is_subtracted},
          {"alpha", optional_json(dark.alpha)},
          {"predicted_desaturation", dark.alpha ? Json(1 - *dark.alpha) : Json(nullptr)},
          {"reason", dark.reason}};
}

Json dark_json(const DarkFrame* dark) {
  if (dark == nullptr) return nullptr;
  return {{"frames", dark->frames},
          {"frames_estimated", dark->estimated},
          {"files", dark->files},
          {"is_bias", dark->is_bias},
          {"settings", dark->settings},
          {"scale", dark->scale},
          {"doubling_c", dark->doubling_c > 0 ? Json(dark->doubling_c) : Json(nullptr)},
          {"noise_share", dark->noise_fraction},
          {"pattern_share", dark->pattern_fraction},
          {"added_variance_dn2", dark->added_variance_dn2},
          {"unknown_pixels", dark->unknown.size()}};
}

Json flat_json(const calib::FlatField* flat) {
  if (flat == nullptr) return nullptr;
  return {{"frames", flat->frames},
          {"max_gain", flat->max_gain},
          {"prnu", flat->prnu},
          {"pixel_share", flat->pixel_fraction},
          {"noise_share", flat->noise}};
}

Json tag_json(const std::optional<BlackLevel>& tag) {
  if (!tag) return nullptr;
  return {{"rows", tag->rows},
          {"columns", tag->columns},
          {"pattern_dn", tag->pattern_dn},
          {"column_offsets", tag->column_dn.size()},
          {"row_offsets", tag->row_dn.size()}};
}

Json white_json(const isp::DevelopPlan& plan) {
  Json json{{"rule", plan.rendering.white_balance_rule}, {"neutral", plan.rendering.neutral}};
  if (plan.rendering.white) {
    json["cct_k"] = plan.rendering.white->cct_k;
    json["duv"] = plan.rendering.white->duv;
    json["xy"] = {plan.rendering.white->xy.x, plan.rendering.white->xy.y};
  }
  return json;
}

Json framing_json(const isp::DevelopPlan& plan) {
  if (!plan.framing) return nullptr;
  return {{"before_orientation", rect_json(plan.framing->pixels)}, {"shrunk", plan.framing->shrinks()}};
}

Json lines_json(const denoise::LineOffsets& lines) {
  return {{"lines", lines.lines == denoise::Lines::rows ? "rows" : "columns"},
          {"std_e", lines.line_std_e},
          {"residual_std_e", lines.residual_std_e}};
}

Json noise_json(const isp::NoiseReduction& noise, const std::optional<NoiseOrigin>& origin) {
  Json json{{"level", noise.level ? Json(denoise::name_of(*noise.level)) : Json("off")}, {"reason", noise.reason}};
  if (origin) json["noise_model"] = Json::parse(origin_json(*origin));
  if (!noise.snr) return json;
  json["snr"] = *noise.snr;
  json["noise_source"] = origin ? name_of(origin->source) : name_of(noise.source);
  json["variance_e2"] = noise.pixel_variance_e2();
  json["dark_mean_e"] = noise.noise.dark_mean_e;
  if (noise.noise_ratio) json["noise_ratio_range"] = ratio_range(*noise.noise_ratio);
  json["lines"] = Json::array();
  for (const denoise::LineOffsets& lines : noise.lines) json["lines"].push_back(lines_json(lines));
  return json;
}

Json demosaic_json(const isp::DemosaicPlan& plan) {
  if (plan.reason.empty()) return nullptr;
  return {{"method", name_of(plan.demosaic.method)}, {"reason", plan.reason}};
}

Json number_json(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json effects_json(const isp::DevelopPlan& plan) {
  if (!plan.effects) return nullptr;
  const isp::ProcessingGoal& choice = *plan.options.effects;
  Json json{{"mode", choice.all ? "all" : "auto"},
            {"tolerance_ciede2000", optional_json(choice.tolerance_delta_e)},
            {"budget_s", optional_json(choice.budget_s)},
            {"predicted_s", optional_json(plan.effects->predicted_s)},
            {"pace", choice.budget_s && choice.cost->pace_s > 0 ? Json(choice.cost->pace) : Json(nullptr)},
            {"effects", Json::array()}};
  for (const isp::PlannedStep& effect : plan.effects->effects) {
    json["effects"].push_back({{"name", effect.name},
                               {"ciede2000", number_json(effect.size)},
                               {"left_ciede2000", number_json(effect.left)},
                               {"used", effect.used},
                               {"decision", effect.decision},
                               {"predicted_s", optional_json(effect.seconds)}});
  }
  return json;
}

Json retina_json(const std::optional<isp::RetinaPlan>& retina) {
  if (!retina) return nullptr;
  const isp::SeeingModel& seeing = retina->seeing;
  return {{"pupil_mm", retina->pupil_mm},
          {"rod_isomerisations_per_s", retina->mean.rods},
          {"cone_isomerisations_per_s", retina->mean.cones},
          {"rod_threshold", seeing.rods.threshold},
          {"cone_threshold", seeing.cones.threshold},
          {"false_alarm_rate", seeing.false_alarm_rate},
          {"seen_fraction", optional_json(retina->seen_fraction)}};
}

Json look_json(const isp::DevelopPlan& plan) {
  if (!plan.rendering.look) return nullptr;
  const isp::LookPlan& look = *plan.rendering.look;
  const std::string& model = plan.options.look.model;
  const bool noise_known = look.noise || plan.noise_reduction.has_level();
  const std::string name = look.kind == isp::Look::model ? model : look.kind == isp::Look::eye ? "eye" : "camera";
  Json json{{"name", name}, {"noise_limit_lightness", noise_known ? optional_json(look.noise_limit) : Json(nullptr)}};
  if (look.kind == isp::Look::camera) return json;
  if (look.table) {
    json["table_mean_ciede2000"] = look.table->error.mean;
    json["table_max_ciede2000"] = look.table->error.largest;
    json["weighed_by_noise"] = look.table->by_noise;
    if (model == "shin") json["coefficients"] = coefficients_of(plan.options.look);
  }
  json["scene_luminance_cd_m2"] = look.mean_cd_m2;
  json["luminance_rule"] = look.luminance_rule;
  json["adaptation_m"] = look.state.m;
  json["mesopic_luminance_cd_m2"] = look.state.luminance_cd_m2;
  json["white_scotopic_ratio"] = look.look.scotopic_ratio_of_white;
  const isp::SceneLight* const light = plan.options.look.light.get();
  json["light"] = light != nullptr && !light->name.empty() ? Json(light->name) : Json(nullptr);
  json["light_rule"] = look.light_rule;
  json["rods_source"] = look.rods ? look.rods->source : "xyz";
  json["adaptation_degree"] = look.adaptation_degree;
  json["dimming_ev"] = look.dimming_ev;
  json["retina"] = retina_json(look.retina);
  json["effects"] = Json::array();
  if (!look.effects) return json;
  for (const isp::LookEffect& effect : *look.effects) {
    json["effects"].push_back({{"name", effect.name},
                               {"ciede2000", std::isfinite(effect.size) ? Json(effect.size) : Json(nullptr)},
                               {"shown", effect.used}});
  }
  return json;
}

Json colour_json(const CameraColour& colour) {
  static constexpr const char* sources[] = {"none", "file-tags", "decoder-table", "profile"};
  Json json{{"source", sources[static_cast<int>(colour.source)]}, {"calibrations", Json::array()}};
  for (const ColourCalibration& c : colour.calibrations) {
    json["calibrations"].push_back(
        {{"cct_k", c.cct_k}, {"xyz_to_camera", c.xyz_to_camera}, {"has_forward_matrix", c.forward.has_value()}});
  }
  json["as_shot_neutral"] = optional_json(colour.as_shot_neutral);
  if (colour.as_shot_neutral) {
    if (const auto white = isp::white_of_neutral(colour, *colour.as_shot_neutral)) json["as_shot_cct_k"] = white->cct_k;
  }
  return json;
}

const char* layout_name(SensorLayout layout) {
  static constexpr const char* names[] = {"bayer", "monochrome", "linear-rgb"};
  return names[static_cast<int>(layout)];
}

Json exposure_json(const FrameInfo& info) {
  return {{"exposure_s", optional_json(info.exposure_s)},
          {"iso", optional_json(info.iso)},
          {"f_number", optional_json(info.f_number)},
          {"focal_length_mm", optional_json(info.focal_length_mm)},
          {"temperature_c", optional_json(info.temperature_c)},
          {"saturation_luminance_cd_m2", optional_json(isp::saturation_luminance_cd_m2(info))}};
}

Json table_json(const std::optional<isp::HueSatMap>& map) {
  return map ? Json{map->hues, map->saturations, map->values} : Json(nullptr);
}

Json profile_json(const std::optional<isp::ProfileRendering>& profile) {
  if (!profile) return nullptr;
  return {{"hue_sat_map", table_json(profile->map)},
          {"look_table", table_json(profile->look)},
          {"tone_curve_points", profile->curve ? Json(profile->curve->points) : Json(nullptr)}};
}

}  // namespace

std::string develop_json(const DevelopOutcome& outcome, const Defaults& defaults) {
  if (outcome.error) return error_json(outcome.input, *outcome.error);
  if (outcome.skipped) {
    return dumped(Json{{"file", outcome.input}, {"ok", true}, {"output", outcome.output}, {"skipped", true}});
  }
  const isp::DevelopPlan& plan = *outcome.plan;
  Json json{{"file", outcome.input},
            {"ok", true},
            {"output", outcome.output},
            {"width", outcome.width},
            {"height", outcome.height},
            {"black", black_json(plan.levels.black)},
            {"saturation", Json::parse(saturation_json(plan.levels.saturation))},
            {"dark_frame", dark_json(plan.levels.dark_frame.get())},
            {"flat_frame", flat_json(outcome.flat.get())},
            {"dark", dark_charge_json(plan)},
            {"unknown_dark_fraction", optional_json(plan.dark.max_fraction)},
            {"unit", plan.levels.electrons_at_white ? "electrons" : "fraction-of-white"},
            {"white_balance", white_json(plan)},
            {"exposure", {{"ev", plan.rendering.exposure_ev}, {"rule", plan.rendering.exposure_rule}}},
            {"highlights", plan.options.highlights == isp::Highlights::clip ? "clip" : "reconstruct"},
            {"sharpen_px", optional_json(plan.sharpen_px)},
            {"local_tone", plan.options.local_tone},
            {"framing", framing_json(plan)},
            {"defects_repaired", plan.levels.defects.size()},
            {"effects", effects_json(plan)},
            {"denoise", noise_json(plan.noise_reduction, outcome.noise)},
            {"demosaic", demosaic_json(plan.demosaic)},
            {"look", look_json(plan)},
            {"camera_profile", profile_json(plan.rendering.profile)},
            {"defaults", defaults.items.empty() ? Json(nullptr) : Json(defaults_text(defaults))},
            {"warnings", plan.warnings}};
  if (plan.display) {
    const isp::DisplayTarget& display = *plan.display;
    json["display"] = {{"source_cd_m2", display.source_cd_m2},
                       {"display_cd_m2", display.display_cd_m2},
                       {"coefficients", display.coefficients},
                       {"table_mean_ciede2000", display.made.error.mean_ciede2000},
                       {"table_max_ciede2000", display.made.error.max_ciede2000}};
  }
  if (!outcome.clean_raw.empty()) json["clean_raw"] = outcome.clean_raw;
  if (outcome.merged) json["merge"] = Json::parse(merge_json(*outcome.merged));
  for (const isp::StageTime& time : outcome.times) json["timings_s"][std::string(time.stage)] = time.seconds;
  return dumped(json);
}

std::string info_json(const std::string& file, const RawFrame& frame, const std::optional<NoiseOrigin>& noise) {
  const RawDn& raw = frame.raw;
  Json json{{"file", file},
            {"ok", true},
            {"make", raw.info.make},
            {"model", raw.info.model},
            {"date_time", raw.info.date_time},
            {"layout", layout_name(raw.layout)},
            {"readout",
             {{"width", raw.row_samples() / (raw.layout == SensorLayout::linear_rgb ? 3 : 1)}, {"height", raw.rows()}}},
            {"floating_point", raw.is_float()},
            {"active", rect_json(raw.active)},
            {"default_crop", rect_json(raw.default_crop)},
            {"orientation", static_cast<int>(raw.info.orientation)},
            {"white_dn", raw.white_dn}};
  if (raw.layout == SensorLayout::bayer) json["cfa"] = calib::mosaic_of(raw);
  json["masked"] = Json::array();
  for (const Rect& r : raw.masked) json["masked"].push_back(rect_json(r));
  json["masked_is_stated"] = raw.masked_is_stated;
  const isp::MaskedBlack measured = isp::masked_black_of(frame);
  json["black"] = {{"tag", tag_json(raw.black_tag)}};
  json["black"]["measured"] = measured.black ? black_json(*measured.black) : Json(nullptr);
  if (measured.black) {
    json["black"]["region"] = rect_json(measured.region);
  } else {
    json["black"]["why_not_measured"] = measured.refusal;
  }
  json["noise_profile"] =
      frame.noise ? Json{{"scale", frame.noise->scale}, {"offset", frame.noise->offset}} : Json(nullptr);
  if (frame.noise && isp::electrons_at_white(raw, *frame.noise)) {  // of green
    const double electrons = 1 / frame.noise->scale[1];
    json["noise_profile"]["electrons_at_white"] = electrons;
    json["noise_profile"]["read_noise_e"] = std::sqrt(std::max(frame.noise->offset[1], 0.0)) * electrons;
  }
  json["noise_model"] = noise ? Json::parse(origin_json(*noise)) : Json(nullptr);
  if (frame.noise_ratio) json["noise_ratio_range"] = ratio_range(*frame.noise_ratio);
  json["exposure"] = exposure_json(raw.info);
  json["colour"] = colour_json(frame.colour);
  json["corrections"] = {{"gain_maps", frame.corrections.gain_maps.size()},
                         {"radial_gains", frame.corrections.radial_gains.size()},
                         {"named_defects", frame.corrections.defects.size()}};
  json["warnings"] = frame.warnings;
  return dumped(json);
}

std::string error_json(const std::string& file, const Error& error) {
  return dumped(Json{{"file", file}, {"ok", false}, {"error", error.message}, {"where", error.where}});
}

}  // namespace lowlux::cli
