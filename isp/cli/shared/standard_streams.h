#pragma once

#include <optional>
#include <string>

#include "capture/x_trans/x_trans_frame.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"

/// The name "-": standard input as a raw file, standard output as the file that is written.
namespace lowlux::cli {

struct DevelopArgs;

inline bool is_standard_stream(const std::string& name) { return name == "-"; }

/// Reads a raw file from standard input, of at most the bytes that a file may have (capture::ReadLimits).
Result<RawFrame> read_standard_input(const capture::XTransUse& x_trans_use = {});

/// Returns the error of arguments that read standard input twice, or that write other things than one file to standard
/// output, in one line; nullopt: there is none.
std::optional<std::string> stream_error(const DevelopArgs& args);

}  // namespace lowlux::cli
