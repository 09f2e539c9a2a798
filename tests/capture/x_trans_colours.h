#pragma once

#include <vector>

#include "capture/x_trans/x_trans_pattern.h"

namespace lowlux::test {

/// Returns the 36 colours of a phase as the tag CFAPattern has them.
inline std::vector<double> x_trans_colours(const capture::XTransPhase& phase) {
  std::vector<double> colours(36);
  for (int y = 0; y < 6; ++y) {
    for (int x = 0; x < 6; ++x) colours[y * 6 + x] = static_cast<double>(capture::colour_at(phase, x, y));
  }
  return colours;
}

}  // namespace lowlux::test
