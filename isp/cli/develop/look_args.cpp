#include "isp/cli/develop/look_args.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>

#include "isp/base/file_extension.h"
#include "isp/cli/shared/option_values.h"
#include "isp/model/appearance/appearance_model.h"
#include "isp/model/vision/scene_light.h"

namespace lowlux::cli {
namespace {

constexpr double eye_noise_limit = 2;  // CIE L*

ArgumentError set_effects(const std::string& text, isp::LookChoice& choice) {
  using Which = isp::LookChoice::Which;
  if (text == "auto" || text == "all") {
    choice.which = text == "all" ? Which::all : Which::automatic;
    return std::nullopt;
  }
  choice.which = Which::listed;
  choice.listed = {false, false, false, false, false, false};
  if (text == "none") return std::nullopt;
  for (const std::string& word : split_at_commas(text)) {
    bool* const effect = isp::effect_named(choice.listed, word);
    if (effect == nullptr) {
      return fmt::format("names '{}', which is none of {}", word, fmt::join(isp::night_effect_names, ", "));
    }
    *effect = true;
  }
  return std::nullopt;
}

void add_scene(CLI::App& app, LookArgs& args) {
  add_text(
      app, "--scene-luminance", "auto|CD_M2",
      "mean luminance of the scene, for --look eye and models (default: auto, from f-number, exposure time and ISO)",
      [&args](const std::string& text) -> ArgumentError {
        args.given.emplace_back("--scene-luminance");
        args.choice.scene_luminance_cd_m2.reset();
        if (text == "auto") return std::nullopt;
        double luminance = 0;
        if (auto wrong = store_number(text, {1e-7, 1e9, "cd/m2", "is neither auto nor a luminance"}, luminance)) {
          return wrong;
        }
        args.choice.scene_luminance_cd_m2 = luminance;
        return std::nullopt;
      });
  add_text(app, "--field-of-view", "DEGREES",
           "field of view of the longer side, which determines the detail that the eye resolves (default 50)",
           [&args](const std::string& text) {
             args.given.emplace_back("--field-of-view");
             return store_number(text, {0.1, 180, "degrees", "is not an angle"}, args.choice.field_of_view_deg);
           });
}

/// Stores a lamp or an S/P; the file of a spectrum is read later.
ArgumentError set_light(const std::string& text, LookArgs& args) {
  args.choice.light.reset();
  args.light_file.clear();
  if (has_extension(text, ".csv")) {
    args.light_file = text;
    return std::nullopt;
  }
  const std::optional<double> ratio = number_of(text);
  auto light = ratio ? isp::light_of_ratio(*ratio) : isp::light_of_lamp(text);
  if (!light) return "is not valid: " + light.error().message;
  args.choice.light = std::make_shared<const isp::SceneLight>(*std::move(light));
  return std::nullopt;
}

void add_light(CLI::App& app, LookArgs& args) {
  add_text(app, "--light", "NAME|FILE.csv|S/P",
           "light of the scene, for --look eye and models: a lamp, a spectrum, or an S/P ratio from 0.1 to 60",
           [&args](const std::string& text) {
             args.given.emplace_back("--light");
             return set_light(text, args);
           });
  add_text(app, "--adaptation-degree", "auto|DEGREE",
           "degree of adaptation to the colour of the light, 0 to 1 (auto: CIE 159 with --light, else 1)",
           [&args](const std::string& text) -> ArgumentError {
             args.given.emplace_back("--adaptation-degree");
             args.choice.adaptation_degree.reset();
             if (text == "auto") return std::nullopt;
             double degree = 0;
             if (auto wrong = store_number(text, {0, 1, "", "is neither auto nor a degree"}, degree)) return wrong;
             args.choice.adaptation_degree = degree;
             return std::nullopt;
           });
}

void add_effects(CLI::App& app, LookArgs& args) {
  add_text(app, "--effects", "auto|all|none|LIST",
           fmt::format("corrections and vision effects to apply: auto (those that are visible in this image, without "
                       "glare and visual-noise), all, none, or a list of vision effects ({}) (default: auto)",
                       fmt::join(isp::night_effect_names, ", ")),
           [&args](const std::string& text) {
             args.given.emplace_back("--effects");
             return set_effects(text, args.choice);
           });
  add_text(app, "--tolerance", "DELTA_E",
           "largest change of the image by steps that --effects auto leaves out: CIEDE2000 of 8x8 block means, 95th "
           "percentile (default: 0.5)",
           [&args](const std::string& text) {
             args.given.emplace_back("--tolerance");
             return store_number(text, {1e-3, 100, "", "is not a colour difference"}, args.choice.tolerance);
           });
  add_text(app, "--dimming", "FRACTION",
           "darkness of the image, 0 (normal exposure) to 1 (as dark as the scene compared with 100 cd/m2); for "
           "automatic exposure (default: 0.4)",
           [&args](const std::string& text) {
             args.given.emplace_back("--dimming");
             return store_number(text, {0, 1, "", "is not a fraction"}, args.choice.dimming);
           });
}

}  // namespace

void add_look(CLI::App& app, LookArgs& args) {
  std::string models;
  for (const isp::AppearanceModel& model : isp::appearance_models()) {
    models += (models.empty() ? "" : ", ") + std::string(model.name);
  }
  add_text(app, "--look", "camera|eye|MODEL",
           "rendering: normal (camera, default), as an observer on site would perceive the scene (eye), or by a "
           "published model of colour appearance (" +
               models + ")",
           [&args, models](const std::string& text) -> ArgumentError {
             args.choice.model.clear();
             if (text == "camera" || text == "eye") {
               args.choice.look = text == "eye" ? isp::Look::eye : isp::Look::camera;
               return std::nullopt;
             }
             if (!isp::appearance_model_named(text)) return "is none of camera, eye, " + models;
             args.choice.look = isp::Look::model;
             args.choice.model = text;
             return std::nullopt;
           });
  add_scene(app, args);
  add_light(app, args);
  add_effects(app, args);
  add_text(app, "--noise-limit", "off|LIGHTNESS",
           "largest noise in even areas of the image, as CIE L*; noisier shadows are brightened less (default: off; "
           "with --look eye 2)",
           [&args](const std::string& text) -> ArgumentError {
             args.noise_limit_given = true;
             args.choice.noise_limit.reset();
             if (text == "off") return std::nullopt;
             double limit = 0;
             if (auto wrong = store_number(text, {1e-3, 100, "", "is neither off nor a lightness"}, limit))
               return wrong;
             args.choice.noise_limit = limit;
             return std::nullopt;
           });
  app.add_option("--coefficients", args.coefficients,
                 "coefficients of Shin's model for --look shin and --display-luminance: lines of E, alpha, beta, l, a, "
                 "m, b (default: the substitute SHIN-SUB-1)")
      ->type_name("FILE");
  add_text(
      app, "--display-luminance", "CD_M2",
      "luminance of white of a dim display, whose loss of perceived colour is compensated for (default: no change)",
      store_within({1e-3, 1e5, "cd/m2", "is not a luminance"}, args.display_cd_m2));
}

void add_seeing_map(CLI::App& app, LookArgs& args) {
  app.add_flag_callback(
      "--seeing-map",
      [&args] {
        args.given.emplace_back("--seeing-map");
        args.choice.seeing_map = true;
      },
      "with --look eye, also write OUT.seeing.pfm: the probability that an observer sees each 4x4 pixels");
}

std::optional<std::string> complete_look(const LookArgs& args, Planner planner, isp::LookChoice& choice) {
  choice = args.choice;
  if (!args.coefficients.empty() && choice.model != "shin" && !args.display_cd_m2) {
    return "--coefficients requires --look shin or --display-luminance";
  }
  constexpr std::array only_eye{"--effects", "--tolerance", "--field-of-view", "--seeing-map"};
  const bool lists =
      choice.which == isp::LookChoice::Which::listed &&
      std::ranges::any_of(isp::night_effect_names, [&](auto name) { return *isp::effect_named(choice.listed, name); });
  for (const std::string& option : args.given) {
    const bool planned = option == "--tolerance" || (option == "--effects" && !lists);
    if (planner == Planner::of_everything && planned) continue;
    const bool for_models = std::ranges::find(only_eye, option) == only_eye.end();
    if (choice.look == isp::Look::camera || (choice.look == isp::Look::model && !for_models)) {
      return option + (for_models ? " requires --look eye or a model" : " requires --look eye");
    }
  }
  if (choice.look == isp::Look::eye && !args.noise_limit_given) choice.noise_limit = eye_noise_limit;
  return std::nullopt;
}

namespace {

constexpr NumberRange budget_ms_range{1e-3, 1e9, "ms"}, budget_mpps_range{1e-3, 1e9, "MP/s"};

bool is_given(const LookArgs& look, const char* option) {
  return std::ranges::find(look.given, option) != look.given.end();
}

}  // namespace

void add_merge_budget(CLI::App& app, EffectsArgs& args) {
  add_text(app, "--budget-ms", "MS", "time limit for merging, without reading files: chooses --align and --mean",
           store_within(budget_ms_range, args.budget_ms));
}

void add_budget(CLI::App& app, EffectsArgs& args) {
  add_text(app, "--budget-ms", "MS",
           "time limit for each frame, without reading and writing files: chooses the most accurate plan that is "
           "predicted to fit, or with --tolerance the fastest within it; with --merge for merging and developing",
           store_within(budget_ms_range, args.budget_ms));
  add_text(app, "--budget-mpps", "MP_PER_S", "time limit for each frame, as a speed in megapixels per second",
           store_within(budget_mpps_range, args.budget_mpps));
  app.get_option("--budget-mpps")->excludes(app.get_option("--budget-ms"));
}

std::optional<std::string> complete_effects(const LookArgs& look, EffectsArgs& args) {
  using Which = isp::LookChoice::Which;
  const bool all = look.choice.which == Which::all;
  if (all && is_given(look, "--tolerance")) return "--tolerance requires --effects auto";
  if (all && args.budgeted()) return "a time budget requires --effects auto";
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
