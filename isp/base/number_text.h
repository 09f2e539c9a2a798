#pragma once

#include <array>
#include <charconv>
#include <string>

namespace lowlux {

/// A number for people or a table, as printf's %g with that many digits has it: "12.5", "65535", "1e-09", "nan". With a
/// decimal point, whatever the program's locale says.
inline std::string number_text(double value, int digits = 10) {
  std::array<char, 40> text{};
  const auto written = std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::general, digits);
  return {text.data(), written.ptr};
}

}  // namespace lowlux
