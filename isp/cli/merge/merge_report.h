#pragma once

#include <optional>
#include <string>
#include <vector>

#include "isp/cli/noise/noise_origin.h"
#include "isp/pipeline/merge/merged_raw.h"

namespace lowlux::cli {

/// Holds the files that were merged, and how much of each was used.
struct MergeReport {
  std::vector<std::string> inputs;
  isp::MergedRaw merged;             // its frame is not reported
  std::optional<NoiseOrigin> noise;  // of the reference
};

/// Returns how much of each frame was used, and why: as text, and as a JSON object.
std::string merge_text(const MergeReport& report);
std::string merge_json(const MergeReport& report);

}  // namespace lowlux::cli
