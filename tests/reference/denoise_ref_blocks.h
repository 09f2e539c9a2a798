#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

namespace lowlux::reference::denoising {

struct Image {
  int width = 0, height = 0;
  std::vector<double> v{};

  Image() = default;
  Image(int w, int h) : width(w), height(h), v(static_cast<std::size_t>(w) * h) {}
  double& at(int x, int y) { return v[static_cast<std::size_t>(y) * width + x]; }
  double at(int x, int y) const { return v[static_cast<std::size_t>(y) * width + x]; }
  double near(int x, int y) const { return at(std::clamp(x, 0, width - 1), std::clamp(y, 0, height - 1)); }
};
using Four = std::array<Image, 4>;  // R G1 G2 B, then L C1 C2 C3

Image down2(const Image& in);      // 2x2 means
Image up2(const Image& in);        // bilinear, edges repeated
Image binomial3(const Image& in);  // 3x3 weights 1 2 1, edges repeated

/// Gives one plane, where `seen` is 0, the mean of the smallest square of 2, 4 ... cells of which any is seen, bilinear
/// between squares; on the last of `levels` linear along rows, then from row to row.
void fill_unseen(const Image& seen, Image& value, int levels);

struct Shrunk {
  Four value;
  Four residual;  // variance
};

/// Computes one level of one pass: with rows of blocks `rows_apart` cells apart. `pilot` is null in the first pass.
Shrunk shrink(const Four& x, const Four& variance, const Four* pilot, int rows_apart, int level, int levels);

}  // namespace lowlux::reference::denoising
