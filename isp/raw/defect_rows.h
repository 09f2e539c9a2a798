#pragma once

#include <array>
#include <cstdint>

/// The row kernel under find_defects, dispatched at run time.
namespace lowlux::isp::defect_rows {

/// How far a code d is from the range of its neighbours, whose nearer end is e:
///     d^2 >= (range_factor range + floor_dn)^2 + variance_dn2 + shot_dn max(e - black_dn, 0)
struct Bounds {
  std::array<float, 2> black_dn{};  // of the first code, of the second, and so on by turns
  float range_factor = 0;
  float floor_dn = 0;
  float variance_dn2 = 0;
  float shot_dn = 0;
};

/// Three rows two apart, at the first code to judge; two more on either side are read.
struct Rows {
  const std::uint16_t* above;
  const std::uint16_t* here;
  const std::uint16_t* below;
};

/// marked[i] = 1 where a code is outside the range of its eight neighbours, all two away, as far as the bounds ask;
/// else 0. The last few, which fill no vector, are 1.
void mark_outliers(const Rows& rows, int count, const Bounds& bounds, std::uint8_t* marked);

}  // namespace lowlux::isp::defect_rows
