#include "isp/cli/simulate/simulate_report.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <iterator>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "isp/base/json_text.h"
#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/report.h"
#include "isp/model/spectrum/cie_data.h"
#include "isp/model/spectrum/spectral_data.h"

namespace lowlux::cli {
namespace {

using Json = nlohmann::ordered_json;

const char* reason_of(const isp::NoiseSourceDecision& decision, isp::NoiseSourceSet wanted) {
  switch (decision.reason) {
    case isp::NoiseSourceDecision::Reason::absent:
      return decision.effect == isp::Effect::lens_blur ? "no blur, or even light" : "the sensor has none";
    case isp::NoiseSourceDecision::Reason::negligible:
      return "below the tolerance together with all other effects that are left out";
    case isp::NoiseSourceDecision::Reason::asked_for:
      return wanted.has(decision.effect) && !decision.kept ? "has no effect without dark current" : "as asked";
    case isp::NoiseSourceDecision::Reason::free:
      return "negligible, but leaving it out saves no time";
    case isp::NoiseSourceDecision::Reason::needed:
      break;
  }
  return "above the tolerance, alone or together with effects that are left out";
}

std::string effect_name(isp::Effect effect) { return std::string(isp::effect_names()[static_cast<int>(effect)]); }

Json region_json(const isp::RegionPlan& region, isp::NoiseSourceSet wanted) {
  Json decisions = Json::array();
  for (const isp::NoiseSourceDecision& d : region.decisions) {
    decisions.push_back({{"effect", effect_name(d.effect)},
                         {"kept", d.kept},
                         {"reason", reason_of(d, wanted)},
                         {"predicted_delta_e", d.alone.delta_e},
                         {"predicted_relative_variance", d.alone.relative_variance}});
  }
  return {{"darkest_e", region.darkest_e},
          {"brightest_e", region.brightest_e},
          {"glow_e", region.glow_e},
          {"blocks", region.blocks},
          {"left_out_delta_e", region.left_out_together.delta_e},
          {"left_out_relative_variance", region.left_out_together.relative_variance},
          {"effects", decisions}};
}

Json sensor_json(const isp::NamedSensor& sensor) {
  const SensorModel& m = sensor.model;
  return {{"name", m.name},
          {"gain_setting", sensor.gain_setting},
          {"source", sensor.source},
          {"camera", sensor.camera},
          {"assumptions", sensor.assumptions},
          {"system_gain_dn_per_e", m.system_gain_dn_per_e},
          {"read_noise_e", m.read_noise_e},
          {"full_well_e", m.full_well_e},
          {"bits", m.bits},
          {"black_level_dn", m.black_level_dn},
          {"white_level_dn", m.white_level_dn},
          {"dark_current_e_per_s", m.dark_current_e_per_s},
          {"dark_temperature_c", m.dark_temperature_c},
          {"dark_doubling_c", m.dark_doubling_c},
          {"dark_activation_ev", m.dark_activation_ev},
          {"dark_floor_e_per_s", m.dark_floor_e_per_s},
          {"prnu", m.prnu},
          {"dsnu", m.dsnu},
          {"hot_pixel_fraction", m.hot_pixel_fraction},
          {"hot_pixel_current_e_per_s", m.hot_pixel_current_e_per_s},
          {"telegraph_fraction", m.telegraph_fraction},
          {"telegraph_e", m.telegraph_e},
          {"crosstalk", m.crosstalk},
          {"glow_e_per_s", m.glow_e_per_s},
          {"glow_position", m.glow_position},
          {"glow_length", m.glow_length},
          {"row_noise_e", m.row_noise_e},
          {"column_noise_e", m.column_noise_e}};
}

Json cost_json(const capture::EffectCost& cost) {
  Json saved = Json::object();
  for (int i = 0; i < isp::effect_count; ++i) {
    if (cost.saved_ms[i]) saved[std::string(isp::effect_names()[i])] = *cost.saved_ms[i];
  }
  return {{"all_effects_ms", cost.all_ms}, {"saved_ms", saved}};
}

Json motion_json(const capture::RigidMotion& motion, capture::ImagePoint centre) {
  const capture::ImagePoint moved = motion.at(centre);
  return {{"dx_px", moved.x_px - centre.x_px},
          {"dy_px", moved.y_px - centre.y_px},
          {"rotation_deg", motion.rotation_deg()},
          {"centre_px", {centre.x_px, centre.y_px}}};
}

Json box_json(const capture::ImageBox& box) { return {box.left_px, box.top_px, box.right_px, box.bottom_px}; }

Json frame_json(const capture::BurstTruth& truth, const std::string& file, capture::ImagePoint centre) {
  Json movers = Json::array();
  for (const capture::ImageBox& box : truth.movers) {
    movers.push_back(
        {{"box_in_frame_0_px", box_json(box)}, {"box_px", box_json(capture::bounds_of(truth.camera_motion, box))}});
  }
  return {{"file", std::filesystem::path(file).filename().string()},
          {"exposure_s", truth.exposure_s},
          {"motion", motion_json(truth.motion, centre)},
          {"camera_motion", motion_json(truth.camera_motion, centre)},
          {"movers", movers}};
}

}  // namespace

std::string explain_text(const SimulateArgs& args, const SimulateOutcome& outcome) {
  const isp::NoiseSourcePlan& plan = *outcome.plan;
  std::string text;
  auto out = std::back_inserter(text);
  for (const isp::RegionPlan& region : plan.regions) {
    const std::string glow = region.glow_e > 0 ? fmt::format(", glow up to {:.3g} e-", region.glow_e) : "";
    fmt::format_to(out, "{} blocks of {:.3g} to {:.3g} e-{}\n", region.blocks, region.darkest_e, region.brightest_e,
                   glow);
    fmt::format_to(out, "  {:<15} {:>10} {:>12}  {:<9} {}\n", "effect", "delta E", "variance", "decision", "because");
    for (const isp::NoiseSourceDecision& d : region.decisions) {
      fmt::format_to(out, "  {:<15} {:>10.3g} {:>12.3g}  {:<9} {}\n", effect_name(d.effect), d.alone.delta_e,
                     d.alone.relative_variance, d.kept ? "simulate" : "leave out",
                     reason_of(d, args.options.effects.effects));
    }
    fmt::format_to(out, "  {:<15} {:>10.3g} {:>12.3g}  of {:g} and {:g} tolerated\n", "left out",
                   region.left_out_together.delta_e, region.left_out_together.relative_variance, plan.tolerance.delta_e,
                   plan.tolerance.relative_variance);
  }
  if (!outcome.cost) return text;
  fmt::format_to(out, "time on one thread, measured on 128 rows: all effects {:.1f} ms per frame\n",
                 outcome.cost->all_ms);
  for (int i = 0; i < isp::effect_count; ++i) {
    if (!outcome.cost->saved_ms[i]) continue;
    fmt::format_to(out, "  without {:<15} {:>8.1f} ms less\n", isp::effect_names()[i], *outcome.cost->saved_ms[i]);
  }
  return text;
}

std::string simulate_text(const SimulateArgs& args, const SimulateOutcome& o) {
  const SensorModel& m = o.sensor.model;
  std::string text;
  auto out = std::back_inserter(text);
  fmt::format_to(out, "{}\n  sensor          {}{}{}, {:g} DN/e-, read noise {:g} e-, {:.0f} e- at white, {} bits\n",
                 one_line(o.files.front()), m.name, o.sensor.gain_setting.empty() ? "" : " ", o.sensor.gain_setting,
                 m.system_gain_dn_per_e, m.read_noise_e, isp::saturation_charge_e(m), m.bits);
  for (const std::string& assumption : o.sensor.assumptions) {
    fmt::format_to(out, "  assumed         {} (no published value)\n", assumption);
  }
  fmt::format_to(out, "  exposure        {:g} s at f/{:g}, {:g} C; white {:g} cd/m2{}\n", args.options.exposure.time_s,
                 args.options.f_number, args.options.exposure.temperature_c, o.white_cd_m2,
                 o.saturation_cd_m2 ? fmt::format(", saturates at {:.3g} cd/m2 of D65", *o.saturation_cd_m2) : "");
  for (std::size_t i = 1; i < o.files.size(); ++i) fmt::format_to(out, "  also            {}\n", one_line(o.files[i]));
  return text;
}

std::string simulate_json(const SimulateArgs& args, const SimulateOutcome& o) {
  Json regions = Json::array();
  for (const isp::RegionPlan& region : o.plan->regions)
    regions.push_back(region_json(region, args.options.effects.effects));
  Json json{{"files", o.files},
            {"sensor", sensor_json(o.sensor)},
            {"exposure_s", args.options.exposure.time_s},
            {"temperature_c", args.options.exposure.temperature_c},
            {"f_number", args.options.f_number},
            {"lens_blur_px", args.options.lens_blur_px},
            {"white_luminance_cd_m2", o.white_cd_m2},
            {"seed", args.options.seed},
            {"tolerance",
             {{"delta_e", o.plan->tolerance.delta_e}, {"relative_variance", o.plan->tolerance.relative_variance}}},
            {"regions", regions},
            {"warnings", o.warnings}};
  if (o.saturation_cd_m2) json["saturation_luminance_cd_m2"] = *o.saturation_cd_m2;  // of D65
  if (o.cost) json["cost"] = cost_json(*o.cost);
  for (const isp::StageTime& time : o.times) json["times_s"][time.stage] = time.seconds;
  return json_text(json, 2);
}

std::string simulate_list() {
  std::string text =
      "sensors, with their gain settings and the options that must be given if no source states the value\n(--iso or "
      "--white-luminance in place of --pixel-pitch and --peak-qe)\n";
  auto out = std::back_inserter(text);
  for (const std::string_view name : isp::sensor_names()) {
    std::vector<std::string> settings;
    for (const std::string_view gain : isp::gain_settings(name)) {
      const auto needed = isp::options_needed(name, gain);
      settings.push_back(fmt::format("{}{}{}", gain, gain.empty() || needed.empty() ? "" : " ",
                                     needed.empty() ? "" : fmt::format("(needs {})", fmt::join(needed, ", "))));
    }
    fmt::format_to(out, "  {:<26} {}\n", name, fmt::join(settings, "; "));
  }
  fmt::format_to(out, "lights\n");
  for (const std::string_view name : isp::light_names()) fmt::format_to(out, "  {}\n", name);
  fmt::format_to(out, "cameras\n");
  for (const std::string_view name : isp::camera_names()) fmt::format_to(out, "  {}\n", name);
  return text;
}

std::string simulate_list_json() {
  Json sensors = Json::array();
  for (const std::string_view name : isp::sensor_names()) {
    Json settings = Json::array();
    for (const std::string_view gain : isp::gain_settings(name)) {
      settings.push_back({{"gain_setting", gain}, {"options_needed", isp::options_needed(name, gain)}});
    }
    sensors.push_back({{"name", name}, {"gain_settings", settings}});
  }
  return Json{{"sensors", sensors}, {"lights", isp::light_names()}, {"cameras", isp::camera_names()}}.dump(2);
}

std::string burst_truth_json(const SimulateArgs& args, const capture::BurstSource& source,
                             const std::vector<std::string>& files) {
  const capture::ImageSize size = source.size();
  const capture::ImagePoint centre{0.5 * (size.width_px - 1), 0.5 * (size.height_px - 1)};
  const capture::BurstOptions& options = args.burst.options;
  const Json head{{"width", size.width_px},
                  {"height", size.height_px},
                  {"seed", args.options.seed},
                  {"reduction", options.reduction ? Json(*options.reduction) : Json()},
                  {"horizon_px", options.horizon_px ? Json(*options.horizon_px) : Json()}};
  // Lines of their own keep a file of many frames and stars readable, and bound the memory that it takes.
  std::string text = head.dump();
  text.pop_back();
  text += ",\n\"frames\": [\n";
  for (std::size_t i = 0; i < files.size(); ++i) {
    const capture::BurstTruth truth = source.truth(static_cast<std::uint32_t>(i));
    text += json_text(frame_json(truth, files[i], centre));
    text += i + 1 < files.size() ? ",\n" : "\n";
  }
  text += "],\n\"points_of_frame_0\": [\n";
  auto out = std::back_inserter(text);
  const char* separator = "";
  for (const capture::BurstPoint& p : source.points(0)) {
    fmt::format_to(out, R"({}{{"x_px":{},"y_px":{},"signal_e":[{},{},{}],"spread_px":{}}})", separator, p.place.x_px,
                   p.place.y_px, p.signal_e[0], p.signal_e[1], p.signal_e[2], p.spread_px);
    separator = ",\n";
  }
  return text + "\n]}\n";
}

}  // namespace lowlux::cli
