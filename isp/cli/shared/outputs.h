#pragma once

#include <optional>
#include <string>
#include <vector>

#include "isp/base/result.h"
#include "isp/cli/develop/develop_args.h"
#include "isp/output/atomic_file.h"
#include "isp/output/picture/image_writer.h"

namespace lowlux::cli {

/// One file to develop and where its picture goes.
struct Job {
  std::string input;
  std::string output;
  isp::Overwrite overwrite = isp::Overwrite::no;
};

/// The output of each input: `output` itself for one, files in it where it is a folder (it exists as one or ends
/// with /), with `extension` unless the arguments name a format. Inputs that are folders stand for the raw files in
/// them. Errors: those of raw_files_of; with ErrorCode::invalid_argument (command line wrong) several inputs and no
/// folder, two inputs for one picture, a picture that would replace its own raw file.
Result<std::vector<Job>> plan_outputs(const DevelopArgs& args, const std::string& extension);

/// Error (command line wrong): an output that would replace one of the files that are only read.
Result<void> check_unharmed(const std::vector<Job>& jobs, const std::vector<std::string>& read);

/// Whether the output is a folder.
bool names_folder(const DevelopArgs& args);

/// Space and samples of a picture file.
struct PictureKind {
  OutputSpace space = OutputSpace::srgb;
  SampleType samples = SampleType::u8;
};

/// What a format holds by default, or as asked for. Errors: it cannot hold that.
Result<PictureKind> picture_kind(isp::FileFormat format, std::optional<int> bits, std::optional<OutputSpace> space);

/// Completes space, samples, tone and exposure by what the format of the output can hold. Errors: they do not fit.
Result<isp::DevelopOptions> complete_options(const DevelopArgs& args, isp::FileFormat format);

/// What would keep a file from being written, known before any work is done; the writers look again.
/// Errors: its folder is missing; it is a folder itself; it exists, and `force` is not given.
Result<void> check_place(const std::string& file, bool force);

/// Whether two names are those of one file.
bool same_name(const std::string& a, const std::string& b);

/// What is wrong with files by their names alone: an output that is another output or an input, an input that is given
/// twice. Empty names are none. @return empty if nothing is wrong
std::string wrong_names(const std::vector<std::string>& outputs, const std::vector<std::string>& inputs);

}  // namespace lowlux::cli
