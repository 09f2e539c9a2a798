#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "calib/noise/noise_figures.h"
#include "isp/base/shard.h"
#include "isp/cli/config/config_file.h"
#include "isp/cli/develop/look_args.h"
#include "isp/cli/info/advise_args.h"
#include "isp/cli/merge/merge_args.h"
#include "isp/cli/shared/option_values.h"
#include "isp/output/dng/dng_writer.h"
#include "isp/pipeline/options.h"

namespace CLI {
class App;
}

/// These options are common to verbs that make images of raw frames.

namespace lowlux::cli {

/// Holds the arguments of dark frames: --dark-frame, --bias-frame, --dark-frame-count, --dark-noise, --dark-doubling.
struct DarkArgs {
  std::vector<std::string> words;    // files, lists separated by commas, folders, patterns; empty: none
  std::vector<std::string> bias;     // --bias-frame, in the same form
  std::optional<int> count;          // exposures that each file is the mean of; absent: estimated
  double noise_fraction = 0.1;       // maximum fraction they may add to an image's variance in the dark
  std::optional<double> doubling_c;  // given as a number
  std::string doubling_profile;      // or as the file of a profile
};

/// Limits exposures [EV]: the range of the tone curve.
inline constexpr double max_exposure_ev = 12;

/// Returns the names of the compressions of DNGs, with the default first.
const Names<isp::DngCompression>& compression_names();

/// Holds the arguments of `develop`, and of `denoise` and `merge` where they have the option, checked as far as that is
/// possible without opening a file.
struct DevelopArgs {
  std::vector<std::string> inputs;
  std::string output;                  // a file, or a folder
  std::string format;                  // extension of files in an output folder, without dot
  std::optional<int> bits;             // 8, 16 or 32; absent: the format's default
  std::optional<isp::ToneCurve> tone;  // absent: standard, or none for linear spaces
  std::optional<OutputSpace> space;    // absent: srgb, or linear-srgb for OpenEXR and PFM
  bool exposure_given = false;
  bool baseline_exposure = true;             // add the source's BaselineExposure to a given exposure
  bool camera_profile = true;                // apply the tables of the profile in the source
  isp::DevelopOptions options;               // white balance, black, half, defects, exposure
  std::string black_profile;                 // a camera's profile for black and noise; empty: none
  std::string profile;                       // a camera's profile for everything, colour too; empty: none
  std::string gain_setting;                  // gain setting of the profile; empty: by the frame's ISO
  std::optional<calib::NoiseFigures> noise;  // --noise
  int jpeg_quality = 92;
  int jobs = 0;  // files at a time; 0: one for each processor
  Shard shard;   // shard of the files
  bool force = false;
  bool skip_existing = false;
  isp::DngCompression compression = isp::DngCompression::none;  // compression of the raw files written
  bool sync = false;                                            // files are flushed to disk before the next one begins
  bool json = false;
  bool timings = false;
  bool explain = false;
  bool quiet = false;
  DarkArgs dark;
  std::vector<std::string> flats;  // --flat-frame: files, lists separated by commas, folders, patterns; empty: none
  LookArgs look;
  EffectsArgs effects;
  bool merge = false;  // all inputs are frames of one scene
  MergeArgs merging;
  Defaults defaults;  // defaults of the user's file
};

/// Holds the arguments of `info`.
struct InfoArgs {
  std::vector<std::string> inputs;  // may be empty with --advise
  bool json = false;
  AdviseArgs advise;
};

/// Holds the arguments of `reproduce`.
struct ReproduceArgs {
  std::vector<std::string> experiments;  // by id; empty: all
  std::string output;                    // folder for tables, plots and the report; empty: none
  std::uint64_t seed = 1;
  bool list = false;
  bool quick = false;
  bool json = false;
  bool force = false;
  std::string pictures_folder;  // empty: next to the command
};

/// Holds the parsed arguments; or the exit code if help or an error was printed.
template <class Args>
using Parsed = std::variant<Args, int>;

/// @param contradicts  whether options cannot be combined: defaults of the user's file are then left out, see
///                     excluded_defaults
Parsed<DevelopArgs> parse_develop(const std::vector<std::string>& words,
                                  const std::function<bool(const DevelopArgs&)>& contradicts);
Parsed<DevelopArgs> parse_denoise(const std::vector<std::string>& words);
Parsed<DevelopArgs> parse_merge(const std::vector<std::string>& words);
Parsed<InfoArgs> parse_info(const std::vector<std::string>& words);
Parsed<ReproduceArgs> parse_reproduce(const std::vector<std::string>& words);

/// Adds exposure, white balance, tone, space, half size.
void add_rendering(CLI::App& app, DevelopArgs& args);
/// Adds the options of the camera's known properties and of corrections that use them.
void add_camera(CLI::App& app, DevelopArgs& args);
/// Returns the error of the options of add_camera in combination, or nothing.
std::optional<std::string> profile_option_error(const DevelopArgs& args);
/// Lists the levels of noise reduction that a command offers.
enum class NoiseLevels : std::uint8_t { off_too, at_least_draft };
/// Adds the options of noise reduction.
void add_denoise(CLI::App& app, DevelopArgs& args, NoiseLevels levels = NoiseLevels::off_too);
/// Adds the option of row and column noise.
void add_line_noise(CLI::App& app, DevelopArgs& args);
/// Adds the options of dark and bias frames, and those of flat frames.
void add_darks(CLI::App& app, DarkArgs& dark);
void add_flats(CLI::App& app, std::vector<std::string>& flats);
/// Adds the options of image files: bits, JPEG quality.
void add_samples(CLI::App& app, DevelopArgs& args);

}  // namespace lowlux::cli
