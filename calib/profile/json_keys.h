#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace lowlux::calib {

/// Holds limits of a JSON text.
struct JsonLimits {
  std::size_t max_depth = std::numeric_limits<std::size_t>::max();  // objects and lists around a value
  std::size_t max_keys = std::numeric_limits<std::size_t>::max();   // largest number of keys of one object
};

/// Holds the reason for which a JSON text is not read.
struct JsonFault {
  enum class Kind : std::uint8_t { not_json, number_too_large, too_deep, too_many_keys, duplicate_key };

  Kind kind = Kind::not_json;
  std::size_t byte = 0;           // not_json: the number of bytes read up to the fault
  std::string reason;             // not_json, number_too_large: the message of the JSON library
  std::vector<std::string> keys;  // duplicate_key: the keys that lead to it, outermost first
};

/// Returns the fault of a JSON text, of those within JSON the first; nullopt if it can be read. Duplicate keys are a
/// fault because JSON does not define which of their values holds. The time is linear in the size of the text; that of
/// the JSON library's own callbacks is quadratic in the length of a list of objects.
std::optional<JsonFault> find_json_fault(std::string_view text, const JsonLimits& limits);

}  // namespace lowlux::calib
