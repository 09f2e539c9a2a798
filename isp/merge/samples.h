#pragma once

#include <cstddef>

namespace lowlux::merge::rows {

/// A plane that kernels take samples from.
struct Samples {
  const float* data;  // sample (0, 0)
  std::ptrdiff_t stride;
  int width;
  int height;
};

}  // namespace lowlux::merge::rows
