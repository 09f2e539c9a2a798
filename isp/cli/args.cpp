#include "isp/cli/args.h"

#include <CLI/CLI.hpp>

#include "isp/cli/develop_args.h"
#include "isp/cli/option_values.h"

namespace lowlux::cli {
namespace {

void add_darks(CLI::App& app, DarkArgs& dark) {
  CLI::Option* frames = app.add_option("--dark-frame", dark.words,
                                       "dark frames to subtract: files, a folder or a quoted pattern; repeatable")
                            ->type_name("FILE[,FILE...]|FOLDER")
                            ->allow_extra_args(false);
  add_text(app, "--dark-noise", "SHARE",
           "most that the dark frames may add to a picture's own variance in the dark (default 0.1)",
           [&dark](const std::string& text) -> std::optional<std::string> {
             const auto share = number_of(text);
             if (!share || !(*share > 0 && *share <= 1)) return "is no share above 0 and at most 1";
             dark.noise_share = *share;
             return std::nullopt;
           })
      ->needs(frames);
  add_text(app, "--dark-doubling", "C|PROFILE.json",
           "degrees over which dark current doubles, for darks of another temperature, or a profile that tells "
           "(default: as the darks themselves tell)",
           [&dark](const std::string& text) -> std::optional<std::string> {
             dark.doubling_c = quantity_of(text, "C");
             if (!dark.doubling_c) {
               if (!text.ends_with(".json")) return "is neither a number of degrees nor a profile (.json)";
               dark.doubling_profile = text;
             } else if (!(*dark.doubling_c >= 2 && *dark.doubling_c <= 30)) {
               return "is not within 2 to 30 degrees";
             }
             return std::nullopt;
           })
      ->needs(frames);
}

/// What every verb that takes raw files one by one has.
/// @param explained  help for --explain
void add_batch(CLI::App& app, const char* explained, DevelopArgs& args) {
  app.add_option("RAW", args.inputs, "raw files, or folders of them")->required();
  app.add_flag("--maps", args.options.denoise.maps,
               "also write what is left of the noise [e-^2] and how far colour can be believed (0 to 1), for each 2x2 "
               "cell: OUT.noise.pfm and OUT.confidence.pfm");
  app.add_flag("--skip-existing", args.skip_existing, "leave out raw files whose outputs exist")
      ->excludes(app.add_flag("--force", args.force, "overwrite files that exist"));
  app.add_flag("--sync", args.sync, "wait until each file is on the disk (fsync)");
  app.add_option("--jobs", args.jobs, "files at a time (default: one per processor, fewer if memory is short)")
      ->check(CLI::Range(1, 256));
  app.add_flag("--explain", args.explain, explained);
  app.add_flag("--json", args.json, "one JSON object for each file on stdout, as an array");
  app.add_flag("--timings", args.timings, "time of each stage");
  app.add_flag("--quiet", args.quiet, "no warnings and no progress");
}

void add_output(CLI::App& app, DevelopArgs& args) {
  app.add_option("-o,--output", args.output,
                 "picture to write (.png .jpg .tif .exr .pfm), or a folder for several (made if it ends with /)")
      ->required()
      ->type_name("OUT");
  app.add_option("--format", args.format, "format of pictures written to a folder: png (default), jpg, tif, exr or pfm")
      ->check(CLI::IsMember({"png", "jpg", "tif", "exr", "pfm"}));
  add_samples(app, args);
}

template <class Args>
Parsed<Args> parse(CLI::App& app, const std::vector<std::string>& words, const Args& args) {
  if (const auto code = parse_words(app, words)) return *code;
  return args;
}

Parsed<DevelopArgs> parse_batch(CLI::App& app, const std::vector<std::string>& words, const DevelopArgs& args) {
  Parsed<DevelopArgs> parsed = parse(app, words, args);
  const isp::DenoiseChoice& choice = args.options.denoise;
  if (std::holds_alternative<DevelopArgs>(parsed) && choice.maps && choice.mode == isp::DenoiseChoice::Mode::off) {
    return refuse(app, "--maps are of what --denoise leaves: they do not go with off");
  }
  if (std::holds_alternative<DevelopArgs>(parsed)) {
    if (const auto wrong = wrong_profiles(args)) return refuse(app, *wrong);
  }
  return parsed;
}

}  // namespace

Parsed<DevelopArgs> parse_develop(const std::vector<std::string>& words) {
  CLI::App app("Develops raw files to pictures.", "lowlux develop");
  DevelopArgs args;
  add_output(app, args);
  add_rendering(app, args);
  add_look(app, args.look);
  add_camera(app, args);
  add_denoise(app, args);
  add_darks(app, args.dark);
  add_budget(app, args.effects);
  add_batch(
      app,
      "what was decided for each file, why, and, where this machine's speed is known (bench --calibrate-cost), what "
      "it takes",
      args);
  Parsed<DevelopArgs> parsed = parse_batch(app, words, args);
  if (auto* const good = std::get_if<DevelopArgs>(&parsed)) {
    if (const auto wrong = complete_look(good->look, Planner::of_everything, good->options.look)) {
      return refuse(app, *wrong);
    }
    if (const auto wrong = complete_effects(good->look, good->effects)) return refuse(app, *wrong);
    if (good->effects.budgeted() && good->jobs > 1) {
      return refuse(app, "a budget is for one file at a time: leave --jobs out");
    }
  }
  return parsed;
}

Parsed<DevelopArgs> parse_denoise(const std::vector<std::string>& words) {
  CLI::App app("Takes noise, dark charge and defects off raw files and writes raw files for any raw developer.",
               "lowlux denoise");
  DevelopArgs args;
  app.add_option("-o,--output", args.output,
                 "raw file to write (.dng), or a folder for several (made if it ends with /)")
      ->required()
      ->type_name("CLEAN.dng");
  add_camera(app, args);
  add_denoise(app, args);
  add_darks(app, args.dark);
  add_batch(app, "what was decided for each file, and why", args);
  Parsed<DevelopArgs> parsed = parse_batch(app, words, args);
  if (args.options.denoise.mode == isp::DenoiseChoice::Mode::off && std::holds_alternative<DevelopArgs>(parsed)) {
    return refuse(app, "--denoise off leaves nothing to do: name a level, or auto");
  }
  return parsed;
}

Parsed<InfoArgs> parse_info(const std::vector<std::string>& words) {
  CLI::App app("Prints what raw files say, and what was measured on them.", "lowlux info");
  InfoArgs args;
  app.add_option("RAW", args.inputs, "raw files; with --advise one or none");
  app.add_flag("--json", args.json, "JSON instead of text");
  add_advise(app, args.advise);
  if (const auto code = parse_words(app, words)) return *code;
  const std::string wrong = wrong_advise(args.advise, args.inputs.size());
  if (!wrong.empty()) return refuse(app, wrong);
  return args;
}

Parsed<ReproduceArgs> parse_reproduce(const std::vector<std::string>& words) {
  CLI::App app("Runs the published experiments and prints each finding beside ours.", "lowlux reproduce");
  ReproduceArgs args;
  app.add_option("ID", args.experiments, "experiments (default: all); --list names them");
  app.add_flag("--list", args.list, "the experiments, one line each");
  app.add_option("-o,--output", args.output,
                 "folder, made if need be, for findings.csv, the plots' data and report.html")
      ->type_name("DIR");
  app.add_option("--pictures-folder", args.pictures_folder,
                 "where the pictures of `retargeting` are (default: testdata/pictures of the source tree)")
      ->type_name("DIR");
  app.add_flag("--quick", args.quick, "fewer samples: wider confidence intervals");
  app.add_option("--seed", args.seed, "of the random numbers (default 1)")
      ->check(CLI::NonNegativeNumber)
      ->type_name("N");
  app.add_flag("--json", args.json, "JSON instead of a table");
  app.add_flag("--force", args.force, "overwrite files that exist");
  return parse(app, words, args);
}

}  // namespace lowlux::cli
