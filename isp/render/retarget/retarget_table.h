#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/matrix3.h"

namespace lowlux::isp {

/// Changes colours from sRGB code values 0..1 to sRGB code values 0..1. It is called from several threads at once.
using CodeMap = std::function<Vector3(const Vector3& code)>;

/// Tabulates a CodeMap over code values; nodes evenly spaced in light would lie where the eye sees no differences.
struct RetargetTable {
  int levels = 0;                   // along each axis, 2 to 65
  std::vector<std::int32_t> nodes;  // two for each: red | green << 16, and blue, codes of 16 bits; the node of levels
                                    // r, g, b is number (r levels + g) levels + b
};

/// Returns the table of a map. @param levels  2 to 65
RetargetTable tabulated(const CodeMap& map, int levels, Executor& executor);

/// Returns the table's result for a colour, interpolated between the four nodes of the tetrahedron it lies in (Kasson,
/// Nin, Plouffe & Hafner, J. Electron. Imaging 4 (1995) 226-250): continuous, and greys depend on greys only. The
/// kernels of retarget_rows.h compute it in single precision.
/// @param code  0..1
Vector3 looked_up(const RetargetTable& table, const Vector3& code);

/// Measures the error of looked_up against the map.
struct TableError {
  double mean_ciede2000 = 0;  // error of sRGB under D65
  double max_ciede2000 = 0;
  double mean_steps = 0;  // mean of the largest error of the three components, in steps of 255
  double max_steps = 0;
};

/// Measures the error over `colours` > 0 code values spread evenly over the cube (Halton's sequence).
TableError table_error(const RetargetTable& table, const CodeMap& map, int colours, Executor& executor);

/// Holds a table and its error.
struct MeasuredTable {
  RetargetTable table;
  TableError error;
};

/// Returns the smallest of the tables of 33 and 65 levels whose mean error over 2048 colours is not above
/// `mean_ciede2000`; the largest if none reaches it.
MeasuredTable tabulated_to(const CodeMap& map, double mean_ciede2000, Executor& executor);

}  // namespace lowlux::isp
