#pragma once

#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <variant>

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/image.h"
#include "isp/base/result.h"
#include "isp/bench/methods/contained_command.h"

namespace lowlux::isp {

/// An image that a method made of a raw frame: a cleaner raw frame, or light as XYZ with Y = 1 for white (D65).
using MethodImage = std::variant<RawFrame, SceneLinear>;

/// A method to score: a command line or a function that makes an image of a noisy raw frame.
struct ScoredMethod {
  std::string name;     // see is_method_name
  std::string command;  // command for /bin/sh, see expand_command; empty: `call`
  std::function<Result<MethodImage>(const RawFrame& noisy)> call;  // time and memory are not limited
  bool ours = false;                                               // a level of lowlux
};

/// The image that a method made, and what it used.
struct MethodRun {
  MethodImage image;
  CommandUse use;  // use of resources; peak_bytes of a function is not a number
};

/// Returns whether a name has 1 to 40 letters, digits and ._- and begins with a letter or digit.
bool is_method_name(std::string_view name);

/// A method that is known by name: a program with the options that make it comparable.
struct ReadyMethod {
  std::string_view name;
  std::string_view command;
  std::string_view check;  // shell command that succeeds where everything it needs is installed
  std::string_view needs;  // for messages
};

/// Returns all methods that are known by name.
std::span<const ReadyMethod> ready_methods();

/// Makes a method of NAME=COMMAND, or of the name of a ready one.
/// Errors: invalid_argument, a name that is not one, a command without {in} or {out}, an unknown name;
/// not_found, a ready method that is not installed.
Result<ScoredMethod> method_of(const std::string& text);

/// A command line with the paths in it, and the file that it is to write.
struct ExpandedCommand {
  std::string line;
  std::filesystem::path output;
};

/// Replaces {in} by the path of the raw file, and {out} by that of clean.dng or {out.EXT} by that of clean.EXT, in the
/// folder, quoted where needed. EXT is dng, png, tif, tiff, jpg, ppm, pfm or exr. Error: invalid_argument, {in} or
/// {out} is missing, or two different outputs are named.
Result<ExpandedCommand> expand_command(const std::string& command, const std::filesystem::path& folder);

/// Name of the raw file that a command is given.
inline constexpr const char* noisy_file = "noisy.dng";

/// Runs a method on a frame. A command finds the frame, and nothing else, in a private folder that is removed
/// afterwards. Errors: those of run_contained; no output, or one that is not a regular file or cannot be read; those of
/// the function.
Result<MethodRun> run_method(const ScoredMethod& method, const RawFrame& noisy, const CommandLimits& limits,
                             Executor& executor);

}  // namespace lowlux::isp
