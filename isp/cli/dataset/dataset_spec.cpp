#include "isp/cli/dataset/dataset_spec.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "calib/profile/json_keys.h"
#include "capture/file/file_bytes.h"
#include "isp/base/file_extension.h"
#include "isp/base/json_text.h"
#include "isp/base/text.h"
#include "isp/cli/shared/option_values.h"

namespace lowlux::cli {
namespace {

using SortedJson = nlohmann::json;

constexpr std::array<std::string_view, 8> own_keys{"seed",    "first_index", "count",           "scenes",
                                                   "sensors", "mask",        "truth_electrons", "format"};
constexpr std::uint64_t max_end = std::uint64_t{1} << 63;

tl::unexpected<Error> wrong_key(const std::string& key, const std::string& what) {
  return fail(ErrorCode::malformed, key + ": " + what);
}

tl::unexpected<Error> unknown(const std::string& key, const std::string& place, bool in_sensor) {
  std::vector<std::string_view> known;
  for (const Setting& setting : settings()) known.push_back(setting.key);
  if (!in_sensor) known.insert(known.end(), own_keys.begin(), own_keys.end());
  const auto near = near_matches(key, known);
  return wrong_key(place + key, near.empty() ? "unknown key; docs/using.md lists them"
                                             : fmt::format("unknown key; similar keys: {}", fmt::join(near, ", ")));
}

bool is_value(const SortedJson& value, SettingKind kind) {
  switch (kind) {
    case SettingKind::number:
      return value.is_number();
    case SettingKind::whole:
    case SettingKind::even:
      return value.is_number_integer();
    case SettingKind::text:
      break;
  }
  return value.is_string() || value.is_number();  // the number of a gain setting
}

const char* kind_text(SettingKind kind) {
  return kind == SettingKind::number ? "a number" : kind == SettingKind::text ? "a text" : "a whole number";
}

Result<Distribution> range_of(const SortedJson& range, const std::string& name, SettingKind kind,
                              const std::string& key) {
  Distribution out{.kind = name == "uniform" ? Distribution::Kind::uniform : Distribution::Kind::log_uniform};
  if (kind == SettingKind::text) return wrong_key(key, fmt::format("a text setting has no {} range: use choice", name));
  if (!range.is_array() || range.size() != 2 || !is_value(range[0], kind) || !is_value(range[1], kind)) {
    return wrong_key(key, fmt::format("{} is not [LOW, HIGH] with {} for each", name, kind_text(kind)));
  }
  out.low = range[0].get<double>(), out.high = range[1].get<double>();
  if (!std::isfinite(out.low) || !std::isfinite(out.high)) return wrong_key(key, "a limit of the range is not finite");
  if (out.low == out.high) {
    return wrong_key(key, fmt::format("the range {} is empty: write the value instead", range.dump()));
  }
  if (out.low > out.high) {
    return wrong_key(key, fmt::format("the range {} is reversed: write the lower limit first", range.dump()));
  }
  if (out.kind == Distribution::Kind::log_uniform && !(out.low > 0)) {
    return wrong_key(key, fmt::format("the range {} of log_uniform does not begin above 0", range.dump()));
  }
  constexpr double max_whole = 9007199254740992;  // 2^53
  if (kind != SettingKind::number && (out.low < -max_whole || out.high > max_whole)) {
    return wrong_key(key, "a limit of the range exceeds 2^53");
  }
  if (kind == SettingKind::even && (std::fmod(out.low, 2) != 0 || std::fmod(out.high, 2) != 0)) {
    return wrong_key(key, fmt::format("the limits of the range {} are not even", range.dump()));
  }
  return out;
}

Result<Distribution> distribution_of(const SortedJson& value, SettingKind kind, const std::string& key) {
  if (is_value(value, kind)) return Distribution{.choices = {json_text(value)}};
  if (!value.is_object()) return wrong_key(key, fmt::format("is neither {} nor a distribution", kind_text(kind)));
  if (value.size() != 1) return wrong_key(key, "a distribution is one of uniform, log_uniform and choice");
  const std::string& name = value.begin().key();
  const SortedJson& inner = value.begin().value();
  if (name == "uniform" || name == "log_uniform") return range_of(inner, name, kind, key);
  if (name != "choice") {
    return wrong_key(key, fmt::format("unknown distribution '{}': uniform, log_uniform and choice are known", name));
  }
  if (!inner.is_array() || inner.empty()) return wrong_key(key, "choice is not a list of at least one value");
  for (const SortedJson& item : inner) {
    if (!is_value(item, kind))
      return wrong_key(key, fmt::format("choice has {}, which is not {}", item.dump(), kind_text(kind)));
  }
  Distribution out;
  for (const SortedJson& item : inner) out.choices.push_back(json_text(item));
  return out;
}

/// Returns the setting of a key; null: it is not one.
const Setting* setting_of(std::string_view key) {
  const auto found = std::ranges::find(settings(), key, &Setting::key);
  return found == settings().end() ? nullptr : &*found;
}

/// Adds a setting, in place of one of the same key.
Result<void> put_setting(const std::string& key, const SortedJson& value, const std::string& place,
                         std::vector<DrawnSetting>& all) {
  const Setting* setting = setting_of(key);
  auto distribution = distribution_of(value, setting->kind, place + key);
  if (!distribution) return tl::make_unexpected(distribution.error());
  const auto old = std::ranges::find(all, setting, &DrawnSetting::setting);
  if (old != all.end()) all.erase(old);
  all.push_back({setting, *std::move(distribution)});
  return {};
}

Result<DatasetSensor> sensor_of(const SortedJson& entry, std::vector<DrawnSetting> common) {
  if (entry.is_string()) return DatasetSensor{entry.get<std::string>(), std::move(common)};
  if (!entry.is_object() || !entry.contains("name") || !entry["name"].is_string()) {
    return wrong_key("sensors", "an entry is neither a name nor an object with a name");
  }
  DatasetSensor out{entry["name"].get<std::string>(), std::move(common)};
  const std::string place = "sensors: " + out.name + ": ";
  for (const auto& [key, value] : entry.items()) {
    if (key == "name") continue;
    if (setting_of(key) == nullptr) return unknown(key, place, true);
    if (const auto put = put_setting(key, value, place, out.settings); !put) return tl::make_unexpected(put.error());
  }
  return out;
}

/// Parses JSON. Errors: another text; a key that an object has twice; more than max_json_depth levels.
Result<SortedJson> parse(const std::string& text) {
  if (nests_deeper(text, max_json_depth)) {
    return fail(ErrorCode::malformed, fmt::format("is nested in more than {} levels of brackets", max_json_depth));
  }
  if (const auto fault = calib::find_json_fault(text, {})) {
    if (fault->kind == calib::JsonFault::Kind::duplicate_key) {
      return wrong_key(fault->keys.back(), "the key is given twice");
    }
    const std::string& what = fault->reason;
    return fail(ErrorCode::malformed, "is not JSON: " + what.substr(std::min(what.find("] ") + 2, what.size())));
  }
  SortedJson json = SortedJson::parse(text);
  if (!json.is_object()) return fail(ErrorCode::malformed, "is not a JSON object");
  return json;
}

Result<std::uint64_t> whole_of(const SortedJson& json, const char* key, std::uint64_t fallback, std::uint64_t most) {
  if (!json.contains(key)) return fallback;
  const SortedJson& value = json[key];
  if (!value.is_number_unsigned() || value.get<std::uint64_t>() > most) {
    return wrong_key(key, fmt::format("{} is not a whole number of 0 to {}", value.dump(), most));
  }
  return value.get<std::uint64_t>();
}

Result<bool> flag_of(const SortedJson& json, const char* key, bool fallback) {
  if (!json.contains(key)) return fallback;
  if (!json[key].is_boolean()) return wrong_key(key, "is neither true nor false");
  return json[key].get<bool>();
}

Result<std::optional<SampleFormat>> sample_format_of(const SortedJson& json) {
  if (!json.contains("format")) return std::nullopt;
  const Names<SampleFormat> names{
      {"dng", SampleFormat::dng}, {"npy", SampleFormat::npy}, {"safetensors", SampleFormat::safetensors}};
  const auto found = names.find(json["format"].is_string() ? json["format"].get<std::string>() : "");
  if (found == names.end()) return wrong_key("format", fmt::format("is not one of {}", joined(names)));
  return found->second;
}

Result<void> set_own_keys(const SortedJson& json, DatasetSpec& spec) {
  for (const char* key : {"count", "scenes", "sensors"}) {
    if (!json.contains(key)) return wrong_key(key, "the key is missing");
  }
  for (const char* key : {"scenes", "sensors"}) {
    if (!json[key].is_array() || json[key].empty()) return wrong_key(key, "is not a list of at least one");
  }
  const auto seed = whole_of(json, "seed", 1, ~std::uint64_t{0});
  const auto first = whole_of(json, "first_index", 0, max_end - 1);
  const auto count = whole_of(json, "count", 0, max_end);
  const auto mask = flag_of(json, "mask", true), electrons = flag_of(json, "truth_electrons", false);
  for (const auto* number : {&seed, &first, &count}) {
    if (!*number) return tl::make_unexpected(number->error());
  }
  for (const auto* flag : {&mask, &electrons}) {
    if (!*flag) return tl::make_unexpected(flag->error());
  }
  const auto format = sample_format_of(json);
  if (!format) return tl::make_unexpected(format.error());
  if (*count == 0) return wrong_key("count", "must be at least 1");
  if (*count > max_end - *first) return wrong_key("count", "first_index + count exceeds 2^63");
  spec.first_index = *first, spec.count = *count, spec.mask = *mask, spec.truth_electrons = *electrons;
  spec.format = *format;
  for (const SortedJson& scene : json["scenes"]) {
    if (!scene.is_string()) return wrong_key("scenes", fmt::format("{} is not a string", scene.dump()));
    spec.scenes.push_back(scene.get<std::string>());
  }
  return {};
}

Result<void> set_sensors(const SortedJson& json, DatasetSpec& spec) {
  std::vector<DrawnSetting> common;
  for (const auto& [key, value] : json.items()) {
    if (std::ranges::find(own_keys, key) != own_keys.end()) continue;
    if (setting_of(key) == nullptr) return unknown(key, "", false);
    if (auto put = put_setting(key, value, "", common); !put) return put;
  }
  for (const SortedJson& entry : json["sensors"]) {
    auto sensor = sensor_of(entry, common);
    if (!sensor) return tl::make_unexpected(sensor.error());
    spec.sensors.push_back(*std::move(sensor));
  }
  return {};
}

/// Adds the files that the spec names, each once.
Result<void> set_inputs(DatasetSpec& spec) {
  std::set<std::pair<std::string, std::string>> named;  // file, key
  for (const std::string& scene : spec.scenes) {
    if (!is_generated(scene)) named.emplace(scene, "scenes");
    if (scene.starts_with("chart:") && has_extension(scene, ".csv")) named.emplace(scene.substr(6), "scenes");
  }
  for (const DatasetSensor& sensor : spec.sensors) {
    for (const DrawnSetting& drawn : sensor.settings) {
      if (drawn.setting->key != "light") continue;
      for (const std::string& choice : drawn.distribution.choices) {
        const SortedJson light = SortedJson::parse(choice);
        if (light.is_string() && has_extension(light.get<std::string>(), ".csv")) named.emplace(light, "light");
      }
    }
  }
  for (const auto& [file, key] : named) {
    const auto hash = sha256_of_file(path_in(spec, file));
    if (!hash) return fail(hash.error().code, fmt::format("{}: {}: {}", key, file, hash.error().message));
    spec.inputs.push_back({file, *hash});
  }
  return {};
}

constexpr std::array all_settings{
    Setting{"size", "--size", SettingKind::text},
    Setting{"light", "--light", SettingKind::text},
    Setting{"luminance_cd_m2", "--luminance", SettingKind::number},
    Setting{"stars", "--stars", SettingKind::whole},
    Setting{"star_luminance_cd_m2", "--star-luminance", SettingKind::number},
    Setting{"gain", "--gain", SettingKind::text},
    Setting{"camera", "--camera", SettingKind::text},
    Setting{"exposure_s", "--exposure", SettingKind::number},
    Setting{"f_number", "--f-number", SettingKind::number},
    Setting{"lens_blur_px", "--lens-blur", SettingKind::number},
    Setting{"temperature_c", "--temperature", SettingKind::number},
    Setting{"cfa", "--cfa", SettingKind::text},
    Setting{"masked_columns", "--masked-columns", SettingKind::even},
    Setting{"effects", "--effects", SettingKind::text},
    Setting{"sampling", "--sampling", SettingKind::text},
    Setting{"sensor_seed", "--sensor-seed", SettingKind::whole},
    Setting{"frames", "--frames", SettingKind::whole},
    Setting{"system_gain_dn_per_e", "--system-gain", SettingKind::number},
    Setting{"read_noise_e", "--read-noise", SettingKind::number},
    Setting{"full_well_e", "--full-well", SettingKind::number},
    Setting{"bits", "--bits", SettingKind::whole},
    Setting{"black_level_dn", "--black-level", SettingKind::number},
    Setting{"white_level_dn", "--white-level", SettingKind::number},
    Setting{"dark_current_e_per_s", "--dark-current", SettingKind::number},
    Setting{"dark_temperature_c", "--dark-temperature", SettingKind::number},
    Setting{"dark_doubling_c", "--dark-doubling", SettingKind::number},
    Setting{"dark_activation_ev", "--dark-activation", SettingKind::number},
    Setting{"dark_floor_e_per_s", "--dark-floor", SettingKind::number},
    Setting{"prnu", "--prnu", SettingKind::number},
    Setting{"dsnu", "--dsnu", SettingKind::number},
    Setting{"hot_pixel_fraction", "--hot-pixels", SettingKind::number},
    Setting{"hot_pixel_current_e_per_s", "--hot-current", SettingKind::number},
    Setting{"telegraph_fraction", "--telegraph-pixels", SettingKind::number},
    Setting{"telegraph_e", "--telegraph-noise", SettingKind::number},
    Setting{"crosstalk", "--crosstalk", SettingKind::number},
    Setting{"glow_e_per_s", "--glow", SettingKind::number},
    Setting{"glow_position", "--glow-position", SettingKind::text},
    Setting{"glow_length", "--glow-length", SettingKind::number},
    Setting{"row_noise_e", "--row-noise", SettingKind::number},
    Setting{"column_noise_e", "--column-noise", SettingKind::number},
    Setting{"pixel_pitch_um", "--pixel-pitch", SettingKind::number},
    Setting{"peak_quantum_efficiency", "--peak-qe", SettingKind::number},
    Setting{"iso", "--iso", SettingKind::number},
    Setting{"quantise", "--quantise", SettingKind::text},
};

}  // namespace

bool is_generated(const std::string& scene) {
  return scene == "dark" || scene == "flat" || scene == "chart" || scene.starts_with("chart:");
}

std::string path_in(const DatasetSpec& spec, const std::string& file) {
  const std::filesystem::path name(file);
  return name.is_absolute() ? file : (std::filesystem::path(spec.folder) / name).string();
}

Result<DatasetSpec> read_dataset_spec(const std::string& file) {
  constexpr std::uint64_t max_bytes = 64 << 20;
  const auto located = [&](Error error) {
    error.where = file;
    return error;
  };
  const auto bytes = capture::read_file_bytes(file, max_bytes);
  if (!bytes) return tl::make_unexpected(located(bytes.error()));
  auto json = parse(std::string(reinterpret_cast<const char*>(bytes->data()), bytes->size()));
  if (!json) return tl::make_unexpected(located(json.error()));
  DatasetSpec spec;
  spec.folder = std::filesystem::path(file).parent_path().string();
  if (spec.folder.empty()) spec.folder = ".";
  const auto set = set_own_keys(*json, spec).and_then([&] { return set_sensors(*json, spec); }).and_then([&] {
    return set_inputs(spec);
  });
  if (!set) return tl::make_unexpected(located(set.error()));
  json->erase("first_index");
  json->erase("count");
  SortedJson inputs = SortedJson::array();
  for (const DatasetInput& input : spec.inputs) {
    inputs.push_back({{"name", input.name}, {"bytes", input.hash.bytes}, {"sha256", input.hash.sha256}});
  }
  spec.identity = json_text(SortedJson{{"spec", *json}, {"inputs", inputs}});
  spec.sha256 = sha256_of(spec.identity);
  json->erase("format");
  spec.draw_sha256 = sha256_of(json_text(SortedJson{{"spec", *std::move(json)}, {"inputs", std::move(inputs)}}));
  return spec;
}

std::span<const Setting> settings() { return all_settings; }

}  // namespace lowlux::cli
