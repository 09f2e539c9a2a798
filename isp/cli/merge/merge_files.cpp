#include "isp/cli/merge/merge_files.h"

#include <algorithm>
#include <cstdint>
#include <memory>
#include <utility>

#include <fmt/format.h>

#include "isp/cli/develop/memory_gate.h"
#include "isp/cli/noise/noise_source.h"
#include "isp/cli/shared/exit_code.h"
#include "isp/cli/shared/machine.h"
#include "isp/cli/shared/outputs.h"
#include "isp/cli/shared/raw_files.h"
#include "isp/cli/shared/standard_streams.h"
#include "isp/output/dng/dng_writer.h"
#include "isp/pipeline/plan/plan_develop.h"

namespace lowlux::cli {
namespace {

/// Returns the index of the reference, which is one of the inputs.
std::optional<int> reference_index(const MergeArgs& args, const std::vector<std::string>& inputs) {
  if (args.reference.empty()) return std::nullopt;
  const auto found = std::ranges::find_if(inputs, [&](const auto& file) { return same_name(file, args.reference); });
  if (found == inputs.end()) return std::nullopt;
  return static_cast<int>(found - inputs.begin());
}

std::string description_of(const isp::MergedRaw& merged) {
  std::string text = fmt::format("merged by lowlux from {} frames", merged.frames.size());
  if (!merged.bracket) text += fmt::format(", noise of a mean of {:.4g}", merged.mean_count);
  return text;
}

}  // namespace

Result<std::vector<std::string>> files_to_merge(const DevelopArgs& args) {
  std::vector<std::string> files;
  for (const std::string& input : args.inputs) {
    if (is_standard_stream(input)) {
      return fail(ErrorCode::invalid_argument,
                  "frames to merge are read more than once and cannot come from standard input: name their files", "-");
    }
    Result<std::vector<std::string>> named = raw_files_of(input, args.quiet);
    if (!named) return named;
    std::ranges::move(*named, std::back_inserter(files));
  }
  return check_frames(files, args.merging).map([&] { return std::move(files); });
}

Result<void> check_frames(const std::vector<std::string>& files, const MergeArgs& args) {
  if (const std::string wrong = file_name_error({}, files); !wrong.empty()) {
    return fail(ErrorCode::invalid_argument, wrong);
  }
  if (!args.reference.empty() && !reference_index(args, files)) {
    return fail(ErrorCode::invalid_argument, "the reference is not one of the raw files", "--reference");
  }
  return {};
}

Result<MergeReport> merge_files(const RawBatch& batch, const std::vector<std::string>& inputs, const Job& output,
                                Executor& executor, FileProgress& progress) {
  const MergeArgs& args = batch.args.merging;
  if (const auto good = check_frames(inputs, args); !good) return tl::make_unexpected(good.error());
  isp::MergeOptions options = args.options;
  options.reference = reference_index(args, inputs);
  if (!options.reference && options.alignment == isp::MergeAlignment::stars) {
    options.reference = static_cast<int>(inputs.size() / 2);  // half of the way to the last frame
  }
  options.memory_limit_bytes = available_memory();
  std::shared_ptr<const isp::CostModel> cost;
  if (batch.speed) {
    auto now = batch.speed->now(executor);
    if (!now) return tl::make_unexpected(now.error());
    cost = *std::move(now);
  }
  std::optional<NoiseOrigin> origin;
  const auto read_input = [&](int index, bool is_reference) -> Result<isp::FrameToMerge> {
    InlineExecutor alone;  // the other threads are at work on the previous frame
    std::vector<isp::StageTime> times;
    isp::StageClock clock(times);
    const std::string& file = inputs[static_cast<std::size_t>(index)];
    Result<ReadyFrame> read = read_frame(batch, {file, output.output, output.overwrite}, alone, clock);
    if (!read) return tl::make_unexpected(with_file(read.error(), file));
    if (cost) read->options.effects->cost = cost;
    // Demosaiced frames are refused by merge_frames, whatever their noise.
    const bool is_mosaic = read->frame.raw.layout != SensorLayout::linear_rgb;
    if (is_mosaic && (is_reference || batch.args.noise)) {
      const auto found = find_noise(read->options, batch.args.noise, read->frame, alone);
      if (!found) return tl::make_unexpected(with_file(found.error(), file));
      if (is_reference) origin = *found;
    } else if (is_mosaic) {
      isp::refer_noise_to_black(read->frame, read->options);
    }
    return isp::FrameToMerge{std::move(read->frame), std::move(read->options), file};
  };
  auto merged = isp::merge_frames(static_cast<int>(inputs.size()), read_input, options, executor,
                                  [&](double fraction) { progress.reach(0.9 * fraction); });
  if (!merged) return tl::make_unexpected(merged.error());
  if (auto warning = unmatched_frames_warning(inputs, *merged)) merged->warnings.push_back(*std::move(warning));
  return MergeReport{inputs, *std::move(merged), std::move(origin)};
}

Result<void> write_merged(const RawBatch& batch, const Job& output, MergeReport& report) {
  const isp::MergedRaw& merged = report.merged;
  const Result<void> written = isp::write_dng(merged.frame, output.output,
                                              {.overwrite = output.overwrite,
                                               .software = "lowlux " + version_number(),
                                               .description = description_of(merged),
                                               .sync = batch.sync,
                                               .baseline_exposure_ev = merged.baseline_exposure_ev,
                                               .compression = batch.args.compression});
  if (!written) return fail(written.error().code, written.error().message, output.output);
  return {};
}

isp::DevelopOptions options_of_merged(const RawBatch& batch, const RawFrame& merged) {
  isp::DevelopOptions options = options_of_goal(batch, merged);
  options.black = {};
  options.estimate_dark = false;
  options.find_defects = false;
  return options;
}

}  // namespace lowlux::cli
