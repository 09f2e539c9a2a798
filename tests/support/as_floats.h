#pragma once

#include "isp/base/frame.h"

namespace lowlux::test {

/// Replaces the codes of a readout by floating-point samples of `scale` times their value, and its levels likewise.
/// With a power of two every value stays exact.
inline void make_floats(RawDn& raw, double scale = 1) {
  raw.dn_float = Plane<float>(raw.dn.width(), raw.dn.height());
  for (std::size_t i = 0; i < raw.dn.size(); ++i) raw.dn_float.data()[i] = static_cast<float>(scale * raw.dn.data()[i]);
  raw.dn = {};
  for (double& white : raw.white_dn) white *= scale;
  if (!raw.black_tag) return;
  for (auto* levels : {&raw.black_tag->pattern_dn, &raw.black_tag->column_dn, &raw.black_tag->row_dn}) {
    for (double& level : *levels) level *= scale;
  }
}

}  // namespace lowlux::test
