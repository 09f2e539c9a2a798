#pragma once

#include <array>
#include <charconv>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace lowlux {

/// Returns the lower case of an ASCII letter, in any locale; other bytes unchanged.
constexpr char ascii_lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

/// Returns a number as text for people or a table, as printf's %g with that many digits: "12.5", "65535", "1e-09",
/// "nan". It has a decimal point in every locale.
inline std::string number_text(double value, int digits = 10) {
  std::array<char, 40> text{};
  const auto written = std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::general, digits);
  return {text.data(), written.ptr};
}

/// Returns the known names similar to an unknown one, as the suggestion of an error message. A name is near if `wanted`
/// begins it, or if at most a third of the wanted letters (at least one) have to be inserted, deleted, replaced or
/// swapped with their neighbour: the restricted Damerau-Levenshtein distance (optimal string alignment), where no
/// substring is edited twice. Case is ignored (ASCII).
/// @return at most 3, nearest first; at equal distance the longer common beginning, then the order of `known`. They
/// view the text of `known`. Empty if nothing is near, if `wanted` is empty or longer than 64 bytes.
std::vector<std::string_view> near_matches(std::string_view wanted, std::span<const std::string_view> known);

}  // namespace lowlux
