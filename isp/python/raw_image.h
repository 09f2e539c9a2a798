#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <pybind11/numpy.h>

#include "isp/base/frame.h"
#include "isp/base/matrix3.h"

namespace lowlux::python {

/// Holds a raw frame for Python. Arrays of its samples are views that keep it alive.
struct RawImage {
  RawFrame frame;
};
using RawImagePtr = std::shared_ptr<RawImage>;

/// Describes the samples of an array that becomes a raw frame. Levels are in the units of the samples [DN].
struct MosaicFigures {
  std::vector<double> black_dn;  // one value, four of the 2x2 cell row by row, or three of R, G, B; empty: like's
  std::vector<double> white_dn;  // one value, or three of R, G, B; empty: like's
  std::string cfa;               // RGGB, GRBG, GBRG, BGGR or MONO; empty: like's, or RGGB
  std::vector<double> noise;     // scale, offset: one pair, or three of R, G, B; empty: like's
  std::vector<double> matrix;    // XYZ to camera RGB, row by row; empty: like's
  std::optional<double> exposure_s;
  std::optional<double> iso;
};

/// Makes a frame of a copy of the array: height x width, or height x width x 3 for demosaiced RGB; integers of 0 to
/// 65535 or finite floats, in any layout and byte order.
/// @param like  frame whose metadata is taken over; null: none
/// Throws Failure with ErrorCode::invalid_argument for arrays of other types, shapes or values, and for figures that
/// contradict each other (isp::check_dng_frame); with ErrorCode::too_large without memory for the copy.
RawImagePtr frame_from_array(const pybind11::array& mosaic, const MosaicFigures& figures, const RawImage* like);

/// Adds RawImage, read_raw, write_dng and frame_from_array.
void add_raw_image(pybind11::module_& module);

/// Returns a frame with everything but the samples.
RawFrame without_samples(const RawFrame& frame);

/// Returns a complete copy.
RawFrame clone(const RawFrame& frame);

}  // namespace lowlux::python
