#include "isp/cli/develop_args.h"

#include <cmath>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "denoise/denoiser.h"
#include "isp/cli/option_values.h"
#include "isp/model/correlated_colour_temperature.h"
#include "isp/render/output_space.h"
#include "isp/render/tone.h"

namespace lowlux::cli {
namespace {

constexpr double max_exposure_ev = 12;  // the tone curve's range

Names<OutputSpace> space_names() {
  Names<OutputSpace> names;
  for (const isp::NamedOutputSpace& named : isp::output_spaces) names.emplace(named.name, named.space);
  return names;
}

std::optional<std::string> set_white_balance(const std::string& text, isp::WhiteBalanceChoice& choice) {
  using Mode = isp::WhiteBalanceChoice::Mode;
  if (text == "as-shot") {
    choice.mode = Mode::as_shot;
  } else if (text == "auto") {
    choice.mode = Mode::automatic;
  } else if (const auto kelvin = quantity_of(text, "K");
             kelvin && *kelvin >= isp::white_min_k && *kelvin <= isp::white_max_k) {
    choice = {Mode::temperature, *kelvin};
  } else {
    return fmt::format("is neither as-shot nor auto nor a temperature from {:.0f} to {:.0f} K", isp::white_min_k,
                       isp::white_max_k);
  }
  return std::nullopt;
}

// One figure for all sites or four; nullopt if it is neither.
std::optional<PerSite<double>> site_figures(const std::string& text) {
  const auto figures = numbers_of(text, 4);
  if (!figures || (figures->size() != 1 && figures->size() != 4)) return std::nullopt;
  const auto& f = *figures;
  return f.size() == 1 ? PerSite<double>{f[0], f[0], f[0], f[0]} : PerSite<double>{f[0], f[1], f[2], f[3]};
}

std::optional<std::string> set_black(const std::string& text, DevelopArgs& args) {
  isp::BlackRequest& request = args.options.black;
  static const Names<isp::BlackChoice> names{{"auto", isp::BlackChoice::automatic},
                                             {"metadata", isp::BlackChoice::metadata},
                                             {"masked", isp::BlackChoice::masked}};
  if (const auto named = names.find(text); named != names.end()) {
    request.choice = named->second;
  } else if (const auto figures = site_figures(text)) {
    request.choice = isp::BlackChoice::given;
    request.given_dn = *figures;
  } else if (text.ends_with(".json")) {
    args.black_profile = text;
  } else {
    return fmt::format("is neither {} nor one or four figures in DN nor a profile (PROFILE.json)", joined(names));
  }
  return std::nullopt;
}

std::optional<std::string> set_exposure(const std::string& text, DevelopArgs& args) {
  args.exposure_given = true;
  if (text == "auto") {
    args.options.exposure_ev.reset();
  } else if (const auto ev = quantity_of(text, "EV"); ev && std::fabs(*ev) <= max_exposure_ev) {
    args.options.exposure_ev = *ev;
  } else {
    return fmt::format("is neither auto nor a number of EV from -{} to {}", max_exposure_ev, max_exposure_ev);
  }
  return std::nullopt;
}

}  // namespace

void add_rendering(CLI::App& app, DevelopArgs& args) {
  isp::DevelopOptions& o = args.options;
  add_text(app, "--exposure", "auto|EV",
           "gain in EV; auto brings the middle of the picture to mid-grey without lifting the black noise "
           "(default: auto, in linear spaces 0)",
           [&args](const std::string& text) { return set_exposure(text, args); });
  add_text(app, "--wb", "as-shot|auto|KELVIN",
           "white balance: as the camera chose (default), estimated from the picture, or by colour temperature",
           [&o](const std::string& text) { return set_white_balance(text, o.white_balance); });
  add_choice<isp::ToneCurve>(
      app, "--tone", {{"standard", isp::ToneCurve::standard}, {"none", isp::ToneCurve::none}},
      [&args](isp::ToneCurve tone) { args.tone = tone; }, "tone curve (default: standard, in linear spaces none)");
  add_choice<OutputSpace>(
      app, "--space", space_names(), [&args](OutputSpace space) { args.space = space; },
      "what the numbers mean (default: srgb; linear-srgb for OpenEXR and PFM)");
  app.add_flag("--half", o.half, "half size: exact 2x2 binning in place of demosaicing");
}

void add_camera(CLI::App& app, DevelopArgs& args) {
  isp::DevelopOptions& o = args.options;
  add_text(app, "--black", "auto|metadata|masked|DN[,DN,DN,DN]|PROFILE.json",
           "black point: measured on masked pixels where there are any, else the file's figure (auto, default); one of "
           "the two; given in DN, for all pixels or for the four sites of the 2x2 cell; or a camera's profile, whose "
           "noise and hot pixels are used too",
           [&args](const std::string& text) { return set_black(text, args); });
  app.add_option("--profile", args.profile,
                 "a camera's profile (see calibrate): black point, noise and hot pixels, and its colour matrices if it "
                 "holds any")
      ->type_name("PROFILE.json");
  app.add_option("--gain-setting", args.gain_setting,
                 "gain setting of the profile to use: its name or an ISO (default: the raw's ISO)")
      ->type_name("SETTING");
  add_choice<bool>(
      app, "--repair", {{"auto", true}, {"off", false}}, [&o](bool repair) { o.find_defects = repair; },
      "hot and dead pixels: look for them (default), or repair only those the file names");
}

std::optional<std::string> wrong_profiles(const DevelopArgs& args) {
  if (!args.profile.empty() && !args.black_profile.empty()) {
    return "--black and --profile name a profile each: --profile uses all that is in one";
  }
  if (!args.gain_setting.empty() && args.profile.empty() && args.black_profile.empty()) {
    return "--gain-setting is one of a profile's: name the profile with --profile";
  }
  return std::nullopt;
}

void add_denoise(CLI::App& app, DevelopArgs& args) {
  isp::DenoiseChoice& choice = args.options.denoise;
  using Mode = isp::DenoiseChoice::Mode;
  choice.mode = Mode::automatic;
  Names<isp::DenoiseChoice> names{{"auto", {.mode = Mode::automatic}}, {"off", {.mode = Mode::off}}};
  for (const denoise::Level level : denoise::all_levels) {
    names.emplace(denoise::name_of(level), isp::DenoiseChoice{Mode::level, level});
  }
  add_choice<isp::DenoiseChoice>(
      app, "--denoise", names,
      [&choice](const isp::DenoiseChoice& named) {
        choice.mode = named.mode;
        choice.level = named.level;
      },
      "noise reduction, by how much work it is; auto (default) chooses by how much noise there is");
  add_choice<bool>(
      app, "--line-noise", {{"auto", true}, {"off", false}}, [&choice](bool lines) { choice.line_noise = lines; },
      "noise that whole rows or columns share: take it off where it stands out (default) or leave it");
}

void add_samples(CLI::App& app, DevelopArgs& args) {
  app.add_option("--bits", args.bits, bits_help)->check(CLI::IsMember({8, 16, 32}));
  app.add_option("--quality", args.jpeg_quality, "JPEG quality, 1 to 100 (default 92)")->check(CLI::Range(1, 100));
}

}  // namespace lowlux::cli
