#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "isp/base/result.h"

namespace lowlux::calib {

/// Holds the keys that lead to a value, outermost first. An element of a list has the key "[]", and so does a key of
/// more than 64 bytes: such keys belong to no format that is read here.
using JsonPath = std::span<const std::string>;

/// Returns whether a path consists of these keys, separated by '/': "models/[]/iso".
bool is_at(JsonPath path, std::string_view keys);

/// Takes the values of a JSON text in their order. A function returns false to end the reading with an error: the
/// text has more than its reader stores.
class JsonReader {
 public:
  virtual ~JsonReader() = default;
  virtual bool number(JsonPath path, double value) = 0;
  virtual bool text(JsonPath path, std::string_view value) = 0;
  virtual bool flag(JsonPath path, bool value) = 0;
  /// Called at the end of an object, with the path that leads to it.
  virtual bool end_object(JsonPath path) = 0;
};

/// Reads JSON text, with or without comments, without building a tree: memory is that of one value and of the path.
/// Errors: more than max_bytes; not JSON (the message has the place); deeper than 16 levels; a reader that ended it.
Result<void> read_json(std::string_view json, std::size_t max_bytes, JsonReader& reader);

}  // namespace lowlux::calib
