#include "isp/cli/simulate/simulate_files.h"

#include <filesystem>
#include <string_view>
#include <system_error>
#include <vector>

#include <fmt/format.h>

#include "isp/base/file_extension.h"
#include "isp/cli/shared/outputs.h"
#include "isp/output/picture/image_writer.h"

namespace lowlux::cli {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view raw_extension = ".dng";

/// Returns the output without its extension.
std::string stem_of(const SimulateArgs& args) {
  return args.output.substr(0, args.output.size() - raw_extension.size());
}

std::string frame_file(const SimulateArgs& args, int index) {
  if (args.frames == 1 || args.output.empty()) return args.output;
  return fmt::format("{}_{:04}{}", stem_of(args), index, args.output.substr(args.output.size() - raw_extension.size()));
}

}  // namespace

bool has_truth(const SimulateArgs& args) {
  const bool black = args.scene.what == "dark" && args.scene.lamps.empty() && args.scene.stars == 0;
  return !args.no_truth && (!black || !args.truth.empty());
}

SimulateFiles files_of(const SimulateArgs& args) {
  SimulateFiles files;
  for (int i = 0; i < args.frames; ++i) files.frames.push_back(frame_file(args, i));
  if (args.output.empty()) return files;
  if (has_truth(args)) {
    files.truth = !args.truth.empty() ? args.truth : stem_of(args) + ".truth.exr";
  }
  files.truth_electrons = args.truth_electrons;
  if (args.burst.is_burst() && !args.no_truth) files.burst_truth = stem_of(args) + ".truth.json";
  return files;
}

std::string wrong_files(const SimulateArgs& args) {
  if (args.scene.what.empty()) return "SCENE is required: an image, or dark, flat, chart; --help lists the options";
  if (args.output.empty()) return "-o is required: the raw file to write";
  if (!has_extension(args.output, raw_extension))
    return fmt::format("-o: raw files are written as .dng, not as {}", args.output);
  std::vector<std::string> pictures;
  if (!args.truth.empty()) pictures.push_back(args.truth);
  if (!args.truth_electrons.empty()) pictures.push_back(args.truth_electrons);
  for (const std::string& picture : pictures) {
    const auto format = isp::format_of(picture);
    if (!format) return format.error().message;
    if (const auto fits = isp::check_writable(*format, SampleType::f32, OutputSpace::linear_srgb); !fits) {
      return fits.error().message;
    }
  }
  const SimulateFiles files = files_of(args);
  if (!files.truth.empty() && same_name(files.truth, files.truth_electrons)) {
    return fmt::format("--truth-electrons: {} is also the name of --truth", files.truth_electrons);
  }
  return {};
}

Result<void> check_output_is_free(const SimulateFiles& files, const SimulateArgs& args) {
  std::vector<std::string> all = files.frames;
  for (const std::string& truth : {files.truth, files.truth_electrons, files.burst_truth}) {
    if (!truth.empty()) all.push_back(truth);
  }
  std::erase(all, std::string());
  for (const std::string& file : all) {
    std::error_code ignored;
    if (fs::equivalent(file, args.scene.what, ignored)) {
      return fail(ErrorCode::exists, fmt::format("{} would replace the scene", file), file);
    }
    if (auto place = check_output_path(file, args.force); !place) return place;
  }
  return {};
}

}  // namespace lowlux::cli
