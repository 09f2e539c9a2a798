#include "isp/pipeline/merge/bracket_frames.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "isp/merge/block_test.h"
#include "isp/merge/exposure.h"
#include "isp/merge/placement.h"

namespace lowlux::isp {
namespace {

constexpr double equal_light = 0.05;  // relative difference of frames of one exposure, as measured

}  // namespace

BracketFrames::BracketFrames(int width, int height, Executor& executor)
    : width_(width), height_(height), executor_(executor) {}

Plane<float> BracketFrames::remove_saturated(FrameElectrons& frame) const {
  Plane<float> saturated(width_, height_);
  merge::remove_saturated(frame.signal_e.view(), frame.phase, frame.saturation_e, saturated.view(), executor_);
  return saturated;
}

void BracketFrames::begin(FrameElectrons& reference) {
  reference_saturated_ = remove_saturated(reference);
  saturated_ = reference_saturated_.clone();
  min_e_ = reference.signal_e.clone();
  min_matches_ = {};
  least_light_ = 1;
  is_aligned_ = true;
  variance_e2_ = reference.variance_e2;
}

Plane<float> BracketFrames::placed_weights(const FrameElectrons& frame, double light,
                                           const merge::Motion& motion) const {
  Plane<float> weight(width_, height_), placed(width_, height_);
  merge::inverse_variance_weights(view_of(frame), light, frame.saturation_e, weight.view(), executor_);
  merge::place_nearest(std::as_const(weight).view(), frame.phase, motion, {}, placed.view(), executor_);
  return placed;
}

double BracketFrames::measured_light(const merge::FrameView& reference, const FrameElectrons& frame,
                                     const merge::Motion& motion, double stated) const {
  Plane<float> placed(width_, height_);
  merge::place_nearest(frame.signal_e.view(), frame.phase, motion, {}, placed.view(), executor_);
  const auto found = merge::measure_light_ratio(
      reference, {std::as_const(placed).view(), frame.phase, frame.variance_e2}, stated, executor_);
  return found && std::fabs(found->ratio - stated) > 3 * found->standard_error ? found->ratio : stated;
}

bool BracketFrames::add(const FrameElectrons& frame, double light, const Plane<float>& saturated,
                        const merge::Motion& motion) {
  const bool has_less = light < (1 - equal_light) * least_light_;
  const bool is_placed_better = motion.found && !is_aligned_ && light < (1 + equal_light) * least_light_;
  if (!has_less && !is_placed_better) return false;
  least_light_ = light;
  is_aligned_ = motion.found;
  variance_e2_ = frame.variance_e2;
  merge::place_nearest(saturated.view(), frame.phase, motion, {}, saturated_.view(), executor_);
  merge::place_nearest(frame.signal_e.view(), frame.phase, motion, {}, min_e_.view(), executor_);
  return true;
}

bool BracketFrames::lacks_values(const merge::MosaicMean& mean, const Rect& block) const {
  for (int y = block.y; y < block.y + block.height; ++y) {
    for (int x = block.x; x < block.x + block.width; ++x) {
      if (reference_saturated_.at(x, y) == 1 && is_missing(mean, x, y)) return true;
    }
  }
  return false;
}

bool BracketFrames::is_missing(const merge::MosaicMean& mean, int x, int y) const {
  return !(mean.weight().at(x, y) > 0) && !std::isnan(min_e_.at(x, y));
}

void BracketFrames::fill_block(merge::MosaicMean& mean, const Rect& block) {
  const bool matches =
      min_matches_.empty() || min_matches_.at(block.x / merge::block_px, block.y / merge::block_px) != 0;
  const bool replaces = !matches && lacks_values(mean, block);
  const auto light = static_cast<float>(least_light_);
  for (int y = block.y; y < block.y + block.height; ++y) {
    for (int x = block.x; x < block.x + block.width; ++x) {
      const bool is_outside = std::isnan(saturated_.at(x, y));
      const float e = min_e_.at(x, y);
      if (!std::isnan(e) && (replaces || (matches && is_missing(mean, x, y)))) {
        const float variance_e2 = std::max(e, 0.0F) + static_cast<float>(variance_e2_[site_of(x, y)]);
        mean.replace(x, y, e / light, light * light / std::max(variance_e2, 1e-6F));
      } else if (replaces && !is_outside) {
        mean.replace(x, y, 0, 0);
      }
      if (is_outside) saturated_.at(x, y) = reference_saturated_.at(x, y);
    }
  }
}

void BracketFrames::fill_unmatched(merge::MosaicMean& mean) {
  for_each_index(executor_, (height_ + merge::block_px - 1) / merge::block_px, [&](int row) {
    const int top = row * merge::block_px;
    for (int left = 0; left < width_; left += merge::block_px) {
      fill_block(mean, {left, top, std::min(merge::block_px, width_ - left), std::min(merge::block_px, height_ - top)});
    }
  });
}

}  // namespace lowlux::isp
