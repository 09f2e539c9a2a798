#include "isp/pipeline/merge/merge_frames.h"

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <functional>
#include <iterator>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "isp/pipeline/merge/drizzled_raw.h"
#include "isp/pipeline/merge/merge_choice.h"
#include "isp/pipeline/merge/merge_context.h"
#include "isp/pipeline/merge/merged_mosaic.h"
#include "isp/pipeline/merge/moved_merge.h"
#include "isp/pipeline/merge/static_merge.h"

namespace lowlux::isp {
namespace {

/// Adds up the times of each step.
void add_up(std::vector<StageTime>& times) {
  std::vector<StageTime> sums;
  for (const StageTime& time : times) {
    const auto known = std::ranges::find(sums, time.stage, &StageTime::stage);
    if (known == sums.end()) {
      sums.push_back(time);
    } else {
      known->seconds += time.seconds;
    }
  }
  times = std::move(sums);
}

/// Checks what the options demand of the frames.
Result<void> check_drizzling(const MergeContext& work) {
  if (!work.options.drizzle) return {};
  if (work.loader.reference().raw.layout != SensorLayout::bayer) {
    return fail(ErrorCode::unsupported,
                "drizzling needs a mosaic of three colours, and the frame is monochrome: merge without drizzling",
                work.loader.reference_name());
  }
  if (work.out.alignment != MergeAlignment::none || work.out.bracket) return {};
  return fail(ErrorCode::invalid_argument,
              work.count == 1 ? "drizzling needs several frames"
                              : "drizzling needs displaced frames, and these did not move: merge without drizzling, or "
                                "name the method with --align",
              work.loader.reference_name());
}

Result<void> check_memory(const MergeContext& work) {
  if (!work.options.drizzle || !work.options.memory_limit_bytes) return {};
  const auto fits =
      check_drizzle_memory(work.width, work.height, *work.options.drizzle, *work.options.memory_limit_bytes);
  if (!fits) return tl::make_unexpected(at_frame(fits.error(), work.loader.reference_name()));
  return {};
}

/// Averages the frames of a camera at rest. Unfinished as static_mean is.
Result<void> merge_static(MergeContext& work) {
  work.reference.gain = {};
  work.loader.omit_gains();
  Result<merge::MosaicMean> mean = static_mean(work);
  if (!mean) return tl::make_unexpected(mean.error());
  if (!work.loader.exposures_differ()) {
    work.adopt_saturation();
    encode_merged(*mean, work.reference, {}, work.loader.reference(), work.out, work.executor);
  }
  return {};
}

/// Averages frames that moved, or whose exposures differ. Unfinished as MovedMerge::add_frames is.
Result<void> merge_moved(MergeContext& work, std::map<int, merge::Motion> motions) {
  MovedMerge moved(work, std::move(motions));
  if (Result<void> added = moved.add_frames(); !added) return added;
  if (work.loader.exposures_differ() == work.out.bracket) moved.encode();
  return {};
}

/// Makes the merge that of a bracket, finds at which level its frames are saturated, and chooses its reference, unless
/// it was named: where frames do not match, its noise is that of the result.
Result<void> begin_bracket(MergeContext& work) {
  work.out.bracket = true;
  const bool is_known = work.out.saturation || !work.loader.reference_options().find_saturation;
  if (work.options.reference && is_known) return {};
  Result<int> brightest = work.loader.brightest(work.count);
  if (!brightest) return tl::make_unexpected(brightest.error());
  if (!work.options.reference) work.out.reference = *brightest;
  return {};
}

/// Reads the reference, chooses the method, and merges by it. Unfinished where exposures are found to differ after the
/// choice.
Result<void> merge_once(MergeContext& work) {
  if (Result<void> begun = work.begin(); !begun) return begun;
  if (Result<void> fits = check_memory(work); !fits) return fits;
  Result<MergeChoice> choice = choose_merge(work);
  if (!choice) return tl::make_unexpected(choice.error());
  work.out.alignment = choice->method.alignment;
  if (choice->bracket && !work.out.bracket) {
    const int first = work.out.reference;
    if (Result<void> begun = begin_bracket(work); !begun) return begun;
    const bool is_saturation_new = !work.out.saturation && work.loader.lowest_saturation();
    if (work.out.reference != first || is_saturation_new) return merge_once(work);
  }
  work.robust = choice->method.robust;
  work.out.plan = choice->plan;
  std::ranges::move(choice->warnings, std::back_inserter(work.out.warnings));
  if (Result<void> possible = check_drizzling(work); !possible) return possible;
  if (work.out.alignment == MergeAlignment::none && !work.out.bracket) return merge_static(work);
  return merge_moved(work, std::move(choice->motions));
}

/// Holds the names of the frames that were read, and finds frames with the samples of another one.
class ReadFrames {
 public:
  /// Notes a frame, which may be read several times.
  void note(int index, const FrameToMerge& read) {
    if (!names_.try_emplace(index, read.name).second) return;
    const auto hash = hash_of(read.frame.raw);
    if (!hash) return;
    const auto [first, is_new] = first_.try_emplace(*hash, index);
    if (!is_new) copies_.emplace(index, first->second);
  }

  void warn_of_copies(MergedRaw& out) const {
    if (copies_.empty()) return;
    const auto& [copy, original] = *copies_.begin();
    out.warnings.push_back(fmt::format(
        "{} of {} frames have the samples of another frame ({} those of {}): copies do not reduce noise, and the file "
        "states less noise than it has; leave the copies out",
        copies_.size(), out.frames.size(), names_.at(copy), names_.at(original)));
  }

  void warn_of_frames_left_out(MergedRaw& out) const {
    const Counted left_out = count(out, [](const FrameUse& use) { return !use.aligned && use.used_fraction == 0; });
    if (left_out.frames == 0) return;
    out.warnings.push_back(
        fmt::format("{} of {} frames were left out ({}): {}", left_out.frames, out.frames.size(), left_out.first,
                    out.alignment == MergeAlignment::stars ? "their stars do not match those of the reference"
                                                           : "their displacement is too uncertain"));
  }

  void warn_of_unknown_displacements(MergedRaw& out) const {
    if (out.alignment == MergeAlignment::none) return;
    const Counted unknown = count(out, [](const FrameUse& use) { return !use.aligned && use.used_fraction > 0; });
    if (unknown.frames == 0) return;
    out.warnings.push_back(fmt::format(
        "the displacement of {} of {} frames could not be found ({}): only areas that match the reference without "
        "displacement were merged; leave these frames out, or try another --reference",
        unknown.frames, out.frames.size(), unknown.first));
  }

 private:
  /// Holds the number of some frames, and the name of the first of them.
  struct Counted {
    std::ptrdiff_t frames = 0;
    std::string first;
  };

  Counted count(const MergedRaw& out, bool (*is_counted)(const FrameUse&)) const {
    Counted counted{.frames = std::ranges::count_if(out.frames, is_counted)};
    if (counted.frames == 0) return counted;
    counted.first = names_.at(static_cast<int>(std::ranges::find_if(out.frames, is_counted) - out.frames.begin()));
    return counted;
  }

  /// Returns a hash of the samples; nullopt if all rows are equal, as they are in frames that are saturated everywhere.
  static std::optional<std::size_t> hash_of(const RawDn& raw) {
    std::size_t hash = 0;
    bool rows_differ = false;
    with_samples(raw, [&](const auto& samples) {
      const auto row_at = [&](int y) {
        const auto* const first = samples.row(y);
        return std::string_view(reinterpret_cast<const char*>(first),
                                static_cast<std::size_t>(samples.width) * sizeof(*first));
      };
      for (int y = 0; y < samples.height; ++y) {
        rows_differ = rows_differ || row_at(y) != row_at(0);
        hash = 31 * hash + std::hash<std::string_view>()(row_at(y));
      }
    });
    return rows_differ ? std::optional(hash) : std::nullopt;
  }

  std::map<int, std::string> names_;
  std::map<std::size_t, int> first_;  // frame, by hash
  std::map<int, int> copies_;         // frame of which it is a copy, by frame
};

void state_times(MergeContext& work) {
  work.clock.lap("codes");
  add_up(work.out.times);
  if (!work.out.plan) return;
  for (const StageTime& time : work.out.times) {
    if (time.stage != waiting_stage) work.out.plan->taken_s += time.seconds;
  }
}

}  // namespace

Result<MergedRaw> merge_frames(int count, const FrameReader& read, const MergeOptions& options, Executor& executor,
                               const MergeProgress& progress) {
  if (count < 1) return fail(ErrorCode::invalid_argument, "give at least one frame to merge");
  assert(!options.reference || (*options.reference >= 0 && *options.reference < count));
  ReadFrames frames;
  const FrameReader noting = [&](int index, bool is_reference) {
    Result<FrameToMerge> frame = read(index, is_reference);
    if (frame) frames.note(index, *frame);
    return frame;
  };
  MergeContext work(count, noting, options, executor, progress);
  work.out.reference = options.reference.value_or(0);
  Result<void> done = merge_once(work);
  if (done && work.loader.exposures_differ() && !work.out.bracket) {
    done = begin_bracket(work);
    if (done) done = merge_once(work);
  }
  if (!done) return tl::make_unexpected(done.error());
  frames.warn_of_frames_left_out(work.out);
  frames.warn_of_unknown_displacements(work.out);
  frames.warn_of_copies(work.out);
  state_times(work);
  return std::move(work.out);
}

}  // namespace lowlux::isp
