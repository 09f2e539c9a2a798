#include "isp/cli/dataset/dataset_check.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "capture/synthetic/synthetic_camera.h"
#include "isp/cli/dataset/dataset_draw.h"
#include "isp/cli/shared/option_values.h"
#include "isp/cli/simulate/scene_argument.h"
#include "isp/model/sensor/given_figures.h"
#include "isp/model/spectrum/spectral_response.h"

namespace lowlux::cli {
namespace {

std::vector<std::string> extremes_of(const DrawnSetting& drawn) {
  const Distribution& d = drawn.distribution;
  if (d.kind == Distribution::Kind::choice) return d.choices;
  if (drawn.setting->kind == SettingKind::number) return {fmt::format("{}", d.low), fmt::format("{}", d.high)};
  return {fmt::format("{:.0f}", d.low), fmt::format("{:.0f}", d.high)};
}

Error with_key(Error error, std::string_view key) {
  const std::string message = in_keys(std::move(error.message));
  const std::string place = fmt::format("{}: ", key);
  return {ErrorCode::malformed, message.starts_with(place) ? message : place + message, {}};
}

/// Checks what the sensor of the arguments sees of their scene.
/// @param scene  small, and without stars
Result<void> check_camera(const SimulateArgs& args, Executor& executor) {
  auto sensor = isp::sensor_named(args.sensor, args.gain, args.figures);
  if (!sensor) return tl::make_unexpected(sensor.error());
  auto response = isp::spectral_response(*sensor, args.optics);
  if (!response) return tl::make_unexpected(response.error());
  if (auto used = isp::check_given_figures(args.figures, *sensor, args.optics); !used) return used;
  SceneArgs small = args.scene;
  small.width = small.height = 32, small.stars = 0;
  const auto scene = scene_of(small, 1, executor);
  if (!scene) return tl::make_unexpected(scene.error());
  const auto camera = capture::make_camera(*std::move(sensor), *response, scene->scene.white, args.options);
  if (!camera) return tl::make_unexpected(camera.error());
  return {};
}

Result<void> check_draw(const DatasetSpec& spec, const DatasetDraw& draw, Executor& executor) {
  return simulate_args(spec, draw).and_then([&](const SimulateArgs& args) { return check_camera(args, executor); });
}

/// Returns the key of the only setting without which a draw is good, after the name of the sensor.
std::string place_of_fault(const DatasetSpec& spec, const DatasetDraw& draw, Executor& executor) {
  for (const DrawnSetting& drawn : draw.sensor->settings) {
    DatasetDraw without = draw;
    without.settings.erase(std::string(drawn.setting->key));
    if (check_draw(spec, without, executor)) {
      return fmt::format("sensors: {}: {}", draw.sensor->name, drawn.setting->key);
    }
  }
  return "sensors: " + draw.sensor->name;
}

/// Returns the least and the largest value of numbers, and all texts.
std::vector<std::string> limits_of(const DrawnSetting& drawn) {
  std::vector<std::string> values = extremes_of(drawn);
  if (drawn.setting->kind == SettingKind::text) return values;
  const auto number = [](const std::string& json) { return number_of(json).value_or(0); };
  const auto [least, largest] = std::ranges::minmax_element(values, {}, number);
  return {*least, *largest};
}

/// Checks each pair of limits of two settings, the others at their first: settings may depend on each other, as black
/// and white level do. Pairs with a first value are those that check_sensor has checked.
Result<void> check_pairs(const DatasetSpec& spec, const DatasetDraw& first, Executor& executor) {
  const std::vector<DrawnSetting>& all = first.sensor->settings;
  const auto others_than_first = [&](const DrawnSetting& drawn) {
    std::vector<std::string> values = limits_of(drawn);
    std::erase(values, first.settings.at(std::string(drawn.setting->key)));
    return values;
  };
  for (auto one = all.begin(); one != all.end(); ++one) {
    const std::vector<std::string> values = others_than_first(*one);
    for (auto other = one + 1; !values.empty() && other != all.end(); ++other) {
      const std::vector<std::string> other_values = others_than_first(*other);
      for (const std::string& value : values) {
        for (const std::string& other_value : other_values) {
          DatasetDraw draw = first;
          draw.settings[std::string(one->setting->key)] = value;
          draw.settings[std::string(other->setting->key)] = other_value;
          if (const auto good = check_draw(spec, draw, executor); !good) {
            return tl::make_unexpected(
                with_key(good.error(), fmt::format("sensors: {}: {} {} with {} {}", first.sensor->name,
                                                   one->setting->key, value, other->setting->key, other_value)));
          }
        }
      }
    }
  }
  return {};
}

/// Checks a sensor with each limit and each choice of one setting, and the limits of two, the other settings at their
/// first.
Result<void> check_sensor(const DatasetSpec& spec, const DatasetSensor& sensor, Executor& executor) {
  DatasetDraw first{.scene = "flat", .sensor = &sensor, .settings = {}};
  for (const DrawnSetting& drawn : sensor.settings) {
    first.settings[std::string(drawn.setting->key)] = extremes_of(drawn).front();
  }
  for (const DrawnSetting& drawn : sensor.settings) {
    DatasetDraw draw{.scene = "flat", .sensor = &sensor, .settings = {}};
    const std::string key(drawn.setting->key);
    for (const std::string& value : extremes_of(drawn)) {
      draw.settings[key] = value;
      if (const auto good = simulate_args(spec, draw); !good) {
        return tl::make_unexpected(with_key(good.error(), key));
      }
    }
  }
  if (const auto good = check_draw(spec, first, executor); !good) {
    return tl::make_unexpected(with_key(good.error(), place_of_fault(spec, first, executor)));
  }
  for (const DrawnSetting& drawn : sensor.settings) {
    DatasetDraw draw = first;
    const std::string key(drawn.setting->key);
    for (const std::string& value : extremes_of(drawn)) {
      draw.settings[key] = value;
      if (const auto good = check_draw(spec, draw, executor); !good) {
        return tl::make_unexpected(with_key(good.error(), fmt::format("sensors: {}: {}", sensor.name, key)));
      }
    }
  }
  return check_pairs(spec, first, executor);
}

/// Checks the first draws: combinations of three and more settings.
Result<void> check_first_draws(const DatasetSpec& spec, Executor& executor) {
  constexpr std::uint64_t max_checked = 64;
  for (std::uint64_t i = 0; i < std::min(spec.count, max_checked); ++i) {
    DatasetDraw draw = draw_sample(spec, spec.first_index + i);
    draw.scene = "flat";
    if (const auto good = check_draw(spec, draw, executor); !good) {
      return tl::make_unexpected(
          with_key(good.error(), fmt::format("sensors: {}: sample {}", draw.sensor->name, spec.first_index + i)));
    }
  }
  return {};
}

}  // namespace

Result<void> check_dataset(const DatasetSpec& spec, Executor& executor) {
  for (const DatasetSensor& sensor : spec.sensors) {
    if (auto good = check_sensor(spec, sensor, executor); !good) return good;
  }
  if (auto good = check_first_draws(spec, executor); !good) return good;
  for (const std::string& scene : spec.scenes) {
    if (!is_generated(scene)) continue;
    const DatasetDraw draw{.scene = scene, .sensor = &spec.sensors.front(), .settings = {}};
    auto args = simulate_args(spec, draw);
    if (!args) return tl::make_unexpected(with_key(args.error(), "scenes"));
    args->scene.width = args->scene.height = 32;
    const auto made = scene_of(args->scene, 1, executor);
    if (!made) return tl::make_unexpected(with_key(made.error(), "scenes"));
  }
  return {};
}

}  // namespace lowlux::cli
