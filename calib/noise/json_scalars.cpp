#include "calib/noise/json_scalars.h"

#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace lowlux::calib {
namespace {

constexpr std::size_t max_levels = 16, max_key_bytes = 64;

/// Keeps the path of the value that is read, for a parser of events.
class Events {
 public:
  explicit Events(JsonReader& reader) : reader_(reader) {}

  static bool null() { return true; }
  bool boolean(bool value) { return reader_.flag(here(), value); }
  bool number_integer(std::int64_t value) { return reader_.number(here(), static_cast<double>(value)); }
  bool number_unsigned(std::uint64_t value) { return reader_.number(here(), static_cast<double>(value)); }
  bool number_float(double value, const std::string& /*digits*/) { return reader_.number(here(), value); }
  bool string(std::string& value) { return reader_.text(here(), value); }
  static bool binary(std::vector<std::uint8_t>& /*bytes*/) { return true; }

  bool start_object(std::size_t /*elements*/) { return enter(); }
  bool key(std::string& name) {
    path_.back() = name.size() <= max_key_bytes ? std::move(name) : "[]";
    return true;
  }
  bool end_object() {
    path_.pop_back();
    return reader_.end_object(here());
  }
  bool start_array(std::size_t /*elements*/) { return enter(); }
  bool end_array() {
    path_.pop_back();
    return true;
  }
  bool parse_error(std::size_t position, const std::string& /*token*/, const nlohmann::json::exception& /*error*/) {
    failure_ = fmt::format("this is not JSON, at byte {}", position);
    return false;
  }

  const std::string& failure() const { return failure_; }

 private:
  bool enter() {
    if (path_.size() >= max_levels) {
      failure_ = fmt::format("more than {} levels of JSON", max_levels);
      return false;
    }
    path_.emplace_back("[]");
    return true;
  }
  JsonPath here() const { return path_; }

  JsonReader& reader_;
  std::vector<std::string> path_;
  std::string failure_;
};

}  // namespace

bool is_at(JsonPath path, std::string_view keys) {
  for (const std::string& key : path) {
    if (!keys.starts_with(key)) return false;
    keys.remove_prefix(key.size());
    if (keys.empty()) return &key == &path.back();
    if (keys.front() != '/') return false;
    keys.remove_prefix(1);
  }
  return false;
}

Result<void> read_json(std::string_view json, std::size_t max_bytes, JsonReader& reader) {
  if (json.size() > max_bytes) {
    return fail(ErrorCode::too_large, fmt::format("{} bytes of JSON; at most {} are read", json.size(), max_bytes));
  }
  Events events(reader);
  try {
    if (nlohmann::json::sax_parse(json, &events, nlohmann::json::input_format_t::json, true, true)) return {};
  } catch (const nlohmann::json::exception&) {
    return fail(ErrorCode::malformed, "this is not JSON");
  }
  if (!events.failure().empty()) return fail(ErrorCode::malformed, events.failure());
  return fail(ErrorCode::too_large, "it has more entries than such a file can have");
}

}  // namespace lowlux::calib
