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
  std::optional<NoiseOrigin> noise;  // noise of the reference
};

/// Returns a warning of frames that were aligned, and match the reference nearly nowhere; nullopt if there are none.
std::optional<std::string> unmatched_frames_warning(const std::vector<std::string>& inputs,
                                                    const isp::MergedRaw& merged);

/// Returns how much of each frame was used, and why: as text, and as a JSON object.
std::string merge_text(const MergeReport& report);
std::string merge_json(const MergeReport& report);

}  // namespace lowlux::cli
