#pragma once

#include <string>
#include <string_view>

namespace lowlux {

/// Deepest nesting of JSON that is read from files: what parsers of JSON copy, compare and print takes stack for each
/// level.
inline constexpr int max_json_depth = 64;

/// Returns whether arrays and objects of a JSON text are nested in more than `levels` levels. Of a text that is not
/// JSON the part before its first error counts right.
bool nests_deeper(std::string_view json, int levels);

/// Returns a value of nlohmann::json as text, in one line if `indent` is -1. Bytes that are not UTF-8 are replaced.
template <class Json>
std::string json_text(const Json& json, int indent = -1) {
  return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

}  // namespace lowlux
