#include "calib/profile/json_keys.h"

#include <algorithm>
#include <set>
#include <utility>

#include <nlohmann/json.hpp>

namespace lowlux::calib {
namespace {

/// Keeps the keys of the objects around the value that is read, for a parser of events. After a fault no more is kept.
class KeyEvents {
 public:
  KeyEvents(std::size_t size, const JsonLimits& limits) : size_(size), limits_(limits) {}

  bool null() { return value(); }
  bool boolean(bool /*value*/) { return value(); }
  bool number_integer(std::int64_t /*value*/) { return value(); }
  bool number_unsigned(std::uint64_t /*value*/) { return value(); }
  bool number_float(double /*value*/, const std::string& /*digits*/) { return value(); }
  bool string(std::string& /*value*/) { return value(); }
  bool binary(std::vector<std::uint8_t>& /*bytes*/) { return value(); }

  bool start_object(std::size_t /*elements*/) {
    value();
    ++depth_;
    if (!fault_) levels_.emplace_back();
    return true;
  }
  bool key(std::string& name) {
    if (!fault_) add(name);
    return true;
  }
  bool end_object() {
    --depth_;
    if (!fault_) levels_.pop_back();
    return true;
  }
  bool start_array(std::size_t /*elements*/) {
    value();
    ++depth_;
    return true;
  }
  bool end_array() {
    --depth_;
    return true;
  }
  bool parse_error(std::size_t position, const std::string& /*token*/, const nlohmann::json::exception& error) {
    const bool is_syntax = dynamic_cast<const nlohmann::json::parse_error*>(&error) != nullptr;
    fault_ = JsonFault{.kind = is_syntax ? JsonFault::Kind::not_json : JsonFault::Kind::number_too_large,
                       .byte = std::min(position, size_),  // the end of the text counts as one more byte
                       .reason = error.what(),
                       .keys = {}};
    return false;
  }

  const std::optional<JsonFault>& fault() const { return fault_; }

 private:
  struct Level {
    std::set<std::string> keys;
    std::string last;
  };

  void set(JsonFault::Kind kind) {
    fault_ = JsonFault{.kind = kind, .byte = 0, .reason = {}, .keys = {}};
    levels_ = {};
  }

  bool value() {
    if (!fault_ && depth_ > limits_.max_depth) set(JsonFault::Kind::too_deep);
    return true;
  }

  void add(const std::string& name) {
    Level& level = levels_.back();
    level.last = name;
    if (level.keys.size() == limits_.max_keys) return set(JsonFault::Kind::too_many_keys);
    if (level.keys.insert(name).second) return;
    std::vector<std::string> keys;
    for (Level& outer : levels_) keys.push_back(std::move(outer.last));
    set(JsonFault::Kind::duplicate_key);
    fault_->keys = std::move(keys);
  }

  std::size_t size_;
  JsonLimits limits_;
  std::size_t depth_ = 0;
  std::vector<Level> levels_;
  std::optional<JsonFault> fault_;
};

}  // namespace

std::optional<JsonFault> find_json_fault(std::string_view text, const JsonLimits& limits) {
  KeyEvents events(text.size(), limits);
  nlohmann::json::sax_parse(text, &events);
  return events.fault();
}

}  // namespace lowlux::calib
