#include "isp/pipeline/merge/static_merge.h"

#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

#include "isp/merge/static_reference.h"

namespace lowlux::isp {
namespace {

constexpr double site_false_alarm = 1e-5;  // of single sites
constexpr double blocks_of_alarm = 9;      // of the reference alone around a false alarm: one frame instead of all

/// Makes the mean of frames from all over the sequence the reference, where they show its scene. @return the blocks
/// where they do not: the reference is one frame alone
Result<Plane<std::uint8_t>> average_reference(MergeContext& work) {
  const std::vector<int> order = work.sampled_others();
  std::vector<Plane<float>> others;
  work.loader.expect(order);
  for (std::size_t i = 0; i < order.size(); ++i) {
    Result<FrameElectrons> frame = work.loader.next();
    if (!frame) return tl::make_unexpected(frame.error());
    others.push_back(std::move(frame->signal_e));
  }
  work.reference_fraction = 1.0 / static_cast<double>(others.size() + 1);
  merge::StaticReference found = merge::make_static_reference(
      std::move(work.reference.signal_e), std::move(others), {work.reference.variance_e2, 1},
      {.block_false_alarm = work.options.false_alarm / (blocks_of_alarm * work.count),
       .site_false_alarm = site_false_alarm},
      work.options.reference ? merge::Scene::reference : merge::Scene::majority, work.executor);
  work.reference.signal_e = std::move(found.mosaic);
  work.clock.lap("robust mean");
  return std::move(found.is_single);
}

}  // namespace

Result<merge::MosaicMean> static_mean(MergeContext& work) {
  Plane<std::uint8_t> is_single;
  if (work.compares()) {
    Result<Plane<std::uint8_t>> averaged = average_reference(work);
    if (!averaged) return tl::make_unexpected(averaged.error());
    is_single = *std::move(averaged);
  }
  merge::MosaicMean mean(work.width, work.height);
  std::vector<int> order(static_cast<std::size_t>(work.count));
  std::iota(order.begin(), order.end(), 0);
  work.loader.expect(order);
  for (const int index : order) {
    Result<FrameElectrons> frame = work.loader.next();
    if (!frame) return tl::make_unexpected(frame.error());
    if (work.loader.exposures_differ()) return mean;
    const merge::Comparison found =
        work.compared(frame->signal_e, {frame->variance_e2, 1},
                      {.block_false_alarm = work.options.false_alarm,
                       .site_false_alarm = site_false_alarm,
                       .single_frame = {std::as_const(is_single).view(), {work.reference.variance_e2, 1}}},
                      index);
    mean.add(std::as_const(frame->signal_e).view(), found.block_matches.view(), work.executor);
    work.clock.lap("mean");
    work.report_added();
  }
  if (work.compares()) work.fill_unmatched(mean);
  return mean;
}

}  // namespace lowlux::isp
