#pragma once

#include <array>
#include <cstdint>

/// The row kernel of find_defects is dispatched at run time.
namespace lowlux::isp::defect_rows {

/// Bounds on the distance d of a sample from the range of its neighbours, whose nearer end is e; a sample is marked if
///     d^2 >= (range_factor range + floor_dn)^2 + variance_dn2 + shot_dn max(e - black_dn, 0)
struct Bounds {
  std::array<float, 2> black_dn{};  // black levels of the even and of the odd samples, counted from the first
  float range_factor = 0;
  float floor_dn = 0;
  float variance_dn2 = 0;
  float shot_dn = 0;
};

/// Three rows, each two rows from the next, starting at the first sample to test; two more on either side are read.
template <class Sample>
struct Rows {
  const Sample* above;
  const Sample* here;
  const Sample* below;
};

/// Sets marked[i] = 1 where a sample is outside the range of its eight neighbours, all two away, by at least the
/// bounds; else 0. The last few codes, which do not fill a vector, are set to 1.
void mark_outliers(const Rows<std::uint16_t>& rows, int count, const Bounds& bounds, std::uint8_t* marked);
void mark_outliers(const Rows<float>& rows, int count, const Bounds& bounds, std::uint8_t* marked);

}  // namespace lowlux::isp::defect_rows
