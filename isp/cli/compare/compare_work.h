#pragma once

#include <string>
#include <vector>

#include "capture/file/picture_source.h"
#include "isp/base/executor.h"
#include "isp/base/result.h"
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

/// Compares two images as `compare` does; args names them. Error: their sizes differ.
Result<CompareOutcome> compare_scenes(const capture::ScenePicture& reference, const capture::ScenePicture& test,
                                      const CompareArgs& args, Executor& executor);

/// Compares the files that the arguments name. Errors: those of capture::read_picture and of compare_scenes.
Result<CompareOutcome> compare_files(const CompareArgs& args);

std::string compare_text(const CompareOutcome& outcome);
std::string compare_json(const CompareArgs& args, const CompareOutcome& outcome);

}  // namespace lowlux::cli
