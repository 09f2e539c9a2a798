#include "isp/pipeline/merge/star_alignment.h"

#include <utility>

#include <fmt/format.h>

#include "isp/merge/stars/find_stars.h"
#include "isp/merge/stars/match_stars.h"

namespace lowlux::isp {
namespace {

constexpr int min_stars = 4;             // that state a transformation which chance does not explain
constexpr double max_star_error_px = 1;  // standard error of a displacement

}  // namespace

Result<StarAlignment> StarAlignment::of(const merge::FrameView& reference, Executor& executor) {
  merge::StarField field = merge::find_stars(reference, {}, executor);
  if (static_cast<int>(field.stars.size()) < min_stars) {
    return fail(ErrorCode::insufficient,
                fmt::format("{} stars were found, and at least {} are needed; choose another reference, or align by "
                            "the detail of the scene",
                            field.stars.size(), min_stars));
  }
  return StarAlignment(std::move(field));
}

std::optional<merge::Motion> StarAlignment::motion_of(const merge::FrameView& frame, FrameUse& use,
                                                      Executor& executor) const {
  const merge::StarField field = merge::find_stars(frame, {}, executor);
  const Result<merge::StarMatch> match = merge::match_stars(reference_, field, {});
  if (!match) return std::nullopt;
  use.stars_matched = match->matched;
  merge::Motion motion = merge::motion_of(match->transform, reference_.width, reference_.height);
  if (motion.standard_error_px > max_star_error_px) return std::nullopt;
  return motion;
}

}  // namespace lowlux::isp
