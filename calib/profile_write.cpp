#include <initializer_list>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "calib/profile_io.h"
#include "calib/profile_schema.h"

namespace lowlux::calib {
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
                          fmt::format("found {} entries, a profile holds at most {}", values.size(), most));
    }
    for (std::size_t i = 0; i < values.size(); ++i) {
      Writer inner(array.emplace_back(), indexed(path, i), failure_);
      visit(inner, values[i]);
    }
  }
  void texts(const char* key, const std::vector<std::string>& values, std::size_t most) {
    if (values.size() > most) {
      failure_.set(ErrorCode::too_large, joined(path_, key),
                   fmt::format("found {} entries, a profile holds at most {}", values.size(), most));
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
