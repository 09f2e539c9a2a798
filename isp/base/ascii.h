#pragma once

namespace lowlux {

/// The lower case of an ASCII letter, in any locale; other bytes as they are.
constexpr char ascii_lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

}  // namespace lowlux
