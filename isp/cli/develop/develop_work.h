#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/image.h"
#include "isp/base/result.h"
#include "isp/base/source_tags.h"
#include "isp/cli/develop/raw_batch.h"
#include "isp/cli/shared/noise_maps.h"
#include "isp/cli/shared/outputs.h"
#include "isp/cli/shared/report.h"

/// The work of `develop` and of `denoise` on one input, without files of results: for the verbs and for isp/python.
namespace lowlux::cli {

/// Holds a developed frame, upright.
struct DevelopedFrame {
  Picture picture;
  FrameInfo info;
  std::vector<PixelMap> maps;  // those that were requested and made, with the names of their files
  std::shared_ptr<const SourceTags> source_tags;
};

/// Develops one frame, and reports its plan and times in `out`.
/// @param frames  set: they are merged, and the result is developed
/// Errors: those of ready_frame, merge_files and isp::develop.
Result<DevelopedFrame> develop_frame(const RawBatch& batch, const Job& job,
                                     const std::optional<std::vector<std::string>>& frames, Executor& executor,
                                     FileProgress& progress, DevelopOutcome& out);

/// Writes maps and image of a job, all or none. The output gets its name last: if it exists, --skip-existing takes all
/// as done.
Result<void> write_developed(const RawBatch& batch, const Job& job, const DevelopedFrame& developed, Executor& executor,
                             DevelopOutcome& out);

/// Holds a frame whose noise was reduced.
struct DenoisedFrame {
  RawFrame frame;
  std::vector<PixelMap> maps;
  std::string description;  // for the file
};

/// Returns the options of `denoise`: without rendering, since a plan's decisions on colour and tone are not used.
isp::DevelopOptions without_rendering(isp::DevelopOptions options);

/// Reduces the noise of one frame, and reports its plan and times in `out`.
/// Errors: those of ready_frame and isp::clean_raw.
Result<DenoisedFrame> denoise_frame(const RawBatch& batch, const Job& job, Executor& executor, FileProgress& progress,
                                    DevelopOutcome& out);

/// Writes maps and raw file of a job, all or none, as write_developed does.
Result<void> write_denoised(const RawBatch& batch, const Job& job, const DenoisedFrame& denoised, DevelopOutcome& out);

}  // namespace lowlux::cli
