#pragma once

#include <functional>
#include <random>
#include <vector>

#include "tests/support/dng/opcode_list.h"

namespace lowlux::test {

/// Holds an opcode that changes values, as a DNG states it and as a function of the test's own.
struct DrawnOpcode {
  Opcode encoded;
  /// Returns the new value of the sample at column x, row y of a plane: the old one outside of its area.
  std::function<double(double value, int x, int y, int plane)> truth;
  bool is_gain = false;
  bool is_map = false;  // a table or a polynomial
};

/// States the image that opcodes are drawn for.
struct OpcodeImage {
  int list = 2;  // 1: values are codes; 2: they are fractions of white
  int width = 0, height = 0, planes = 1;
};

/// Draws an opcode of a kind with an area, pitches and planes at random, and with moderate parameters: values stay in
/// the order in which they are, and change by some per cent.
/// @param id  3 or 7 to 13 (DNG 1.7, chapter 7)
DrawnOpcode draw_opcode(std::uint32_t id, const OpcodeImage& image, std::mt19937& draw);

}  // namespace lowlux::test
