#pragma once

#include <optional>
#include <string>
#include <vector>

#include "isp/base/result.h"
#include "isp/cli/develop/develop_args.h"
#include "isp/output/atomic_file.h"
#include "isp/output/picture/image_writer.h"

namespace lowlux::cli {

/// Names a file to develop and the output of its image.
struct Job {
  std::string input;
  std::string output;
  isp::Overwrite overwrite = isp::Overwrite::no;
};

/// Returns the output of each input: `output` itself for one, files in it where it is a folder (it exists as one or
/// ends with /), with `extension` unless the arguments name a format. Inputs of one name with several extensions have
/// outputs named with these, as one_nef.png and one_dng.png, which is printed unless the arguments are quiet. Inputs
/// that are folders stand for the raw files in them, and - for standard input and output. Errors: those of
/// stream_error; those of raw_files_of; with ErrorCode::invalid_argument (invalid arguments) several inputs and no
/// folder, two inputs for one image, an image that would replace its own raw file.
Result<std::vector<Job>> plan_outputs(const DevelopArgs& args, const std::string& extension);

/// Checks outputs. Error (invalid arguments): an output that would replace one of the files that are only read.
Result<void> check_unharmed(const std::vector<Job>& jobs, const std::vector<std::string>& read);

/// Returns whether the output is a folder.
bool names_folder(const DevelopArgs& args);

/// Returns the format of images at an output: by its extension, for standard output that of --format or PNG. Error: the
/// extension is unknown.
Result<isp::FileFormat> format_of_output(const DevelopArgs& args, const std::string& output);

/// Holds space and samples of an image file.
struct PictureKind {
  OutputSpace space = OutputSpace::srgb;
  SampleType samples = SampleType::u8;
};

/// Returns the requested samples and space, or the format's defaults. Errors: the format does not support them.
Result<PictureKind> picture_kind(isp::FileFormat format, std::optional<int> bits, std::optional<OutputSpace> space);

/// Completes space, samples, tone and exposure by the capabilities of the output's format. Errors: incompatible
/// options.
Result<isp::DevelopOptions> complete_options(const DevelopArgs& args, isp::FileFormat format);

/// Returns whether options cannot be combined, see isp::check_options. A depth or a space that the format of the output
/// does not support does not count.
bool options_contradict(const DevelopArgs& args);

/// Checks before any work that a file can be written; the writers check again.
/// Errors: its folder is missing; it is a folder itself; it exists, and `force` is not given.
Result<void> check_output_path(const std::string& file, bool force);

/// Returns whether two names refer to one file.
bool same_name(const std::string& a, const std::string& b);

/// Returns the error of files by their names alone: an output that is another output or an input, an input that is
/// given twice. Empty names do not count. @return empty if there is no error
std::string file_name_error(const std::vector<std::string>& outputs, const std::vector<std::string>& inputs);

}  // namespace lowlux::cli
