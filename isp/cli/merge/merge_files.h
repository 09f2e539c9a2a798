#pragma once

#include <string>
#include <vector>

#include "isp/cli/develop/raw_batch.h"
#include "isp/cli/merge/merge_report.h"
#include "isp/pipeline/merge/merge_frames.h"

namespace lowlux::cli {

/// Returns the raw files that the inputs of the arguments name, folders and patterns included. Errors: those of
/// raw_files_of and of check_frames.
Result<std::vector<std::string>> files_to_merge(const DevelopArgs& args);

/// Checks frames by their names. Error (invalid arguments): one is given twice, and would be averaged with itself; the
/// reference is not among them.
Result<void> check_frames(const std::vector<std::string>& files, const MergeArgs& args);

/// Merges raw files for a batch of one output. Errors: those of check_frames, of reading, with the file, and of
/// isp::merge_frames.
/// @param inputs  names of files, or what batch.read reads by these names
/// @param output  where the result goes; it may not exist unless it is overwritten
Result<MergeReport> merge_files(const RawBatch& batch, const std::vector<std::string>& inputs, const Job& output,
                                Executor& executor, FileProgress& progress);

/// Writes a merged frame as the DNG of a job, with the tags of its reference. Errors name the output; warnings of tags
/// are added to those of the merge.
Result<void> write_merged(const RawBatch& batch, const Job& output, MergeReport& report);

/// Returns the options for developing a merged frame: its black level, dark charge and defects are settled.
isp::DevelopOptions options_of_merged(const RawBatch& batch, const RawFrame& merged);

}  // namespace lowlux::cli
