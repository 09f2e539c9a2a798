#pragma once

#include <array>
#include <cstdint>

namespace lowlux::calib {

/// A place in a picture [px]; whole numbers are centres of pixels.
struct PicturePoint {
  double x = 0;
  double y = 0;
};

/// What may be a chart of 6 x 4 patches: its corners in the order of its first row and back, and how badly the
/// detector's own colours fit (smaller is better).
struct ChartShape {
  std::array<PicturePoint, 4> corner;
  double cost = 0;
};

/// A picture of 8 bits as detectors take it: `bgr` has height rows of 3 width bytes, none between them.
struct DetectorPicture {
  const std::uint8_t* bgr = nullptr;
  int width = 0;
  int height = 0;
};

/// Looks for charts and writes at most `capacity` of them, best first. @return how many, or -1 if the detector failed.
/// OpenCV's detector stands behind this type, so that who does not look for charts need not load OpenCV: with it come
/// 21 shared libraries, and every start of the command would take 19 ms in place of 10.
using DetectCharts = int(const DetectorPicture& picture, ChartShape* shapes, int capacity) noexcept;

/// The name under which the module liblowlux_chart.so holds it.
inline constexpr const char* detect_charts_name = "lowlux_detect_charts";

/// ColorChecker Classic, by OpenCV's mcc (Fernandez, Color checker detection, OpenCV contrib 4.6). Its corners are
/// good to a tenth of a patch.
extern "C" DetectCharts lowlux_detect_charts;

}  // namespace lowlux::calib
