#pragma once

#include <optional>

#include "isp/base/executor.h"
#include "isp/base/result.h"
#include "isp/merge/frame.h"
#include "isp/merge/motion.h"
#include "isp/merge/stars/star.h"
#include "isp/pipeline/merge/merged_raw.h"

namespace lowlux::isp {

/// Finds the motion of frames against a reference by the stars that both show.
class StarAlignment {
 public:
  /// Finds the stars of the reference. Error: fewer than four (insufficient).
  static Result<StarAlignment> of(const merge::FrameView& reference, Executor& executor);

  /// Returns the motion of a frame; nullopt if its stars do not match those of the reference, or hardly determine it.
  /// @param use  the stars that both have are stated in it
  std::optional<merge::Motion> motion_of(const merge::FrameView& frame, FrameUse& use, Executor& executor) const;

  int stars() const { return static_cast<int>(reference_.stars.size()); }

 private:
  explicit StarAlignment(merge::StarField reference) : reference_(std::move(reference)) {}

  merge::StarField reference_;
};

}  // namespace lowlux::isp
