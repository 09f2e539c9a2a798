#include "isp/cli/dataset/dataset_draw.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <functional>
#include <utility>
#include <variant>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "isp/base/file_extension.h"
#include "isp/base/random/random.h"
#include "isp/cli/shared/lines.h"

namespace lowlux::cli {
namespace {

using SortedJson = nlohmann::json;

template <class Number>
Number first_bits(std::string_view sha256) {
  Number value = 0;
  std::from_chars(sha256.data(), sha256.data() + 2 * sizeof value, value, 16);
  return value;
}

/// Returns a number of 0 to 1, both excluded, from the upper 53 bits.
double unit_of(std::uint64_t bits) { return (static_cast<double>(bits >> 11) + 0.5) * 0x1p-53; }

double rounded(double value, double low, double high) {
  const std::string text = fmt::format("{:.6g}", value);
  double out = value;
  std::from_chars(text.data(), text.data() + text.size(), out);
  return std::clamp(out, low, high);
}

/// Returns the value of a setting as an option takes it.
std::string option_text(const std::string& json) {
  const SortedJson value = SortedJson::parse(json);
  return value.is_string() ? value.get<std::string>() : json;
}

/// Returns the value of an option: names of files are relative to the spec.
std::string option_value(const DatasetSpec& spec, const Setting& setting, const std::string& value) {
  const std::string text = option_text(value);
  return setting.key == "light" && has_extension(text, ".csv") ? path_in(spec, text) : text;
}

std::string scene_path(const DatasetSpec& spec, const std::string& scene) {
  if (scene.starts_with("chart:") && has_extension(scene, ".csv")) return "chart:" + path_in(spec, scene.substr(6));
  return is_generated(scene) ? scene : path_in(spec, scene);
}

}  // namespace

std::string in_keys(std::string message) {
  for (const std::string_view unneeded : {"lowlux simulate: ", "; --help lists the options", "\n"}) {
    if (const std::size_t at = message.find(unneeded); at != std::string::npos) message.erase(at, unneeded.size());
  }
  std::vector<Setting> longest_first(settings().begin(), settings().end());
  std::ranges::sort(longest_first, std::greater(), [](const Setting& setting) { return setting.flag.size(); });
  for (const Setting& setting : longest_first) {
    for (std::size_t at = 0; (at = message.find(setting.flag, at)) != std::string::npos;) {
      message.replace(at, setting.flag.size(), setting.key);
      at += setting.key.size();
    }
  }
  return message;
}

std::uint64_t draw_bits(const DatasetSpec& spec, std::uint64_t index, std::string_view quantity) {
  const auto key = first_bits<std::uint64_t>(spec.draw_sha256);
  const auto low = [](std::uint64_t bits) { return static_cast<std::uint32_t>(bits); };
  const auto words = philox4x32_10({low(index), low(index >> 32), first_bits<std::uint32_t>(sha256_of(quantity)), 0},
                                   {low(key), low(key >> 32)});
  return std::uint64_t{words[0]} << 32 | words[1];
}

std::string draw_value(const Distribution& distribution, SettingKind kind, std::uint64_t bits) {
  const double u = unit_of(bits), low = distribution.low, high = distribution.high;
  if (distribution.kind == Distribution::Kind::choice) {
    const std::size_t count = distribution.choices.size();
    return distribution.choices[std::min(static_cast<std::size_t>(u * static_cast<double>(count)), count - 1)];
  }
  const bool uniform = distribution.kind == Distribution::Kind::uniform;
  if (kind == SettingKind::whole || kind == SettingKind::even) {
    const double step = kind == SettingKind::even ? 2 : 1;
    const double value = uniform ? low + u * (high - low + step) : low * std::pow((high + step) / low, u);
    return std::to_string(static_cast<std::int64_t>(std::clamp(step * std::floor(value / step), low, high)));
  }
  // The sum of two products does not overflow where high - low does.
  return SortedJson(rounded(uniform ? (1 - u) * low + u * high : low * std::exp(u * (std::log(high) - std::log(low))),
                            low, high))
      .dump();
}

DatasetDraw draw_sample(const DatasetSpec& spec, std::uint64_t index) {
  const auto place_in = [&](std::size_t count, std::string_view quantity) {
    const double place = unit_of(draw_bits(spec, index, quantity)) * static_cast<double>(count);
    return std::min(static_cast<std::size_t>(place), count - 1);
  };
  DatasetDraw out{.scene = spec.scenes[place_in(spec.scenes.size(), "scene")],
                  .sensor = &spec.sensors[place_in(spec.sensors.size(), "sensor")],
                  .settings = {}};
  for (const DrawnSetting& drawn : out.sensor->settings) {
    const std::string_view key = drawn.setting->key;
    if (!is_generated(out.scene) && (key == "size" || key == "light")) continue;  // an image has its own
    out.settings[std::string(key)] = draw_value(drawn.distribution, drawn.setting->kind, draw_bits(spec, index, key));
  }
  out.settings["seed"] = std::to_string(draw_bits(spec, index, "seed"));
  if (!out.settings.contains("sensor_seed"))
    out.settings["sensor_seed"] = std::to_string(draw_bits(spec, index, "sensor_seed"));
  if (!out.settings.contains("effects")) out.settings["effects"] = "\"all\"";
  return out;
}

Result<SimulateArgs> simulate_args(const DatasetSpec& spec, const DatasetDraw& draw) {
  std::vector<std::string> words{"--no-config", "--sensor=" + draw.sensor->name};
  for (const auto& [key, value] : draw.settings) {
    const auto setting = std::ranges::find(settings(), std::string_view(key), &Setting::key);
    const std::string flag = setting == settings().end() ? "--" + key : std::string(setting->flag);
    const std::string text = setting == settings().end() ? option_text(value) : option_value(spec, *setting, value);
    words.push_back(fmt::format("{}={}", flag, text));
  }
  const ErrorText errors;
  Parsed<SimulateArgs> parsed = parse_simulate(words);
  if (auto* args = std::get_if<SimulateArgs>(&parsed)) {
    args->scene.what = scene_path(spec, draw.scene);
    args->quiet = true;
    return std::move(*args);
  }
  return fail(ErrorCode::malformed, in_keys(errors.text()));
}

}  // namespace lowlux::cli
