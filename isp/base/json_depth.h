#pragma once

#include <string_view>

namespace lowlux {

/// Deepest nesting of JSON that is read from files: what parsers of JSON copy, compare and print takes stack for each
/// level.
inline constexpr int max_json_depth = 64;

/// Returns whether arrays and objects of a JSON text are nested in more than `levels` levels. Of a text that is not
/// JSON the part before its first error counts right.
bool nests_deeper(std::string_view json, int levels);

}  // namespace lowlux
