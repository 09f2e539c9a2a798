#pragma once

#include "capture/file/picture_source.h"
#include "isp/base/executor.h"
#include "isp/base/result.h"
#include "isp/cli/compare/compare_args.h"
#include "isp/cli/compare/compare_report.h"

namespace lowlux::cli {

/// Compares two images as `compare` does; args names them. Error: their sizes differ.
Result<CompareOutcome> compare_scenes(const capture::ScenePicture& reference, const capture::ScenePicture& test,
                                      const CompareArgs& args, Executor& executor);

/// Compares the files that the arguments name. Errors: those of capture::read_picture and of compare_scenes.
Result<CompareOutcome> compare_files(const CompareArgs& args);

}  // namespace lowlux::cli
