#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/matrix3.h"

namespace lowlux::isp {

/// A change of colours, sRGB code values 0..1 to the same. Called from several threads at once.
using CodeMap = std::function<Vector3(const Vector3& code)>;

/// One, tabulated over code values: in light the nodes would lie where the eye sees nothing.
struct RetargetTable {
  int levels = 0;                   // along each axis, 2 to 65
  std::vector<std::int32_t> nodes;  // two for each: red | green << 16, and blue, codes of 16 bits; the node of levels
                                    // r, g, b is number (r levels + g) levels + b
};

/// Of tables of one size. @param levels  2 to 65
RetargetTable tabulated(const CodeMap& map, int levels, Executor& executor);

/// What a table makes of a colour: between the four nodes of the tetrahedron it lies in (Kasson, Nin, Plouffe &
/// Hafner, J. Electron. Imaging 4 (1995) 226-250): continuous, and greys need nothing but greys. The kernels of
/// retarget_rows.h do the same in single precision.
/// @param code  0..1
Vector3 looked_up(const RetargetTable& table, const Vector3& code);

/// How far looked_up is from the map.
struct TableError {
  double mean_ciede2000 = 0;  // of sRGB under D65
  double max_ciede2000 = 0;
  double mean_steps = 0;  // of 255, mean of the largest of the three components
  double max_steps = 0;
};

/// Over `colours` > 0 code values spread evenly over the cube (Halton's sequence).
TableError table_error(const RetargetTable& table, const CodeMap& map, int colours, Executor& executor);

/// A table and how good it is.
struct MeasuredTable {
  RetargetTable table;
  TableError error;
};

/// The smallest of the tables of 33 and 65 levels whose mean error over 2048 colours is not above `mean_ciede2000`; the
/// largest where none is as good.
MeasuredTable tabulated_to(const CodeMap& map, double mean_ciede2000, Executor& executor);

}  // namespace lowlux::isp
