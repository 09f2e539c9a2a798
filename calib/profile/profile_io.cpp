#include "calib/profile/profile_io.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "calib/profile/json_keys.h"
#include "calib/profile/profile_schema.h"

namespace lowlux::calib {
namespace {

using Json = nlohmann::ordered_json;
using Names = std::initializer_list<const char*>;

constexpr std::size_t deepest = 8;    // a profile has six levels
constexpr std::size_t max_keys = 64;  // of one object; the JSON library compares each with all previous ones

/// Reads one JSON object; finish() reports unexpected keys.
class Reader {
 public:
  Reader(const Json& node, std::string path, ProfileFailure& failure)
      : node_(node), path_(std::move(path)), failure_(failure) {
    if (!node.is_object()) wrong_type(path_, "an object", node);
  }

  void finish() {
    if (failure_.error) return;
    for (const auto& [key, value] : node_.items()) {
      if (!asked_.contains(key)) {
        failure_.set(ErrorCode::malformed, joined(path_, key), "this key is not known; is it misspelt?");
      }
    }
  }

  void text(const char* key, std::string& out) {
    const Json* value = member(key);
    if (value == nullptr) return;
    if (!value->is_string()) return wrong_type(joined(path_, key), "text", *value);
    out = value->get<std::string>();
  }

  void number(const char* key, double& out, const Range& range) {
    const Json* value = member(key);
    if (value == nullptr) return;
    if (!value->is_number()) return wrong_type(joined(path_, key), "a number", *value);
    const auto found = value->get<double>();
    if (check_range(found, range, joined(path_, key), failure_)) out = found;
  }

  void integer(const char* key, int& out, const Range& range) {
    double found = 0;
    number(key, found, range);
    if (failure_.error) return;
    if (found != std::floor(found)) {
      return failure_.set(ErrorCode::malformed, joined(path_, key),
                          fmt::format("found {:g}, not a whole number", found));
    }
    out = static_cast<int>(found);
  }

  void optional_number(const char* key, std::optional<double>& out, const Range& range) {
    if (failure_.error) return;
    asked_.insert(key);
    if (!node_.contains(key)) return;
    out.emplace();
    number(key, *out, range);
  }

  void estimate(const char* key, double& value, double& error, const Range& range) {
    object(key, [&](Reader& inner) {
      inner.number("value", value, range);
      inner.number("standard_error", error, {});
    });
  }

  template <class Enum>
  void choice(const char* key, Enum& out, Names names) {
    std::string found;
    text(key, found);
    if (failure_.error) return;
    int index = 0;
    std::string possible;
    for (const char* name : names) {
      if (found == name) {
        out = static_cast<Enum>(index);
        return;
      }
      possible += possible.empty() ? name : std::string(", ") + name;
      ++index;
    }
    failure_.set(ErrorCode::malformed, joined(path_, key),
                 fmt::format("found \"{}\", expected one of {}", found, possible));
  }

  template <class Visit>
  void object(const char* key, const Visit& visit) {
    const Json* value = member(key);
    if (value == nullptr) return;
    Reader inner(*value, joined(path_, key), failure_);
    visit(inner);
    inner.finish();
  }

  template <class T, class Visit>
  void optional_object(const char* key, std::optional<T>& out, const Visit& visit) {
    if (failure_.error) return;
    asked_.insert(key);
    if (!node_.contains(key)) return;
    out.emplace();
    object(key, [&](Reader& inner) { visit(inner, *out); });
  }

  /// Reads three rows of three numbers.
  void matrix(const char* key, Matrix3& out) {
    const Json* rows = array(key, 3, 3);
    for (std::size_t i = 0; rows != nullptr && i < 9 && !failure_.error; ++i) {
      const std::string path = indexed(joined(path_, key), i / 3);
      const Json& row = (*rows)[i / 3];
      if (!row.is_array() || row.size() != 3) {
        return failure_.set(ErrorCode::malformed, path, "expected a list of 3 numbers");
      }
      if (!row[i % 3].is_number()) return wrong_type(indexed(path, i % 3), "a number", row[i % 3]);
      const auto found = row[i % 3].get<double>();
      if (check_range(found, matrix_entries, indexed(path, i % 3), failure_)) out[i / 3][i % 3] = found;
    }
  }

  template <class T, class Visit>
  void list(const char* key, std::vector<T>& out, std::size_t most, const Visit& visit) {
    const Json* value = array(key, 0, most);
    if (value == nullptr) return;
    out.resize(value->size());
    elements(*value, key, out, visit);
  }

  void texts(const char* key, std::vector<std::string>& out, std::size_t most) {
    const Json* value = array(key, 0, most);
    if (value == nullptr) return;
    for (std::size_t i = 0; i < value->size(); ++i) {
      if (!(*value)[i].is_string()) return wrong_type(indexed(joined(path_, key), i), "text", (*value)[i]);
      out.push_back((*value)[i].get<std::string>());
    }
  }

 private:
  const Json* member(const char* key) {
    if (failure_.error) return nullptr;
    asked_.insert(key);
    const auto found = node_.find(key);
    if (found != node_.end()) return &*found;
    failure_.set(ErrorCode::malformed, joined(path_, key), "this key is missing");
    return nullptr;
  }

  const Json* array(const char* key, std::size_t least, std::size_t most) {
    const Json* value = member(key);
    if (value == nullptr) return nullptr;
    if (!value->is_array()) {
      wrong_type(joined(path_, key), "a list", *value);
      return nullptr;
    }
    if (value->size() >= least && value->size() <= most) return value;
    failure_.set(ErrorCode::malformed, joined(path_, key),
                 fmt::format("found {} entries, expected {} to {}", value->size(), least, most));
    return nullptr;
  }

  template <class Container, class Visit>
  void elements(const Json& value, const char* key, Container& out, const Visit& visit) {
    for (std::size_t i = 0; i < out.size() && !failure_.error; ++i) {
      Reader inner(value[i], indexed(joined(path_, key), i), failure_);
      visit(inner, out[i]);
      inner.finish();
    }
  }

  void wrong_type(const std::string& path, const char* expected, const Json& found) {
    failure_.set(ErrorCode::malformed, path, fmt::format("expected {}, found {}", expected, found.type_name()));
  }

  const Json& node_;
  std::string path_;
  ProfileFailure& failure_;
  std::set<std::string> asked_;
};

Error error_of(const JsonFault& fault, std::string_view text) {
  ProfileFailure failure;
  switch (fault.kind) {
    case JsonFault::Kind::not_json: {
      const auto line = 1 + std::ranges::count(text.substr(0, fault.byte), '\n');
      return {ErrorCode::malformed,
              fmt::format("the profile is not JSON, or damaged: its line {} cannot be read, near byte {} of {}; "
                          "restore the file, or calibrate again",
                          line, fault.byte, text.size()),
              ""};
    }
    case JsonFault::Kind::number_too_large:
      return {ErrorCode::malformed, "the profile is not JSON: restore the file, or calibrate again", ""};
    case JsonFault::Kind::too_deep:
      failure.set(ErrorCode::malformed, "", "nested deeper than a valid profile");
      break;
    case JsonFault::Kind::too_many_keys:
      failure.set(ErrorCode::malformed, "", fmt::format("an object has more than {} keys", max_keys));
      break;
    case JsonFault::Kind::duplicate_key: {
      std::string path;
      for (const std::string& key : fault.keys) path = joined(path, key);
      failure.set(ErrorCode::malformed, path, "this key is given twice");
      break;
    }
  }
  return *failure.error;
}

Result<Json> parsed(std::string_view text) {
  if (text.size() > largest_profile_bytes) {
    return fail(ErrorCode::too_large,
                fmt::format("the profile has {} bytes, at most {} are read", text.size(), largest_profile_bytes));
  }
  if (const auto fault = find_json_fault(text, {.max_depth = deepest, .max_keys = max_keys})) {
    return tl::make_unexpected(error_of(*fault, text));
  }
  return Json::parse(text);
}

}  // namespace

Result<CameraProfile> parse_profile(std::string_view text) {
  const auto document = parsed(text);
  if (!document) return tl::make_unexpected(document.error());
  ProfileFailure failure;
  CameraProfile out;
  Reader reader(*document, "", failure);
  std::string format;
  int version = 0;
  reader.text("format", format);
  if (!failure.error && format != profile_format) {
    failure.set(ErrorCode::malformed, "format", fmt::format(R"(found "{}", expected "{}")", format, profile_format));
  }
  reader.integer("version", version, {1, 1e9});
  if (!failure.error && version > profile_version) {
    failure.set(
        ErrorCode::unsupported, "version",
        fmt::format("found {}, this version of lowlux reads up to {}; use a newer version", version, profile_version));
  }
  visit_profile(reader, out);
  reader.finish();
  if (!failure.error) check_together(out, failure);
  if (failure.error) return tl::make_unexpected(*failure.error);
  return out;
}

namespace {

using Json = nlohmann::ordered_json;
using Names = std::initializer_list<const char*>;

/// Writes one JSON object.
class Writer {
 public:
  Writer(Json& node, std::string path, ProfileFailure& failure)
      : node_(node), path_(std::move(path)), failure_(failure) {
    node = Json::object();
  }

  void text(const char* key, const std::string& value) { node_[key] = value; }
  void number(const char* key, double value, const Range& range) {
    check_range(value, range, joined(path_, key), failure_);
    node_[key] = value;
  }
  void integer(const char* key, int value, const Range& range) {
    check_range(value, range, joined(path_, key), failure_);
    node_[key] = value;
  }
  void optional_number(const char* key, const std::optional<double>& value, const Range& range) {
    if (value) number(key, *value, range);
  }
  void estimate(const char* key, double value, double error, const Range& range) {
    object(key, [&](Writer& inner) {
      inner.number("value", value, range);
      inner.number("standard_error", error, {});
    });
  }
  template <class Enum>
  void choice(const char* key, Enum value, Names names) {
    node_[key] = names.begin()[static_cast<int>(value)];
  }
  template <class Visit>
  void object(const char* key, const Visit& visit) {
    Writer inner(node_[key], joined(path_, key), failure_);
    visit(inner);
  }
  template <class T, class Visit>
  void optional_object(const char* key, const std::optional<T>& value, const Visit& visit) {
    if (value) object(key, [&](Writer& inner) { visit(inner, *value); });
  }
  void matrix(const char* key, const Matrix3& value) {
    Json& rows = node_[key] = Json::array();
    for (std::size_t i = 0; i < 9; ++i) {
      const std::string path = indexed(indexed(joined(path_, key), i / 3), i % 3);
      check_range(value[i / 3][i % 3], matrix_entries, path, failure_);
      if (i % 3 == 0) rows.push_back(Json::array());
      rows.back().push_back(value[i / 3][i % 3]);
    }
  }
  template <class Container, class Visit>
  void list(const char* key, const Container& values, std::size_t most, const Visit& visit) {
    Json& array = node_[key] = Json::array();
    const std::string path = joined(path_, key);
    if (values.size() > most) {
      return failure_.set(ErrorCode::too_large, path,
                          fmt::format("found {} entries, expected at most {}", values.size(), most));
    }
    for (std::size_t i = 0; i < values.size(); ++i) {
      Writer inner(array.emplace_back(), indexed(path, i), failure_);
      visit(inner, values[i]);
    }
  }
  void texts(const char* key, const std::vector<std::string>& values, std::size_t most) {
    if (values.size() > most) {
      failure_.set(ErrorCode::too_large, joined(path_, key),
                   fmt::format("found {} entries, expected at most {}", values.size(), most));
    }
    node_[key] = values;
  }

 private:
  Json& node_;
  std::string path_;
  ProfileFailure& failure_;
};

}  // namespace

Result<std::string> profile_text(const CameraProfile& profile) {
  ProfileFailure failure;
  Json document;
  Writer writer(document, "", failure);
  writer.text("format", profile_format);
  writer.integer("version", profile_version, {1, 1e9});
  visit_profile(writer, profile);
  if (!failure.error) check_together(profile, failure);
  if (failure.error) return tl::make_unexpected(*failure.error);
  try {
    return document.dump(2) + "\n";
  } catch (const Json::exception& e) {
    return fail(ErrorCode::invalid_argument, fmt::format("a text of the profile is not UTF-8: {}", e.what()));
  }
}

}  // namespace lowlux::calib
