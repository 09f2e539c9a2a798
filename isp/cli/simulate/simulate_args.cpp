#include "isp/cli/simulate/simulate_args.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "isp/base/text.h"
#include "isp/cli/shared/option_values.h"
#include "isp/cli/shared/sensor_options.h"

namespace lowlux::cli {
namespace {

/// Returns an integer from min_side to max_side; 0 for other text.
int side_of(const std::string& text) {
  const double side = number_of(text).value_or(0);
  return side >= min_side && side <= max_side && side == std::floor(side) ? static_cast<int>(side) : 0;
}

ArgumentError set_size(const std::string& text, SceneArgs& scene) {
  const std::size_t x = std::min(text.find('x'), text.size());
  scene.size_given = true;
  scene.width = side_of(text.substr(0, x));
  scene.height = side_of(text.substr(std::min(x + 1, text.size())));
  if (scene.width == 0 || scene.height == 0) {
    return fmt::format("is not WIDTHxHEIGHT of {} to {} pixels, which raw developers can read", min_side, max_side);
  }
  if (static_cast<double>(scene.width) * scene.height > capture::max_scene_pixels) return "has more than 2^28 pixels";
  return std::nullopt;
}

ArgumentError add_lamp(const std::string& text, SceneArgs& scene) {
  const auto words = split_at_commas(text);
  constexpr const char* expected = "is not X,Y,LIGHT,LUMINANCE with a luminance of 0 to 1e12 cd/m2";
  if (words.size() != 4) return expected;
  const auto x = number_of(words[0]), y = number_of(words[1]), luminance = number_of(words[3]);
  if (!x || !y || !luminance || std::fabs(*x) > 1e6 || std::fabs(*y) > 1e6 || *luminance < 0 || *luminance > 1e12) {
    return expected;
  }
  scene.lamps.push_back({*x, *y, words[2], *luminance});
  return std::nullopt;
}

std::string no_effect(const std::string& word) {
  const auto names = isp::effect_names();
  const auto near = near_matches(word, names);
  return fmt::format("contains '{}', which is none of auto, all, none, {}{}", word, fmt::join(names, ", "),
                     near.empty() ? "" : fmt::format("; near it: {}", fmt::join(near, ", ")));
}

/// Parses auto, all, none, or a list of names: photon-noise,dark-current... or all but some: all,-prnu or -prnu.
ArgumentError set_effects(const std::string& text, capture::NoiseSourceChoice& choice) {
  if (text == "auto") {
    choice.tolerance = choice.tolerance.value_or(isp::Tolerance{});
    return std::nullopt;
  }
  const auto names = isp::effect_names();
  isp::NoiseSourceSet effects = text.starts_with('-') ? isp::NoiseSourceSet::all() : isp::NoiseSourceSet();
  isp::NoiseSourceSet named;
  for (std::string word : split_at_commas(text)) {
    const bool without = word.starts_with('-');
    if (without) word.erase(0, 1);
    const auto found = std::find(names.begin(), names.end(), word);
    if (word == "auto") return "contains auto, which decides on every effect and cannot be combined";
    if (word == "all" && !without) {
      effects = isp::NoiseSourceSet::all();
    } else if (word == "none" && !without) {
      effects = named = {};
    } else if (found != names.end()) {
      const auto effect = static_cast<isp::Effect>(found - names.begin());
      effects = without ? effects.without(effect) : effects.with(effect);
      named = without ? named.without(effect) : named.with(effect);
    } else {
      return no_effect(word);
    }
  }
  // DSNU without dark current is left out silently from all effects, but is an error if it is named.
  if (named.has(isp::Effect::dsnu) && !effects.has(isp::Effect::dark_current)) {
    return "names dsnu without dark-current: dsnu multiplies the dark current";
  }
  choice.tolerance.reset();
  choice.effects = effects;
  return std::nullopt;
}

ArgumentError set_tolerance(const std::string& text, isp::Tolerance& tolerance) {
  const auto numbers = numbers_of(text, 2);
  if (!numbers || (*numbers)[0] <= 0 || (numbers->size() == 2 && (*numbers)[1] <= 0)) {
    return "is not a positive DELTA_E or DELTA_E,RELATIVE_VARIANCE";
  }
  tolerance.delta_e = (*numbers)[0];
  if (numbers->size() == 2) tolerance.relative_variance = (*numbers)[1];
  return std::nullopt;
}

void add_scene(CLI::App& app, SceneArgs& s) {
  app.add_option("SCENE", s.what,
                 "an image (PNG, JPEG, TIFF, OpenEXR, PFM, PPM), or dark, flat, chart, chart:macbeth, chart:munsell, "
                 "or chart:FILE.csv with reflectances by wavelength")
      ->type_name("");
  add_text(app, "--size", "WxH", "size of a scene that is not an image (default 1200x800)",
           [&s](const std::string& text) { return set_size(text, s); });
  add_text(app, "--light", "NAME|FILE.csv",
           "light of charts and flats: a CIE illuminant or a lamp (--list), or a table file (default D65)",
           [&s](const std::string& text) -> ArgumentError {
             s.light = text;
             s.light_given = true;
             return std::nullopt;
           });
  add_number(app, "--luminance", "CD_M2",
             "luminance of a white diffuser in the scene, or of white in an image (default 1, or the value that the "
             "image states)",
             [&s](double value) {
               s.luminance_cd_m2 = value;
               s.luminance_given = true;
             });
  app.add_option("--stars", s.stars, "number of stars to add")->check(CLI::Range(0, 1000000))->type_name("N");
  add_number(app, "--star-luminance", "CD_M2",
             "luminance of the faintest star, its light spread over one pixel (default: a tenth of --luminance)",
             [&s](double value) { s.star_luminance_cd_m2 = value; });
  add_text(app, "--lamp", "X,Y,LIGHT,CD_M2",
           "add a distant lamp at a pixel, its light spread over one pixel; repeatable",
           [&s](const std::string& text) { return add_lamp(text, s); })
      ->allow_extra_args(false)
      ->trigger_on_parse();
}

void add_figures(CLI::App& app, SimulateArgs& args) {
  const char* const group = "Sensor figures";
  isp::SensorFigures& f = args.figures;
  add_sensor_figures(app, group, f, args.optics.white_luminance_cd_m2);
  const auto figure = [&](const std::string& flag, const std::string& type, const std::string& help,
                          std::optional<double>& out) {
    add_number(app, flag, type, help, [&out](double value) { out = value; })->group(group);
  };
  figure("--black-level", "DN", "black level (pedestal)", f.black_level_dn);
  figure("--white-level", "DN", "white level (largest code)", f.white_level_dn);
  const auto not_negative = [&](const std::string& flag, const std::string& type, const std::string& help,
                                std::optional<double>& out) {
    add_text(app, flag, type, help, [&out](const std::string& text) -> ArgumentError {
      out = number_of(text);
      return out && *out >= 0 ? ArgumentError() : "is not a number of at least 0";
    })->group(group);
  };
  figure("--dark-temperature", "C", "temperature at which --dark-current is stated", f.dark_temperature_c);
  figure("--dark-doubling", "C", "temperature difference over which the dark current doubles", f.dark_doubling_c);
  not_negative("--dark-activation", "EV", "activation energy of an Arrhenius law, which replaces --dark-doubling",
               f.dark_activation_ev);
  not_negative("--dark-floor", "E_PER_S", "part of the dark current that does not depend on temperature",
               f.dark_floor_e_per_s);
  figure("--prnu", "RATIO", "photo response non-uniformity", f.prnu);
  figure("--dsnu", "RATIO", "dark signal non-uniformity, relative to the dark current", f.dsnu);
  figure("--hot-pixels", "RATIO", "fraction of pixels that are hot", f.hot_pixel_fraction);
  figure("--hot-current", "E_PER_S", "mean dark current of hot pixels", f.hot_pixel_current_e_per_s);
  figure("--telegraph-pixels", "RATIO", "fraction of pixels with random telegraph noise", f.telegraph_fraction);
  figure("--telegraph-noise", "E", "mean difference of the two levels of random telegraph noise in electrons",
         f.telegraph_e);
  figure("--crosstalk", "RATIO", "fraction of a pixel's light that each of four neighbours collects", f.crosstalk);
  figure("--glow", "E_PER_S", "amplifier glow: additional dark current at its source", f.glow_e_per_s);
  add_text(app, "--glow-position", "X,Y",
           "position of the source of the glow, in widths and heights (default 1,1: lower right corner)",
           [&f](const std::string& text) -> ArgumentError {
             const auto n = numbers_of(text, 2);
             if (!n || n->size() != 2) return "is not two numbers";
             f.glow_position = {(*n)[0], (*n)[1]};
             return std::nullopt;
           })
      ->group(group);
  figure("--glow-length", "RATIO", "distance over which the glow falls by a factor e, in diagonals (default 0.1)",
         f.glow_length);
  figure("--row-noise", "E", "row noise, standard deviation in electrons", f.row_noise_e);
  figure("--column-noise", "E", "column noise, standard deviation in electrons", f.column_noise_e);
  add_choice<Quantisation>(
      app, "--quantise", {{"round", Quantisation::round}, {"floor", Quantisation::floor}},
      [&f](Quantisation q) { f.quantisation = q; }, "how the converter rounds to codes")
      ->group(group);
}

void add_camera(CLI::App& app, SimulateArgs& args) {
  capture::SyntheticOptions& o = args.options;
  app.add_option("--sensor", args.sensor, "sensor by name (--list; default ELD_NikonD850)")->type_name("NAME");
  app.add_option("--gain", args.gain, "gain setting of the sensor, as ISO 1600 or its number")->type_name("SETTING");
  app.add_option("--camera", args.figures.camera,
                 "camera whose spectral sensitivities are used (--list; default: the sensor's own or a substitute)")
      ->type_name("NAME");
  add_number(app, "--exposure", "S", "exposure time (default 0.1)", [&o](double s) { o.exposure.time_s = s; });
  add_number(app, "--f-number", "f/N", "f-number of the lens (default 2)",
             [&args](double n) { args.optics.f_number = n; });
  add_number(app, "--lens-blur", "PX", "standard deviation of the blur of the lens, 0 to 10 (default 0)",
             [&o](double px) { o.lens_blur_px = px; });
  add_number(app, "--temperature", "C", "of the sensor (default 20)", [&o](double c) { o.exposure.temperature_c = c; });
  add_choice<BayerPhase>(
      app, "--cfa",
      {{"rggb", BayerPhase::rggb}, {"grbg", BayerPhase::grbg}, {"gbrg", BayerPhase::gbrg}, {"bggr", BayerPhase::bggr}},
      [&o](BayerPhase phase) { o.phase = phase; }, "Bayer pattern (default rggb)");
  app.add_option("--masked-columns", o.masked_columns,
                 "light-shielded columns left of the image (an even number; default 0)")
      ->type_name("N");
}

void add_work(CLI::App& app, SimulateArgs& args, std::optional<int>& frames) {
  capture::SyntheticOptions& o = args.options;
  add_text(app, "--effects", "auto|all|none|LIST",
           "noise sources to simulate: those that matter in the scene (auto), all, none, or a list of names; -prnu is "
           "all except PRNU (default: auto; with --sampling published all)",
           [&args](const std::string& text) {
             args.effects = text;
             return set_effects(text, args.options.effects);
           });
  add_choice<capture::PhotonSampling>(
      app, "--sampling",
      {{"physical", capture::PhotonSampling::physical}, {"published", capture::PhotonSampling::published}},
      [&o](capture::PhotonSampling sampling) { o.sampling = sampling; },
      "Poisson draws of photons: one for each pixel (physical, default), or one for each wavelength as in the thesis "
      "(published)");
  add_seed(app, "--seed",
           "seed of noise, stars and motion (default 1); darks and lights with independent noise need different seeds",
           o.seed);
  add_seed(app, "--sensor-seed", "seed of the fixed pattern of the sensor (default 1)", o.sensor_seed);
  app.add_option("--frames", frames,
                 "number of frames, written as OUT_0000.dng, OUT_0001.dng... (default 1, or one for each exposure of "
                 "--bracket)")
      ->check(CLI::Range(1, 10000))
      ->type_name("N");
  app.add_flag("--explain", args.explain,
               "print for each noise source the predicted change, the decision and the time saved");
}

void add_files(CLI::App& app, SimulateArgs& args) {
  app.add_option("-o,--output", args.output, "raw file to write (.dng)")->type_name("OUT.dng");
  auto* truth = app.add_option("--truth", args.truth,
                               "file of the noise-free linear scene, in which 1 is --luminance (.exr, .pfm, .tif; "
                               "default: OUT.truth.exr; none for dark)")
                    ->type_name("FILE");
  app.add_flag("--no-truth", args.no_truth, "do not write the noise-free reference")->excludes(truth);
  app.add_option("--truth-electrons", args.truth_electrons,
                 "also write the noise-free electrons of R, G and B of each pixel to this file (.exr, .pfm, .tif)")
      ->type_name("FILE");
  app.add_flag("--list", args.list, "list the sensors, lights and cameras");
  app.add_flag("--force", args.force, "overwrite files that exist");
  app.add_flag("--json", args.json, "print one JSON object on stdout");
  app.add_flag("--timings", args.timings, "print the time of each stage");
  app.add_flag("--quiet", args.quiet, "print no warnings and no progress");
}

}  // namespace

Parsed<SimulateArgs> parse_simulate(const std::vector<std::string>& words) {
  CLI::App app("Simulates raw files of scenes with a known noise-free reference.", "lowlux simulate");
  SimulateArgs args;
  args.options.exposure.time_s = 0.1;
  args.options.effects.tolerance = isp::Tolerance{};
  std::optional<isp::Tolerance> tolerance;
  add_scene(app, args.scene);
  add_files(app, args);
  add_camera(app, args);
  std::optional<int> frames;
  add_work(app, args, frames);
  add_text(app, "--tolerance", "DE[,VARIANCE]",
           "largest change by noise sources that --effects auto leaves out: CIEDE2000 of 32x32 block means, relative "
           "variance of blocks (default 0.5,0.05)",
           [&tolerance](const std::string& text) { return set_tolerance(text, tolerance.emplace()); });
  add_burst(app, args.burst);
  add_figures(app, args);
  if (const auto code = parse_arguments(app, words)) return *code;
  if (tolerance) {
    if (!args.options.effects.tolerance) return refuse(app, "--tolerance: it is for --effects auto, not for a list");
    args.options.effects.tolerance = tolerance;
  }
  if (args.effects.empty() && args.options.sampling == capture::PhotonSampling::published) {
    args.options.effects.tolerance.reset();  // the planner supports physical photons only
  }
  args.options.f_number = args.optics.f_number;
  if (const auto good = complete_burst(args.burst, args.scene.what, frames); !good) {
    return refuse(app, good.error().message);
  }
  args.frames = frames.value_or(1);
  args.scene.reduction = args.burst.options.reduction.value_or(1);
  return args;
}

}  // namespace lowlux::cli
