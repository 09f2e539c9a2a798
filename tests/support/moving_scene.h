#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "isp/base/cfa.h"
#include "isp/base/executor.h"
#include "isp/base/plane.h"
#include "isp/merge/frame.h"
#include "isp/merge/motion.h"

namespace lowlux::test {

/// A position in a frame, in pixels.
struct Position {
  double x = 0;
  double y = 0;
};

/// A scene without end whose light is known at every position: the exponential of a sum of waves with random directions
/// and phases. Waves have frequencies from 1/400 to max_frequency cycles per pixel, evenly in their logarithm, and
/// equal amplitudes: the power density falls with the square of frequency, as that of pictures does.
class WaveScene {
 public:
  /// @param contrast  standard deviation of the logarithm of light
  WaveScene(std::uint64_t seed, double contrast, double max_frequency = 0.15, int waves = 48);
  /// Returns light of a colour; its mean over the scene is 1.
  double at(Position p, CfaColour colour) const;

 private:
  struct Wave {
    double fx;
    double fy;
    double phase;
    std::array<double, 3> amplitude;
  };
  std::vector<Wave> waves_;
  double contrast_;
};

using Light = std::function<double(Position, CfaColour)>;  // of the scene
using View = std::function<Position(Position)>;            // from a pixel of a frame to a position in the scene

/// Returns the view of a camera that was shifted and rotated about the centre of its frame: what is at X in the scene
/// is at centre + R(turn) (X - centre) + shift.
View rigid_view(int width, int height, double dx_px, double dy_px, double turn_rad);

/// Returns the displacement of position `from` of the reference, whose view is the identity, in the frame of a view.
Position displacement_in(const View& view, Position from);

/// How a frame is exposed.
struct Exposure {
  double mean_e = 20;
  double read_noise_e = 2;
  std::uint64_t seed = 1;
  std::uint32_t frame = 0;
  BayerPhase phase = BayerPhase::grbg;
};

/// Returns a mosaic of a scene in signed electrons: Poisson counts plus normal read noise.
Plane<float> expose(const Light& light, const View& view, int width, int height, const Exposure& exposure,
                    Executor& executor);

/// Returns it as merge takes it.
merge::FrameView frame_view(const Plane<float>& mosaic, const Exposure& exposure);

/// Returns the root mean square of the error of the nodes of a motion that lie inside of the frame and whose content
/// does, for one axis, in pixels.
double rms_error_px(const merge::Motion& motion, const View& view, int width, int height);

}  // namespace lowlux::test
