#include "isp/pipeline/merge/bracket_frames.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "isp/merge/block_test.h"
#include "isp/merge/exposure.h"
#include "isp/merge/placement.h"

namespace lowlux::isp {

BracketFrames::BracketFrames(int width, int height, Executor& executor)
    : width_(width), height_(height), executor_(executor) {}

Plane<float> BracketFrames::remove_saturated(FrameElectrons& frame) const {
  Plane<float> saturated(width_, height_);
  merge::remove_saturated(frame.signal_e.view(), frame.phase, frame.saturation_e, saturated.view(), executor_);
  return saturated;
}

void BracketFrames::begin(FrameElectrons& reference) {
  saturated_ = remove_saturated(reference);
  least_e_ = reference.signal_e.clone();
  least_light_ = 1;
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

void BracketFrames::add(const FrameElectrons& frame, double light, const Plane<float>& saturated,
                        const merge::Motion& motion) {
  if (light >= least_light_) return;
  least_light_ = light;
  variance_e2_ = frame.variance_e2;
  Plane<float> placed(width_, height_);
  merge::place_nearest(saturated.view(), frame.phase, motion, {}, placed.view(), executor_);
  for_each_index(executor_, height_, [&](int y) {
    for (int x = 0; x < width_; ++x) {
      if (!std::isnan(placed.at(x, y))) saturated_.at(x, y) = placed.at(x, y);
    }
  });
  merge::place_nearest(frame.signal_e.view(), frame.phase, motion, {}, least_e_.view(), executor_);
}

bool BracketFrames::lacks_values(const merge::MosaicMean& mean, int left, int top) const {
  for (int y = top; y < std::min(top + merge::block_px, height_); ++y) {
    for (int x = left; x < std::min(left + merge::block_px, width_); ++x) {
      if (!(mean.weight().at(x, y) > 0) && !std::isnan(least_e_.at(x, y))) return true;
    }
  }
  return false;
}

void BracketFrames::fill_unmatched(merge::MosaicMean& mean) const {
  const auto light = static_cast<float>(least_light_);
  for_each_index(executor_, (height_ + merge::block_px - 1) / merge::block_px, [&](int row) {
    const int top = row * merge::block_px;
    for (int left = 0; left < width_; left += merge::block_px) {
      if (!lacks_values(mean, left, top)) continue;
      for (int y = top; y < std::min(top + merge::block_px, height_); ++y) {
        for (int x = left; x < std::min(left + merge::block_px, width_); ++x) {
          const float e = least_e_.at(x, y);
          if (std::isnan(e)) {
            if (saturated_.at(x, y) == 1) mean.replace(x, y, 0, 0);
            continue;
          }
          const float variance_e2 = std::max(e, 0.0F) + static_cast<float>(variance_e2_[site_of(x, y)]);
          mean.replace(x, y, e / light, light * light / std::max(variance_e2, 1e-6F));
        }
      }
    }
  });
}

}  // namespace lowlux::isp
