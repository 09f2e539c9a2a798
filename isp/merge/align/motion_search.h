#pragma once

#include <vector>

#include "isp/base/executor.h"
#include "isp/base/plane.h"
#include "isp/merge/align/global_motion.h"
#include "isp/merge/align/luma_pyramid.h"
#include "isp/merge/align/tiles.h"

namespace lowlux::merge {

/// One level of a frame without its local mean over 7 x 7 cells, which mostly is what does not move with the scene:
/// shading of the lens, stray light, errors of black. Missing cells are NaN.
struct SearchLevel {
  LumaLevel structure_e;
  Plane<float> mean_e;
};
SearchLevel make_search_level(const LumaLevel& level);

/// A rigid motion about the centre of the frame.
struct RigidMotion {
  double dx_px = 0;
  double dy_px = 0;
  double turn_rad = 0;

  GlobalMotion in(int width, int height) const {
    return {width, height, {static_cast<float>(dx_px), static_cast<float>(dy_px)}, turn_rad};
  }
};

/// Limits of the search, and the size of the frame.
struct SearchRange {
  int width = 0;
  int height = 0;
  double max_shift_px = 128;
  double max_turn_rad = 0;
};

/// A motion and how much more likely the two frames are if it is right than if they have nothing in common: logarithm
/// of the ratio of likelihoods.
struct RatedMotion {
  RigidMotion motion;
  double log_likelihood = 0;
};

/// Compares the structure of two frames at one level for given motions.
///
/// The structure of a cell is a normal variable of variance S (the local mean of its square in the reference, less
/// noise), measured twice with noise of variances M and N, in which an uncertainty of the motion of 1/8 cell^2 is, the
/// spacing of the motions that are compared. With D = (S + M)(S + N) - S^2, the measured values r and f of one cell
/// have the logarithm of the ratio of likelihoods
///     S r f / D - ((S + N) / D - 1 / (S + M)) r^2 / 2 - ((S + M) / D - 1 / (S + N)) f^2 / 2 + ln((S + M)(S + N) / D) /
///     2
/// against having nothing in common: correlation where noise dominates, and squared difference where structure does.
/// Losses of a cell are limited to that of 3 standard deviations, 4.5. Where one frame ends, nothing is gained or lost.
/// Interpolating the frame between its cells takes a part of the noise from f, and so of the term with f^2: its mean is
/// added, so that interpolation makes no motion more likely.
class MotionComparison {
 public:
  MotionComparison(const SearchLevel& reference, const SearchLevel& frame, const LevelPair& pair);

  /// Returns the most likely motions of a regular grid over the whole range, at most `count` and no two neighbours, the
  /// best first.
  std::vector<RatedMotion> search(const SearchRange& range, int count, Executor& executor) const;

  /// Compares each motion with its 26 neighbours, one cell and one step of rotation away, and returns the best of all
  /// as search does.
  std::vector<RatedMotion> refine(const std::vector<RatedMotion>& motions, const SearchRange& range, int count,
                                  Executor& executor) const;

  /// Returns of several motions the first; of those that are not significantly worse (3 standard deviations of the sum
  /// of the cells' differences), the smallest: a periodic pattern matches in many places.
  RatedMotion smallest_near_best(const std::vector<RatedMotion>& motions, const SearchRange& range) const;

 private:
  /// The frame at displaced cells, and the part of its noise variance that interpolation has left, on average.
  struct Displaced {
    Plane<float> cells;
    double noise_left = 1;
  };

  double turn_step(const SearchRange& range) const;
  Displaced displaced(const RigidMotion& motion, const SearchRange& range, int margin) const;
  double gain_of(const Displaced& displaced, int margin, int dx, int dy) const;
  Plane<float> losses(const RigidMotion& motion, const SearchRange& range) const;

  const LumaLevel& frame_;
  Plane<float> constant_;  // the loss of a cell is constant - linear f + square f^2
  Plane<float> linear_;
  Plane<float> square_;
  Plane<float> noise_loss_;  // mean increase of the loss by the noise of the frame
  double sum_of_noise_loss_ = 0;
  int cell_px_ = 2;
};

}  // namespace lowlux::merge
