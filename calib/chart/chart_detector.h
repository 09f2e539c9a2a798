#pragma once

#include <array>
#include <cstdint>

namespace lowlux::calib {

/// A position in an image [px]; integers are centres of pixels.
struct PicturePoint {
  double x = 0;
  double y = 0;
};

/// A candidate for a chart of 6 x 4 patches: its corners in the order of its first row and back, and the misfit of the
/// detector's own colours (smaller is better).
struct ChartShape {
  std::array<PicturePoint, 4> corner;
  double cost = 0;
};

/// An 8-bit image as detectors take it: `bgr` has height rows of 3 width bytes, without gaps.
struct DetectorPicture {
  const std::uint8_t* bgr = nullptr;
  int width = 0;
  int height = 0;
};

/// Detects charts and writes at most `capacity` of them, best first. @return their number, or -1 if the detector
/// failed.
/// OpenCV's detector is called through this type, so that commands that do not detect charts need not load OpenCV: it
/// adds 21 shared libraries, and every start of the command would take 19 ms instead of 10.
using DetectCharts = int(const DetectorPicture& picture, ChartShape* shapes, int capacity) noexcept;

/// Name of the function in the module liblowlux_chart.so.
inline constexpr const char* detect_charts_name = "lowlux_detect_charts";

/// Detects a ColorChecker Classic with OpenCV's mcc (Fernandez, Color checker detection, OpenCV contrib 4.6). Its
/// corners are accurate to a tenth of a patch.
extern "C" DetectCharts lowlux_detect_charts;

}  // namespace lowlux::calib
