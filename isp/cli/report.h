#pragma once

#include <optional>
#include <string>
#include <vector>

#include "isp/base/frame.h"
#include "isp/base/result.h"
#include "isp/pipeline/plan.h"

namespace lowlux::cli {

/// What became of one file of `develop`.
struct DevelopOutcome {
  std::string input;
  std::string output;
  std::optional<Error> error;            // set: not all was written
  std::optional<isp::DevelopPlan> plan;  // set without an error, unless skipped
  bool skipped = false;                  // the outputs exist, and are kept
  int width = 0;                         // of the picture as written, upright
  int height = 0;
  std::vector<isp::StageTime> times;  // all stages, in order
};

/// One JSON object.
std::string develop_json(const DevelopOutcome& outcome);
/// What was decided for a frame, and why, as text.
std::string explain_text(const isp::DevelopPlan& plan);
/// Stage times as text, one line for each and their sum.
std::string times_text(const std::vector<isp::StageTime>& times);

/// What a raw file says and what was measured on it: text for people, or one JSON object.
std::string info_text(const std::string& file, const RawFrame& frame);
std::string info_json(const std::string& file, const RawFrame& frame);
std::string error_json(const std::string& file, const Error& error);

/// The text with every control character made a blank, so that no file name can break a line.
std::string one_line(std::string text);
/// "lowlux: FILE: what is wrong", one line.
std::string error_line(const std::string& file, const Error& error);

}  // namespace lowlux::cli
