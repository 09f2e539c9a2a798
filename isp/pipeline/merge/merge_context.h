#pragma once

#include <vector>

#include "isp/base/executor.h"
#include "isp/base/plane.h"
#include "isp/base/result.h"
#include "isp/merge/block_test.h"
#include "isp/merge/mosaic_mean.h"
#include "isp/pipeline/merge/frame_electrons.h"
#include "isp/pipeline/merge/frame_loader.h"
#include "isp/pipeline/merge/merged_raw.h"
#include "isp/pipeline/stage_clock.h"

namespace lowlux::isp {

/// Holds what the steps of a merge share: the frames, the reference, and the result as far as it is known.
struct MergeContext {
  MergeContext(int frames, const FrameReader& read, const MergeOptions& merge_options, Executor& threads,
               const MergeProgress& report)
      : count(frames),
        options(merge_options),
        executor(threads),
        progress(report),
        clock(out.times),
        loader(read, threads, clock) {}

  /// Reads the reference, and begins anew.
  Result<void> begin();

  bool compares() const { return robust && count > 1; }

  /// Returns the frames from all over the sequence that are averaged with the reference to what frames are compared
  /// with.
  std::vector<int> sampled_others() const;

  /// Returns the light of the frame last read over that of the reference, by the stated exposures.
  Result<double> stated_light() const;

  /// Compares the values of a frame, at the sites of the reference, with those of the reference, and states the result
  /// in FrameUse. Where frames are not compared, all of it matches.
  merge::Comparison compared(Plane<float>& mosaic, const merge::MosaicNoise& noise,
                             const merge::ComparisonOptions& comparison, int index);

  /// Makes the level of saturation that another frame shows that of a reference that shows none.
  void adopt_saturation();

  /// Fills sites at which no frame has a value that matches the reference, a mean of several frames, with that mean.
  void fill_unmatched(merge::MosaicMean& mean);

  /// Counts one more frame as done.
  void report_added();

  int count;
  const MergeOptions& options;
  Executor& executor;
  const MergeProgress& progress;
  MergedRaw out;
  StageClock clock;
  FrameLoader loader;
  FrameElectrons reference;       // its signal becomes a mean of several frames where frames are compared with that
  double reference_fraction = 1;  // variance of the reference's signal over that of a frame
  int width = 0, height = 0;
  bool robust = true;
  int added = 0;
};

}  // namespace lowlux::isp
