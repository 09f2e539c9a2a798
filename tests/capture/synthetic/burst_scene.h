#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

#include "capture/synthetic/burst.h"
#include "tests/support/synthetic_camera.h"

namespace lowlux::test {

/// Returns a burst of the plain sensor; a failure fails the test.
inline capture::BurstSource burst_of(capture::Scene scene, const capture::BurstOptions& burst,
                                     const capture::SyntheticOptions& options = {},
                                     const isp::NamedSensor& sensor = plain_sensor()) {
  InlineExecutor executor;
  auto source = capture::BurstSource::of(std::move(scene), sensor, response_of(sensor), options, burst, executor);
  EXPECT_TRUE(source) << (source ? "" : source.error().message);
  return *std::move(source);
}

/// Returns a scene whose grey is level(x, y) times 20 cd/m2 at each sample.
template <class Level>
capture::Scene grey_scene(int width, int height, const Level& level) {
  SceneLinear xyz(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double value = level(x, y);
      const Vector3 white{0.9505, 1, 1.089};
      for (int c = 0; c < 3; ++c)
        xyz.plane[c].at(x, y) = static_cast<float>(value * white[static_cast<std::size_t>(c)]);
    }
  }
  return *capture::picture_scene(std::move(xyz), 20);
}

/// Holds the sum of a plane, its centroid and its second central moment along x and y.
struct PlaneMoments {
  double sum = 0, x = 0, y = 0, xx = 0, yy = 0;
};

inline PlaneMoments moments_of(const Plane<float>& plane) {
  PlaneMoments m;
  for (int pass = 0; pass < 2; ++pass) {
    for (int y = 0; y < plane.height(); ++y) {
      for (int x = 0; x < plane.width(); ++x) {
        const double v = plane.at(x, y);
        if (pass == 0) {
          m.sum += v, m.x += v * x, m.y += v * y;
        } else {
          m.xx += v * (x - m.x) * (x - m.x), m.yy += v * (y - m.y) * (y - m.y);
        }
      }
    }
    if (pass == 0) m.x /= m.sum, m.y /= m.sum;
  }
  m.xx /= m.sum, m.yy /= m.sum;
  return m;
}

template <class T>
bool equal(const Plane<T>& a, const Plane<T>& b) {
  return a.width() == b.width() && a.height() == b.height() && std::equal(a.data(), a.data() + a.size(), b.data());
}

}  // namespace lowlux::test
