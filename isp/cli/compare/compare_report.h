#pragma once

#include <string>
#include <vector>

#include "isp/cli/compare/compare_args.h"
#include "isp/metrics/picture_comparison.h"
#include "isp/metrics/spectral_difference.h"

namespace lowlux::cli {

/// Holds the results of `compare`.
struct CompareOutcome {
  isp::PictureComparison found;
  isp::SpectralDifference spectra;
  int width = 0;
  int height = 0;
  std::vector<std::string> warnings;  // with the name of their file
};

std::string compare_text(const CompareOutcome& outcome);
std::string compare_json(const CompareArgs& args, const CompareOutcome& outcome);

}  // namespace lowlux::cli
