#include "isp/cli/shared/outputs.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/noise_maps.h"
#include "isp/cli/shared/raw_files.h"
#include "isp/cli/shared/standard_streams.h"
#include "isp/render/output_space.h"

namespace lowlux::cli {
namespace {

namespace fs = std::filesystem;
using isp::FileFormat;

bool same_file(const std::string& a, const std::string& b) {
  std::error_code ignored;
  return fs::equivalent(a, b, ignored);
}

int default_bits(FileFormat format, OutputSpace space) {
  switch (format) {
    case FileFormat::png:
    case FileFormat::jpeg:
      return 8;
    case FileFormat::tiff:
      return space == OutputSpace::camera || space == OutputSpace::xyz ? 32 : 16;
    case FileFormat::pfm:
      return 32;
    case FileFormat::exr:
      break;
  }
  return 16;
}

SampleType sample_type_of(FileFormat format, int bits) {
  if (format == FileFormat::exr || bits == 32) return SampleType::f32;
  return bits == 16 ? SampleType::u16 : SampleType::u8;
}

Result<std::vector<std::string>> inputs_of(const DevelopArgs& args) {
  std::vector<std::string> out;
  for (const std::string& input : args.inputs) {
    auto files = raw_files_of(input, args.quiet);
    if (!files) return files;
    out.insert(out.end(), files->begin(), files->end());
  }
  return out;
}

tl::unexpected<Error> written_twice(const std::string& output, const std::string& first, const std::string& second) {
  if (same_file(first, second)) {
    return fail(ErrorCode::invalid_argument, fmt::format("{} is given twice", second), "RAW");
  }
  return fail(
      ErrorCode::invalid_argument,
      fmt::format("{} would be written twice, from {} and from {}: process them in separate runs with separate folders",
                  output, first, second),
      "-o");
}

/// Returns the name of an input without folder and extension, and the extension without its dot.
std::pair<std::string, std::string> name_and_extension(const std::string& input) {
  if (is_standard_stream(input)) return {"stdin", ""};
  const fs::path path(input);
  return {path.stem().string(), path.has_extension() ? path.extension().string().substr(1) : ""};
}

/// Names the outputs of inputs in a folder, without extension.
class OutputNames {
 public:
  explicit OutputNames(const std::vector<std::string>& inputs) {
    for (const std::string& input : inputs) {
      const auto [name, extension] = name_and_extension(input);
      extensions_[name].insert(extension);
    }
  }

  /// Returns the name of the input, followed by its extension if there are inputs of that name with others.
  std::string of(const std::string& input) const {
    const auto [name, extension] = name_and_extension(input);
    return extension.empty() || extensions_.at(name).size() == 1 ? name : name + "_" + extension;
  }

 private:
  std::map<std::string, std::set<std::string>> extensions_;  // by name
};

void print_extended_names(const std::vector<Job>& jobs) {
  const auto extended = std::ranges::find_if(
      jobs, [](const Job& job) { return fs::path(job.output).stem() != name_and_extension(job.input).first; });
  if (extended == jobs.end()) return;
  print_err(one_line(fmt::format("lowlux: raw files of one name have outputs named with their extensions, such as {}",
                                 extended->output)) +
            "\n");
}

}  // namespace

bool names_folder(const DevelopArgs& args) {
  if (is_standard_stream(args.output)) return false;
  std::error_code ignored;
  return args.output.ends_with('/') || fs::is_directory(args.output, ignored);
}

Result<FileFormat> format_of_output(const DevelopArgs& args, const std::string& output) {
  if (!is_standard_stream(output)) return isp::format_of(output);
  return isp::format_of("-." + (args.format.empty() ? "png" : args.format));
}

Result<std::vector<Job>> plan_outputs(const DevelopArgs& args, const std::string& extension) {
  const bool folder = names_folder(args);
  const auto inputs = inputs_of(args);
  if (!inputs) return tl::make_unexpected(inputs.error());
  if (inputs->size() > 1 && !folder) {
    return fail(ErrorCode::invalid_argument,
                fmt::format("{} raw files need a folder as output: '{}/'", inputs->size(),
                            is_standard_stream(args.output) ? "FOLDER" : args.output),
                "-o");
  }
  if (const auto wrong = stream_error(args)) return fail(ErrorCode::invalid_argument, *wrong);
  std::vector<Job> jobs;
  const OutputNames names(*inputs);
  std::map<std::string, std::string> input_of;  // by file that is written
  for (const std::string& input : *inputs) {
    std::string output = args.output;
    if (folder) {
      const std::string ending = "." + (args.format.empty() ? extension : args.format);
      output = (fs::path(args.output) / names.of(input)).string() + ending;
    }
    std::vector<std::string> files{output};
    if (args.options.denoise.maps) {
      for (std::string& map : noise_map_names(output)) files.push_back(std::move(map));
    }
    for (const std::string& file : files) {
      const auto [first, is_new] = input_of.emplace(file, input);
      if (!is_new) return written_twice(file, first->second, input);
    }
    if (!is_standard_stream(input) && !is_standard_stream(output) && same_file(input, output)) {
      return fail(ErrorCode::invalid_argument, fmt::format("the output would replace the input {}", input), "-o");
    }
    jobs.push_back({input, output});
  }
  if (folder && !args.quiet) print_extended_names(jobs);
  return jobs;
}

Result<void> check_unharmed(const std::vector<Job>& jobs, const std::vector<std::string>& read) {
  std::set<std::string> checked;  // all frames of a merge have one output
  for (const Job& job : jobs) {
    if (!checked.insert(job.output).second) continue;
    for (const std::string& file : read) {
      if (!file.empty() && (job.output == file || same_file(job.output, file))) {
        return fail(ErrorCode::invalid_argument, fmt::format("{} would replace a file that is read", job.output), "-o");
      }
    }
  }
  return {};
}

Result<PictureKind> picture_kind(FileFormat format, std::optional<int> bits, std::optional<OutputSpace> space) {
  const bool linear = format == FileFormat::exr || format == FileFormat::pfm;
  PictureKind kind;
  kind.space = space.value_or(linear ? OutputSpace::linear_srgb : OutputSpace::srgb);
  const int depth = bits.value_or(default_bits(format, kind.space));
  if (format == FileFormat::exr && depth == 8)
    return fail(ErrorCode::invalid_argument, "OpenEXR has 16 or 32 bits", "--bits");
  kind.samples = sample_type_of(format, depth);
  if (const auto fits = isp::check_writable(format, kind.samples, kind.space); !fits) {
    const bool space_is_wrong = isp::supported(format, kind.samples) && space;
    return fail(fits.error().code, fits.error().message, space_is_wrong ? "--space" : "--bits");
  }
  return kind;
}

Result<isp::DevelopOptions> complete_options(const DevelopArgs& args, FileFormat format) {
  isp::DevelopOptions o = args.options;
  const Result<PictureKind> kind = picture_kind(format, args.bits, args.space);
  if (!kind) return tl::make_unexpected(kind.error());
  o.space = kind->space;
  o.samples = kind->samples;
  o.tone = args.tone.value_or(is_linear(o.space) ? isp::ToneCurve::none : isp::ToneCurve::standard);
  if (!args.exposure_given && is_linear(o.space)) o.exposure_ev = 0;
  if (args.look.display_cd_m2 && (o.space != OutputSpace::srgb || o.samples == SampleType::f32)) {
    return fail(ErrorCode::invalid_argument, "makes sRGB images of 8 or 16 bits", "--display-luminance");
  }
  if (const auto fits = isp::check_options(o); !fits) return tl::make_unexpected(fits.error());
  return o;
}

bool options_contradict(const DevelopArgs& args) {
  const Result<FileFormat> format = format_of_output(args, names_folder(args) ? "-" : args.output);
  if (!format || !picture_kind(*format, args.bits, args.space)) return false;
  DevelopArgs completed = args;
  const auto wrong = complete_look(args.look, Planner::of_everything, completed.options.look);
  return !wrong && !complete_options(completed, *format);
}

namespace fs = std::filesystem;

Result<void> check_output_path(const std::string& file, bool force) {
  std::error_code ignored;
  const fs::path folder = fs::path(file).parent_path();
  if (!folder.empty() && !fs::is_directory(folder, ignored)) {
    return fail(ErrorCode::unwritable,
                fmt::format("cannot write {}: there is no directory {}, create it first", file, folder.string()), file);
  }
  if (fs::is_directory(file, ignored)) {
    return fail(ErrorCode::unwritable, fmt::format("cannot write {}: it is a directory", file), file);
  }
  if (!force && fs::exists(file, ignored)) {
    return fail(ErrorCode::exists, fmt::format("{} exists: use --force to overwrite it", file), file);
  }
  return {};
}

bool same_name(const std::string& a, const std::string& b) {
  std::error_code ignored;
  return a == b || fs::weakly_canonical(a, ignored) == fs::weakly_canonical(b, ignored);
}

std::string file_name_error(const std::vector<std::string>& outputs, const std::vector<std::string>& inputs) {
  std::map<fs::path, bool> is_output;
  const auto added = [&](const std::string& name, bool output) {
    std::error_code ignored;
    return is_output.emplace(fs::weakly_canonical(name, ignored), output);
  };
  for (const std::string& name : inputs) {
    if (!name.empty() && !added(name, false).second) return fmt::format("{} is given twice", name);
  }
  for (const std::string& name : outputs) {
    if (name.empty()) continue;
    const auto [place, is_new] = added(name, true);
    if (is_new) continue;
    return place->second ? fmt::format("two outputs have the name {}", name)
                         : fmt::format("{} would replace a file that is read", name);
  }
  return {};
}

}  // namespace lowlux::cli
