#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "isp/cli/develop/look_args.h"
#include "isp/cli/info/advise_args.h"
#include "isp/pipeline/options.h"

namespace CLI {
class App;
}

/// Options that verbs have in common which make pictures of raw frames.

namespace lowlux::cli {

/// Dark frames: --dark-frame, --dark-noise, --dark-doubling.
struct DarkArgs {
  std::vector<std::string> words;    // files, lists separated by commas, folders, patterns; empty: none
  double noise_share = 0.1;          // most that they may add to a picture's variance in the dark
  std::optional<double> doubling_c;  // given as a number
  std::string doubling_profile;      // or as a profile's file
};

/// `develop`, and `denoise` where it has the option: what the command line asks for, checked as far as that is possible
/// without opening a file.
struct DevelopArgs {
  std::vector<std::string> inputs;
  std::string output;                  // a file, or a folder
  std::string format;                  // extension of files in an output folder, without dot
  std::optional<int> bits;             // 8, 16 or 32; absent: the format's default
  std::optional<isp::ToneCurve> tone;  // absent: standard, or none for linear spaces
  std::optional<OutputSpace> space;    // absent: srgb, or linear-srgb for OpenEXR and PFM
  bool exposure_given = false;
  isp::DevelopOptions options;  // white balance, black, half, defects, exposure
  std::string black_profile;    // a camera's profile to take black and noise from; empty: none
  std::string profile;          // to take everything from it, colour too; empty: none
  std::string gain_setting;     // of the profile; empty: by the frame's ISO
  int jpeg_quality = 92;
  int jobs = 0;  // files at a time; 0: one for each processor
  bool force = false;
  bool skip_existing = false;
  bool sync = false;  // files are on the disk before the next one is begun
  bool json = false;
  bool timings = false;
  bool explain = false;
  bool quiet = false;
  DarkArgs dark;
  LookArgs look;
  EffectsArgs effects;
};

struct InfoArgs {
  std::vector<std::string> inputs;  // may be empty with advice
  bool json = false;
  AdviseArgs advise;
};

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

/// The parsed arguments; or the exit code, help or error having been printed.
template <class Args>
using Parsed = std::variant<Args, int>;

Parsed<DevelopArgs> parse_develop(const std::vector<std::string>& words);
Parsed<DevelopArgs> parse_denoise(const std::vector<std::string>& words);
Parsed<InfoArgs> parse_info(const std::vector<std::string>& words);
Parsed<ReproduceArgs> parse_reproduce(const std::vector<std::string>& words);

/// Exposure, white balance, tone, space, half size.
void add_rendering(CLI::App& app, DevelopArgs& args);
/// What is known of the camera, and what is repaired by it.
void add_camera(CLI::App& app, DevelopArgs& args);
/// What is wrong with the options of add_camera together, or nothing.
std::optional<std::string> wrong_profiles(const DevelopArgs& args);
void add_denoise(CLI::App& app, DevelopArgs& args);
/// What picture files hold: bits, JPEG quality.
void add_samples(CLI::App& app, DevelopArgs& args);

}  // namespace lowlux::cli
