#pragma once

#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/image.h"
#include "isp/base/plane.h"
#include "isp/cli/develop/cost_file.h"
#include "isp/cli/develop/develop_args.h"
#include "isp/cli/develop/raw_batch.h"
#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/outputs.h"
#include "isp/cli/shared/progress.h"
#include "isp/python/failure.h"
#include "isp/python/raw_image.h"

/// Functions that all calls of the command's verbs from Python share.
namespace lowlux::python {

/// Parses arguments as the command does, without the user's file of defaults: a program has the same results
/// everywhere. Throws Failure with the message that the command prints.
template <class Args>
Args parsed(cli::Parsed<Args> (*parse)(const std::vector<std::string>& words), const std::vector<std::string>& words) {
  const cli::ErrorText errors;
  std::vector<std::string> alone{"--no-config"};
  alone.insert(alone.end(), words.begin(), words.end());
  cli::Parsed<Args> result = parse(alone);
  if (auto* const args = std::get_if<Args>(&result)) return std::move(*args);
  std::string message = errors.text();
  if (message.ends_with('\n')) message.pop_back();
  throw Failure({ErrorCode::invalid_argument, message, {}});
}

/// Holds what the input of a call is: a file, or a frame in memory under a name that errors use.
struct Input {
  std::string name;
  RawImagePtr frame;  // null: the file of that name
};

/// Returns a function that reads inputs: a copy of a frame in memory, as the work changes it. Samples may
/// have been written by way of a view: those of the copy that no frame can have (unusable_sample) are an error.
cli::ReadRaw reader_of(const std::vector<Input>& inputs);

/// Checks the frames of a merge where names do not suffice (cli::check_frames): one frame in memory may be given twice,
/// and a file may have the name that stands for a frame in memory. Throws Failure.
void check_frames_in_memory(const std::vector<Input>& inputs);

/// Prepares arguments of `develop`, `denoise` or `merge` for one call.
/// @param output  file that is written; empty: none
void set_call(const std::string& output, bool overwrite, cli::DevelopArgs& args);

/// Moves samples into an array that owns them.
pybind11::array array_of(Picture picture);  // height x width x 3
pybind11::array array_of(Plane<float> plane);

}  // namespace lowlux::python
