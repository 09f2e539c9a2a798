#pragma once

#include <array>

#include "denoise/temporal/temporal.h"
#include "denoise/temporal/temporal_thresholds.h"
#include "tests/reference/motion_ref.h"

namespace lowlux::reference {

/// Computes what denoise::TemporalMean does, in double, one site at a time.
class TemporalMean {
 public:
  void reset() { blocks_ = Plane<Block>(); }
  double run(const denoise::RawElectronsView& raw, const denoise::RawNoise& noise, double light,
             const denoise::TemporalOptions& options);

  Plane<double> mean_e;             // dark charge included
  Plane<double> variance_fraction;  // of each 2x2 cell

 private:
  struct Block {
    double share = 1;
    int level = 2;                          // 2: moved; 1: moved if a neighbour has
    std::array<double, 3> step{};           // of each colour: sum of the differences over their variances,
    std::array<double, 3> step_variance{};  // the variance of this sum,
    std::array<double, 3> sites{};          // and the sites that count over 1 + share; 0 if the block moved
  };
  struct Now;
  void rescale(const Now& now, double light, int x, int y);
  int level_of(const Now& now, int x, int y, const denoise::MotionThresholds& at);
  void add_offsets(const denoise::MotionThreshold& at);
  bool has_moved(int x, int y) const;
  void displace(const Now& now);

  Plane<double> signal_e_;  // the mean without dark charge
  Plane<Block> blocks_;
  denoise::RawNoise noise_;
  BayerPhase phase_ = BayerPhase::rggb;
  FrameMotion motion_;
  int frames_to_search_ = 0;
};

}  // namespace lowlux::reference
