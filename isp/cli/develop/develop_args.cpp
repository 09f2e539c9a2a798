#include "isp/cli/develop/develop_args.h"

#include <cmath>
#include <set>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "calib/dark/master_dark.h"
#include "denoise/denoiser.h"
#include "isp/base/file_extension.h"
#include "isp/cli/develop/image_args.h"
#include "isp/cli/noise/noise_source.h"
#include "isp/cli/shared/option_values.h"
#include "isp/render/output_space.h"
#include "isp/render/tone.h"

namespace lowlux::cli {
namespace {

/// Adds the options of every verb that takes raw files one by one.
/// @param explained  help for --explain
void add_batch(CLI::App& app, const char* explained, DevelopArgs& args) {
  app.add_option("RAW", args.inputs, "raw files, folders of them, or - for standard input")->required();
  app.add_flag("--maps", args.options.denoise.maps,
               "also write OUT.noise.pfm, the residual noise variance [e-^2], and OUT.confidence.pfm, the confidence "
               "of colours (0 to 1)");
  app.add_flag("--skip-existing", args.skip_existing, "skip raw files whose outputs exist")
      ->excludes(app.add_flag("--force", args.force, "overwrite files that exist"));
  app.add_flag("--sync", args.sync, "wait until each file is on the disk (fsync)");
  app.add_option("--jobs", args.jobs,
                 "number of files processed in parallel (default: one per processor, fewer if memory is short)")
      ->check(CLI::Range(1, 256));
  add_shard(app, "process every N-th raw file, starting with the I-th (default 1/1: all files)", args.shard);
  app.add_flag("--explain", args.explain, explained);
  app.add_flag("--json", args.json, "print one JSON object for each file on stdout, as an array");
  app.add_flag("--timings", args.timings, "print the time of each stage");
  app.add_flag("--quiet", args.quiet, "print no warnings and no progress");
}

void add_compression(CLI::App& app, DevelopArgs& args) {
  add_choice<isp::DngCompression>(
      app, "--compression", compression_names(),
      [&args](isp::DngCompression compression) { args.compression = compression; },
      "compression of the DNG (default: none)");
}

void add_output(CLI::App& app, DevelopArgs& args) {
  app.add_option(
         "-o,--output", args.output,
         "image to write (.png .jpg .tif .exr .pfm), - for standard output, or a folder (created if it ends with /)")
      ->required()
      ->type_name("OUT");
  app.add_option("--format", args.format, "format of images written to a folder or to standard output (default: png)")
      ->check(CLI::IsMember({"png", "jpg", "tif", "exr", "pfm"}));
  add_samples(app, args);
}

Parsed<DevelopArgs> parse(CLI::App& app, const std::vector<std::string>& words, DevelopArgs& args,
                          const std::set<std::string>& left_out = {}) {
  if (const auto code = parse_arguments(app, words, &args.defaults, left_out)) return *code;
  return args;
}

Parsed<DevelopArgs> parse_batch(CLI::App& app, const std::vector<std::string>& words, DevelopArgs& args,
                                const std::set<std::string>& left_out = {}) {
  Parsed<DevelopArgs> parsed = parse(app, words, args, left_out);
  const isp::DenoiseChoice& choice = args.options.denoise;
  if (std::holds_alternative<DevelopArgs>(parsed) && choice.maps && choice.mode == isp::DenoiseChoice::Mode::off) {
    return refuse(app, "--maps and --denoise off are mutually exclusive: the maps describe the denoised image");
  }
  if (std::holds_alternative<DevelopArgs>(parsed)) {
    if (const auto wrong = profile_option_error(args)) return refuse(app, *wrong);
  }
  return parsed;
}

/// Completes budget and tolerance. Returns what is wrong with them.
std::optional<std::string> complete_budget(DevelopArgs& args) {
  if (auto wrong = complete_effects(args.look, args.effects)) return wrong;
  if (args.effects.budgeted() && args.jobs > 1)
    return "--jobs cannot be combined with a time budget, which requires one file at a time";
  return std::nullopt;
}

constexpr const char *develop_summary = "Develops raw files to images.", *develop_name = "lowlux develop";

/// Adds all options of `develop`.
void add_develop(CLI::App& app, DevelopArgs& args) {
  add_output(app, args);
  add_rendering(app, args);
  add_adjustments(app, args.options);
  add_finish(app, args.options);
  add_framing(app, args.options);
  add_choice<bool>(
      app, "--baseline-exposure", {{"on", true}, {"off", false}}, [&args](bool on) { args.baseline_exposure = on; },
      "add the raw file's BaselineExposure to a given --exposure (default: on)");
  add_choice<bool>(
      app, "--camera-profile", {{"embedded", true}, {"none", false}},
      [&args](bool embedded) { args.camera_profile = embedded; },
      "apply (embedded) or ignore (none) the colour tables and the tone curve of the DNG (default: embedded; not "
      "applied in linear spaces, with --look or with a --profile that has colours)");
  add_look(app, args.look);
  add_seeing_map(app, args.look);
  add_camera(app, args);
  add_denoise(app, args);
  add_darks(app, args.dark);
  add_flats(app, args.flats);
  add_budget(app, args.effects);
  CLI::Option* const merge = app.add_flag("--merge", args.merge, "merge all raw files first, as lowlux merge does");
  add_merging(app, args.merging);
  for (const char* name :
       {"--align", "--foreground", "--drizzle", "--pixfrac", "--mean", "--reference", "--false-alarm"}) {
    app.get_option(name)->needs(merge);
  }
  add_batch(
      app, "print the decisions for each file and their reasons, and their time if bench --calibrate-cost has been run",
      args);
  app.get_option("--shard")->excludes(merge);
}

/// Returns the flags of the defaults that the arguments of `develop` exclude.
std::set<std::string> excluded_by(const std::vector<std::string>& words, const Defaults& defaults,
                                  const std::function<bool(const DevelopArgs&)>& contradicts) {
  return excluded_defaults(defaults, [&](const std::set<std::string>& left_out) {
    CLI::App app(develop_summary, develop_name);
    DevelopArgs args;
    add_develop(app, args);
    if (parse_arguments(app, words, &args.defaults, left_out)) return false;
    return profile_option_error(args) || complete_budget(args) || contradicts(args);
  });
}

/// Parses the arguments of `develop`, and prints what is wrong.
/// @param left_out  flags whose defaults are not used
Parsed<DevelopArgs> parse_develop_without(const std::set<std::string>& left_out,
                                          const std::vector<std::string>& words) {
  CLI::App app(develop_summary, develop_name);
  DevelopArgs args;
  add_develop(app, args);
  Parsed<DevelopArgs> parsed = parse_batch(app, words, args, left_out);
  if (auto* const good = std::get_if<DevelopArgs>(&parsed)) {
    if (const auto wrong = complete_look(good->look, Planner::of_everything, good->options.look)) {
      return refuse(app, *wrong);
    }
    if (const auto wrong = complete_budget(*good)) return refuse(app, *wrong);
    if (const auto wrong = settle_merging(good->merging, good->effects.budgeted())) return refuse(app, *wrong);
  }
  return parsed;
}

}  // namespace

const Names<isp::DngCompression>& compression_names() {
  static const Names<isp::DngCompression> names{{"none", isp::DngCompression::none},
                                                {"lossless", isp::DngCompression::lossless}};
  return names;
}

Parsed<DevelopArgs> parse_develop(const std::vector<std::string>& words,
                                  const std::function<bool(const DevelopArgs&)>& contradicts) {
  CLI::App app(develop_summary, develop_name);
  DevelopArgs args;
  add_develop(app, args);
  if (const auto code = parse_arguments(app, words, &args.defaults)) return *code;
  return parse_develop_without(excluded_by(words, args.defaults, contradicts), words);
}

Parsed<DevelopArgs> parse_denoise(const std::vector<std::string>& words) {
  CLI::App app("Removes noise, dark signal and defects from raw files and writes DNG files for any raw developer.",
               "lowlux denoise");
  DevelopArgs args;
  app.add_option("-o,--output", args.output,
                 "raw file to write (.dng), - for standard output, or a folder (created if it ends with /)")
      ->required()
      ->type_name("CLEAN.dng");
  add_compression(app, args);
  add_camera(app, args);
  add_denoise(app, args, NoiseLevels::at_least_draft);
  add_darks(app, args.dark);
  add_batch(app, "print the decisions for each file and their reasons", args);
  return parse_batch(app, words, args);
}

Parsed<DevelopArgs> parse_merge(const std::vector<std::string>& words) {
  CLI::App app("Merges raw files of one scene to one raw file with less noise.", "lowlux merge");
  DevelopArgs args;
  args.merge = true;
  args.options.denoise.mode = isp::DenoiseChoice::Mode::automatic;
  args.options.denoise.always = true;
  app.add_option("RAW", args.inputs, "raw files, or folders of them")->required();
  app.add_option("-o,--output", args.output, "raw file to write (.dng)")->required()->type_name("MERGED.dng");
  add_compression(app, args);
  add_merging(app, args.merging);
  add_camera(app, args);
  add_line_noise(app, args);
  add_darks(app, args.dark);
  add_flats(app, args.flats);
  add_merge_budget(app, args.effects);
  app.add_flag("--force", args.force, "overwrite the file if it exists");
  app.add_flag("--sync", args.sync, "wait until the file is on the disk (fsync)");
  app.add_flag("--explain", args.explain, "print how much of each frame was used, and why");
  app.add_flag("--json", args.json, "print one JSON object on stdout");
  app.add_flag("--timings", args.timings, "print the time of each stage");
  app.add_flag("--quiet", args.quiet, "print no warnings and no progress");
  Parsed<DevelopArgs> parsed = parse(app, words, args);
  if (auto* const good = std::get_if<DevelopArgs>(&parsed)) {
    if (const auto wrong = profile_option_error(*good)) return refuse(app, *wrong);
    if (const auto wrong = settle_merging(good->merging, good->effects.budgeted())) return refuse(app, *wrong);
    if (good->effects.budgeted()) good->effects.effects.emplace();  // the budget of each frame is part of it
  }
  return parsed;
}

Parsed<InfoArgs> parse_info(const std::vector<std::string>& words) {
  CLI::App app("Prints the metadata of raw files and measurements on them.", "lowlux info");
  InfoArgs args;
  app.add_option("RAW", args.inputs, "raw files, or folders of them; with --advise one raw file or none");
  app.add_flag("--json", args.json, "print JSON instead of text");
  add_advise(app, args.advise);
  if (const auto code = parse_arguments(app, words)) return *code;
  const std::string wrong = validate_advise(app, args.advise, args.inputs.size());
  if (!wrong.empty()) return refuse(app, wrong);
  return args;
}

Parsed<ReproduceArgs> parse_reproduce(const std::vector<std::string>& words) {
  CLI::App app("Repeats published experiments, and prints each published finding next to the result of lowlux.",
               "lowlux reproduce");
  ReproduceArgs args;
  app.add_option("ID", args.experiments, "experiments (default: all); --list names them");
  app.add_flag("--list", args.list, "list the experiments");
  app.add_option("-o,--output", args.output,
                 "folder for findings.csv, the data of the plots and report.html; created if necessary")
      ->type_name("DIR");
  app.add_option("--pictures-folder", args.pictures_folder,
                 "folder with the images of `retargeting` (default: the folder pictures next to the command)")
      ->type_name("DIR");
  app.add_flag("--quick", args.quick, "fewer samples: wider confidence intervals");
  add_seed(app, "--seed", "seed of the random numbers (default 1)", args.seed);
  app.add_flag("--json", args.json, "print JSON instead of a table");
  app.add_flag("--force", args.force, "overwrite files that exist");
  if (const auto code = parse_arguments(app, words)) return *code;
  return args;
}

namespace {

Names<OutputSpace> space_names() {
  Names<OutputSpace> names;
  for (const isp::NamedOutputSpace& named : isp::output_spaces) names.emplace(named.name, named.space);
  return names;
}

// Returns one value for all sites or four values; nullopt for other text.
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
  } else if (has_extension(text, ".json")) {
    args.black_profile = text;
  } else {
    return fmt::format("is neither {} nor one or four numbers in DN nor a profile (PROFILE.json)", joined(names));
  }
  return std::nullopt;
}

std::optional<std::string> set_exposure(const std::string& text, DevelopArgs& args) {
  args.exposure_given = true;
  const bool automatic = text.starts_with("auto");
  const std::string figure = automatic ? text.substr(4) : text;
  const bool signed_or_none = figure.empty() || figure.front() == '+' || figure.front() == '-';
  const auto ev = automatic && figure.empty() ? 0.0 : quantity_of(figure, "EV");
  if (!ev || std::fabs(*ev) > max_exposure_ev || (automatic && !signed_or_none)) {
    return fmt::format("is neither auto, nor auto with a change (auto+1, auto-0.5), nor a number of EV from -{} to {}",
                       max_exposure_ev, max_exposure_ev);
  }
  args.options.exposure_offset_ev = automatic ? *ev : 0;
  args.options.exposure_ev.reset();
  if (!automatic) args.options.exposure_ev = *ev;
  return std::nullopt;
}

}  // namespace

void add_rendering(CLI::App& app, DevelopArgs& args) {
  isp::DevelopOptions& o = args.options;
  add_text(app, "--exposure", "auto[+EV|-EV]|EV",
           "gain in EV; auto: the median becomes middle grey, less if highlights, scene luminance or noise require it; "
           "auto+1: 1 EV more (default: auto; linear spaces 0)",
           [&args](const std::string& text) { return set_exposure(text, args); });
  add_white_balance(app, o.white_balance);
  add_choice<isp::ToneCurve>(
      app, "--tone", {{"standard", isp::ToneCurve::standard}, {"none", isp::ToneCurve::none}},
      [&args](isp::ToneCurve tone) { args.tone = tone; }, "tone curve (default: standard, in linear spaces none)");
  add_choice<OutputSpace>(
      app, "--space", space_names(), [&args](OutputSpace space) { args.space = space; },
      "output colour space (default: srgb; OpenEXR and PFM linear-srgb)");
  Names<std::optional<isp::DemosaicMethod>> methods{{"auto", std::nullopt}};
  for (const isp::DemosaicMethod method : isp::all_demosaic_methods) methods.emplace(name_of(method), method);
  CLI::Option* const demosaic = add_choice<std::optional<isp::DemosaicMethod>>(
      app, "--demosaic", methods, [&o](std::optional<isp::DemosaicMethod> method) { o.demosaic = method; },
      "method of interpolating the missing colours (default: auto)");
  app.add_flag("--half", o.half, "half size: exact 2x2 binning instead of demosaicing")->excludes(demosaic);
}

void add_camera(CLI::App& app, DevelopArgs& args) {
  isp::DevelopOptions& o = args.options;
  add_text(app, "--black", "auto|metadata|masked|DN[,DN,DN,DN]|PROFILE.json",
           "black level: of masked pixels, of metadata, in DN (one value, or four in CFA order), or of a profile, with "
           "its noise and hot pixels (default: auto, masked if present, else metadata)",
           [&args](const std::string& text) { return set_black(text, args); });
  app.add_option("--profile", args.profile,
                 "camera profile of lowlux calibrate: black level, noise, hot pixels and colour matrices")
      ->type_name("PROFILE.json");
  app.add_option("--gain-setting", args.gain_setting,
                 "gain setting of the profile, by its name or ISO (default: the ISO of the raw file)")
      ->type_name("SETTING");
  add_text(app, "--noise", "GAIN,READ", "system gain [DN/e-] and read noise [e- rms] of raw files of one ISO",
           [&args](const std::string& text) -> std::optional<std::string> {
             args.noise = noise_figures_of(text);
             if (args.noise) return std::nullopt;
             return "is not GAIN,READ: 1e-6 to 1e6 DN per electron and 0 to 1e5 electrons";
           });
  add_choice<bool>(
      app, "--dark-estimate", {{"auto", true}, {"off", false}}, [&o](bool estimate) { o.estimate_dark = estimate; },
      "estimate the dark signal from long exposures if no profile and no dark frame states it, or do not subtract it "
      "(default: auto)");
  add_choice<bool>(
      app, "--repair", {{"auto", true}, {"off", false}}, [&o](bool repair) { o.find_defects = repair; },
      "search for hot and dead pixels, or repair only those that the file lists (default: auto)");
  add_choice<bool>(
      app, "--saturation-level", {{"auto", true}, {"white", false}}, [&o](bool find) { o.find_saturation = find; },
      "level at which pixels are saturated: the white level, or a lower one that is measured on the frame (default: "
      "auto)");
}

std::optional<std::string> profile_option_error(const DevelopArgs& args) {
  if (!args.profile.empty() && !args.black_profile.empty()) {
    return "--black and --profile both name a profile: use only --profile, which includes the black level";
  }
  if (!args.gain_setting.empty() && args.profile.empty() && args.black_profile.empty()) {
    return "--gain-setting selects a setting of a profile: name the profile with --profile";
  }
  return std::nullopt;
}

void add_denoise(CLI::App& app, DevelopArgs& args, NoiseLevels levels) {
  isp::DenoiseChoice& choice = args.options.denoise;
  using Mode = isp::DenoiseChoice::Mode;
  choice.mode = Mode::automatic;
  Names<isp::DenoiseChoice> names{{"auto", {.mode = Mode::automatic}}};
  if (levels == NoiseLevels::off_too) names.emplace("off", isp::DenoiseChoice{.mode = Mode::off});
  for (const denoise::Level level : denoise::all_levels) {
    names.emplace(denoise::name_of(level), isp::DenoiseChoice{Mode::level, level});
  }
  add_choice<isp::DenoiseChoice>(
      app, "--denoise", names,
      [&choice](const isp::DenoiseChoice& named) {
        choice.mode = named.mode;
        choice.level = named.level;
      },
      "noise reduction, from fastest to best; auto chooses by the visible noise (default: auto)");
  add_line_noise(app, args);
  add_choice<bool>(
      app, "--chroma-bias", {{"least-error", false}, {"none", true}},
      [&choice](bool unbiased) { choice.unbiased_chroma = unbiased; },
      "colour that noise hides: fade it for the smallest error, or preserve the mean colours of blocks of 32x32 px "
      "(default: least-error)");
}

void add_line_noise(CLI::App& app, DevelopArgs& args) {
  isp::DenoiseChoice& choice = args.options.denoise;
  add_choice<bool>(
      app, "--line-noise", {{"auto", true}, {"off", false}}, [&choice](bool lines) { choice.line_noise = lines; },
      "correct row and column noise if it is visible, or never (default: auto)");
}

void add_darks(CLI::App& app, DarkArgs& dark) {
  CLI::Option* frames =
      app.add_option("--dark-frame", dark.words,
                     "dark frames or master darks to subtract: files, a folder or a pattern; repeatable")
          ->type_name("FILE[,FILE...]|FOLDER")
          ->allow_extra_args(false);
  app.add_option(
         "--bias-frame", dark.bias,
         "bias frames: the pedestal of each pixel; with --dark-frame also used to scale darks of another exposure time")
      ->type_name("FILE[,FILE...]|FOLDER")
      ->allow_extra_args(false);
  app.add_option("--dark-frame-count", dark.count,
                 "number of frames of which each file of --dark-frame is the mean (default: estimated)")
      ->check(CLI::Range(1, calib::max_exposures))
      ->type_name("N")
      ->needs(frames);
  add_text(app, "--dark-noise", "FRACTION",
           "largest relative increase of the variance of shadows by dark subtraction (default: 0.1)",
           [&dark](const std::string& text) -> std::optional<std::string> {
             const auto share = number_of(text);
             if (!share || !(*share > 0 && *share <= 1)) return "is not a fraction above 0 and at most 1";
             dark.noise_fraction = *share;
             return std::nullopt;
           })
      ->needs(frames);
  add_text(app, "--dark-doubling", "C|PROFILE.json",
           "temperature difference that doubles the dark current, or a profile that states it, for darks of another "
           "temperature (default: measured on the darks)",
           [&dark](const std::string& text) -> std::optional<std::string> {
             dark.doubling_c = quantity_of(text, "C");
             if (!dark.doubling_c) {
               if (!has_extension(text, ".json")) return "is neither a number of degrees nor a profile (.json)";
               dark.doubling_profile = text;
             } else if (!(*dark.doubling_c >= 2 && *dark.doubling_c <= 30)) {
               return "is not within 2 to 30 degrees";
             }
             return std::nullopt;
           })
      ->needs(frames);
}

void add_flats(CLI::App& app, std::vector<std::string>& flats) {
  app.add_option("--flat-frame", flats, "flat frames, which correct vignetting and PRNU: files, a folder or a pattern")
      ->type_name("FILE[,FILE...]|FOLDER")
      ->allow_extra_args(false);
}

void add_samples(CLI::App& app, DevelopArgs& args) {
  add_bits(app, args.bits);
  app.add_option("--quality", args.jpeg_quality, "JPEG quality, 1 to 100 (default 92)")->check(CLI::Range(1, 100));
}

}  // namespace lowlux::cli
