#pragma once

#include <cstdint>

#include "isp/base/executor.h"
#include "isp/pipeline/plan.h"
#include "tests/scenarios/bench_raw.h"

namespace lowlux::test {

/// Numbers in 0..1 that depend on a stream and an index alone.
class Draws {
 public:
  /// @param stream, purpose  told apart by what they are drawn for
  Draws(std::uint64_t stream, std::uint32_t purpose, std::uint32_t index)
      : stream_(stream), purpose_(purpose), index_(index) {}
  double uniform();
  double log_uniform(double low, double high);
  int below(int count);

 private:
  std::uint64_t stream_;
  std::uint32_t purpose_;
  std::uint32_t index_;
  std::uint32_t next_ = 0;
};

/// A part of a picture behind the lens, from a place that is drawn; beyond its ends it is mirrored, both ways at once.
/// @param shift_px  by which each copy lies lower, and farther right, than the one before: without, rows and columns go
///                  through a frame of several copies several times, and look like row and column noise
isp::BenchPicture drawn_part(const isp::BenchPicture& picture, Draws& draws, int width, int height, int shift_px = 0);

/// One of the held-out pictures, which are read once.
const isp::BenchPicture& held_out_picture(int index, Executor& executor);

/// A scene for the planner, drawn log-uniformly from ranges that were fixed before it was tried on them: 1 to 1e4 e-,
/// dark 0.01 to 200 e-, read noise 0.5 to 8 e-, row and column noise 0.01 to 3 e-, hot pixels 1e-6 to 1e-3 of all with
/// 10 to 1e4 e-, tolerance 0.25 to 4; every second one for the eye at 1e-3 to 1e3 cd/m2, every second one with known
/// dark charge.
struct PlannerScene {
  isp::BenchRaw raw;
  isp::DevelopOptions options;
  double tolerance = 0;
  isp::DenoiseLight light;

  /// As planned for the tolerance, or with everything done. Glare and the eye's own noise are a matter of taste: no
  /// tolerance calls for them.
  isp::DevelopOptions ways(bool all) const;
};
PlannerScene planner_scene(std::uint32_t index, int width, int height, Executor& executor);

}  // namespace lowlux::test
