#pragma once

#include <string>

#include "isp/base/frame.h"
#include "isp/base/result.h"
#include "isp/cli/info/advise_args.h"
#include "isp/model/sensor/bracket_advice.h"

namespace lowlux::cli {

/// Holds a request for the frames of a merge, and their advice.
struct BracketCase {
  isp::BracketRequest request;
  isp::BracketAdvice advice;
};

/// Measures a raw file by its own noise model, and advises on the frames to merge. Errors: those of find_noise,
/// isp::measure_bracket_scene, isp::motion_limit_s and isp::advise_bracket.
Result<BracketCase> bracket_case(const AdviseArgs& args, RawFrame& frame);

/// Returns the advice as text, and as a JSON object.
std::string bracket_text(const BracketCase& found, const FrameInfo& info);
std::string bracket_json(const BracketCase& found, const FrameInfo& info);

}  // namespace lowlux::cli
