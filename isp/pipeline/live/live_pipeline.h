#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/matrix3.h"
#include "isp/base/packed/raw_format.h"
#include "isp/base/result.h"
#include "isp/pipeline/live/live_plan.h"
#include "isp/pipeline/plan.h"
#include "isp/pipeline/render/pipeline.h"
#include "isp/raw/measure/frame_meter.h"

namespace lowlux::isp {

/// Processes the frames of one stream, one after the other: read() takes a frame's memory in, plan() decides by what is
/// known of it, then one image of it is rendered. Everything is measured and decided as plan_develop does, except that
/// exposure and white balance follow the scene slowly. All memory is allocated in make(), which passes a first frame
/// through every step; the three steps allocate nothing, and give the same bytes for every number of threads. Row and
/// column noise, and defects that are not listed, stay.
class LivePipeline {
 public:
  /// Makes the pipeline of a stream. Errors: invalid_argument (sizes, rectangles outside the frame, levels), those of
  /// plan_look.
  static Result<std::unique_ptr<LivePipeline>> make(LiveSetup setup, Executor& executor);

  /// Reads a frame.
  /// @param bytes  rows from its first byte on, `stride` apart, for the whole frame; may lie in uncached memory
  /// @param facts  those that plan() gets: what they state is not measured
  /// @param statistics  whether meter().statistics() and the noise of the frame are wanted
  void read(std::span<const std::byte> bytes, std::size_t stride, const LiveFacts& facts, bool statistics);

  /// Decides about the frame that was read. Errors: black not below white, colours that lead to no image (malformed), a
  /// look whose luminance is not known (insufficient).
  Result<void> plan(const LiveFacts& facts);

  const DevelopPlan& decided() const { return planner_.decided(); }
  const LiveDecision& decision() const { return planner_.decision(); }
  FrameMeter& meter() { return meter_; }
  const RawFrame& frame() const { return frame_; }
  double moved() const { return pipeline_.moved(); }  // fraction of the image, in the frame rendered last

  /// Renders the image in display codes, active area, row by row.
  void render(const RowSink& sink) { pipeline_.render(frame_, decided(), sink); }
  /// Renders the image in display codes of 8 bits, in the caller's order of bytes.
  void render(const PixelView& out) { pipeline_.render(frame_, decided(), out); }
  /// Renders the image in display codes of 16 bits: height x 3 width.
  void render(PlaneView<std::uint16_t> rgb) { pipeline_.render(frame_, decided(), rgb); }
  /// Renders the mosaic of the active area without noise, in codes of 16 bits whose largest is 2^bits - 1 times 2^(16 -
  /// bits): black is where it was, times that. Negative values are kept as far as black allows.
  void render_mosaic(PlaneView<std::uint16_t> codes);

  /// Forgets what was learnt from previous frames: the next one is the first.
  void reset();

 private:
  LivePipeline(LiveSetup setup, RawFrame frame, Executor& executor);
  Result<void> warm_up();

  Executor& executor_;
  LiveSetup setup_;
  RawFrame frame_;
  FrameMeter meter_;
  LivePlanner planner_;
  Pipeline pipeline_;
};

}  // namespace lowlux::isp
