#pragma once

#include <string>
#include <vector>

#include "isp/bench/picture_comparison.h"
#include "isp/bench/spectral_difference.h"
#include "isp/cli/compare_args.h"

namespace lowlux::cli {

/// What `compare` has to say.
struct CompareOutcome {
  isp::PictureComparison found;
  isp::SpectralDifference spectra;
  int width = 0;
  int height = 0;
  std::string why_no_hull;            // set where the module that finds convex hulls is missing
  std::vector<std::string> warnings;  // with the name of their file
};

std::string compare_text(const CompareOutcome& outcome);
std::string compare_json(const CompareArgs& args, const CompareOutcome& outcome);

}  // namespace lowlux::cli
