#include "isp/cost/merge_cost.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <utility>
#include <vector>

#include "isp/cost/timing_frame.h"
#include "isp/metrics/statistics.h"
#include "isp/pipeline/merge/merge_frames.h"

namespace lowlux::isp {
namespace {

constexpr std::array<FrameSize, 6> sizes{{{128, 96}, {384, 256}, {672, 448}, {1296, 864}, {2112, 1408}, {3680, 2448}}};
constexpr TimingLight light{20, 5};
constexpr int frames = 5;  // as many as the robust mean of a camera at rest takes
constexpr int passes = 3;

double seconds_of(const MergedRaw& merged, std::string_view stage) {
  double sum = 0;
  for (const StageTime& time : merged.times) sum += time.stage == stage ? time.seconds : 0;
  return sum;
}

/// Measures the parts at one size, in units of the pace.
class Measurement {
 public:
  Measurement(const FrameSize& size, SpeedProbe& pace, Executor& executor)
      : megapixels_(1e-6 * size.width * size.height), pace_(pace), executor_(executor) {
    for (int i = 0; i < frames; ++i) burst_.push_back(timing_frame(size, light, 0, static_cast<std::uint32_t>(i)));
  }

  Result<void> pass() {
    if (auto done = merge(MergeAlignment::none); !done) return done;
    constexpr int conversions = 2 * frames;  // the reference, four more of its mean, and all of them
    add(CostPart::merge_frame, "black and noise", conversions);
    add(CostPart::merge_mean, "mean", frames);
    add(CostPart::merge_robust, "robust mean", 1);
    add(CostPart::merge_comparison, "comparison", frames);
    add(CostPart::merge_codes, "codes", 1);
    const double mean_s = seconds_of(merged_, "mean") / unit_s_ / frames;  // included in the following times
    if (auto done = merge(MergeAlignment::cells); !done) return done;
    add(CostPart::merge_alignment, "alignment", frames - 1);
    add_placing(CostPart::merge_cells, mean_s);
    if (auto done = merge(MergeAlignment::subpixel); !done) return done;
    add(CostPart::merge_prediction, "prediction", 1);
    add_placing(CostPart::merge_subpixel, mean_s);
    return {};
  }

  void state(double pace_s, CostModel& model) const {
    for (std::size_t part = 0; part < taken_.size(); ++part) {
      if (!taken_[part].empty()) model.points[part].push_back({megapixels_, median(taken_[part]) * pace_s});
    }
  }

 private:
  Result<void> merge(MergeAlignment alignment) {
    const auto unit_s = pace_.seconds(executor_);
    if (!unit_s) return tl::make_unexpected(unit_s.error());
    unit_s_ = *unit_s;
    DevelopOptions options;
    options.denoise.mode = DenoiseChoice::Mode::automatic;
    const FrameReader read = [&](int index, bool) {
      return Result<FrameToMerge>({copy_of(burst_[static_cast<std::size_t>(index)]), options, {}});
    };
    auto merged = merge_frames(frames, read, {.robust = true, .alignment = alignment}, executor_);
    if (!merged) return tl::make_unexpected(merged.error());
    merged_ = *std::move(merged);
    return {};
  }
  void add(CostPart part, double time) { taken_[static_cast<std::size_t>(part)].push_back(time); }
  void add(CostPart part, std::string_view stage, int times) {
    add(part, seconds_of(merged_, stage) / unit_s_ / times);
  }
  void add_placing(CostPart part, double mean_s) {
    const double placing = (seconds_of(merged_, "placement") + seconds_of(merged_, "mean")) / unit_s_;
    add(part, (placing - mean_s) / (frames - 1));
  }

  std::vector<RawFrame> burst_;
  double megapixels_;
  SpeedProbe& pace_;
  Executor& executor_;
  double unit_s_ = 0;
  MergedRaw merged_;
  std::array<std::vector<double>, cost_parts> taken_;
};

}  // namespace

Result<void> measure_merge_cost(SpeedProbe& pace, double pace_s, Executor& executor, CostModel& model) {
  for (const FrameSize& size : sizes) {
    Measurement measurement(size, pace, executor);
    for (int pass = 0; pass < passes; ++pass) {
      if (auto done = measurement.pass(); !done) return done;
    }
    measurement.state(pace_s, model);
  }
  return {};
}

}  // namespace lowlux::isp
