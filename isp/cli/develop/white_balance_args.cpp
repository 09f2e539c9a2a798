#include "isp/cli/develop/white_balance_args.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "isp/cli/shared/option_values.h"
#include "isp/model/colour/correlated_colour_temperature.h"

namespace lowlux::cli {
namespace {

using Choice = isp::WhiteBalanceChoice;

constexpr double min_gain = 0.01, max_gain = 100;
constexpr int max_side_px = 65535;

Names<Choice> named_choices() {
  Names<Choice> out{{"as-shot", {.mode = Choice::Mode::as_shot}}, {"auto", {.mode = Choice::Mode::automatic}}};
  for (const isp::WhitePreset preset : isp::all_white_presets) {
    out.emplace(name_of(preset), {.mode = Choice::Mode::preset, .preset = preset});
  }
  return out;
}

std::optional<Choice> temperature_of(const std::string& text) {
  const std::vector<std::string> words = words_of(text);
  if (words.empty() || words.size() > 2) return std::nullopt;
  const auto kelvin = quantity_of(words[0], "K");
  const auto tint = words.size() == 2 ? number_of(words[1]) : 0.0;
  if (!kelvin || *kelvin < isp::white_min_k || *kelvin > isp::white_max_k) return std::nullopt;
  if (!tint || std::fabs(*tint) > isp::max_tint) return std::nullopt;
  return Choice{.mode = Choice::Mode::temperature, .cct_k = *kelvin, .tint = *tint};
}

std::optional<Choice> gains_of(const std::string& text) {
  const auto figures = numbers_of(text, 3);
  if (!figures || figures->size() != 3) return std::nullopt;
  const auto usable = [](double gain) { return gain >= min_gain && gain <= max_gain; };
  if (!std::ranges::all_of(*figures, usable)) return std::nullopt;
  return Choice{.mode = Choice::Mode::gains, .gains = {(*figures)[0], (*figures)[1], (*figures)[2]}};
}

std::optional<Choice> picked_of(const std::string& text) {
  constexpr std::string_view prefix = "pick:";
  if (!text.starts_with(prefix)) return std::nullopt;
  const auto figures = numbers_of(text.substr(prefix.size()), 3);
  if (!figures || figures->size() < 2) return std::nullopt;
  const auto usable = [](double figure) {
    return figure >= 0 && figure <= max_side_px && figure == std::floor(figure);
  };
  if (!std::ranges::all_of(*figures, usable)) return std::nullopt;
  Choice out{.mode = Choice::Mode::picked};
  out.picked.x = static_cast<int>((*figures)[0]);
  out.picked.y = static_cast<int>((*figures)[1]);
  if (figures->size() == 3) out.picked.size = static_cast<int>((*figures)[2]);
  return out.picked.size >= 1 ? std::optional(out) : std::nullopt;
}

}  // namespace

std::optional<std::string> set_white_balance(const std::string& text, Choice& choice) {
  static const Names<Choice> names = named_choices();
  if (const auto named = names.find(text); named != names.end()) {
    choice = named->second;
    return std::nullopt;
  }
  for (const auto read : {temperature_of, gains_of, picked_of}) {
    if (const auto found = read(text)) {
      choice = *found;
      return std::nullopt;
    }
  }
  return fmt::format(
      "is none of {}, a temperature from {:.0f} to {:.0f} K with a tint from -{:g} to {:g} (5000,10), three gains from "
      "{:g} to {:g} (2,1,1.5), or pick:X,Y[,SIZE]",
      joined(names), isp::white_min_k, isp::white_max_k, isp::max_tint, isp::max_tint, min_gain, max_gain);
}

void add_white_balance(CLI::App& app, Choice& choice) {
  add_text(
      app, "--wb", "as-shot|auto|PRESET|KELVIN|R,G,B|PIXEL",
      "white balance: of the camera, estimated, a preset (daylight, cloudy, shade, tungsten, fluorescent, flash), a "
      "colour temperature and tint (5000,10), gains, or neutral at a pixel, pick:X,Y[,SIZE] (default: as-shot)",
      [&choice](const std::string& text) { return set_white_balance(text, choice); });
}

}  // namespace lowlux::cli
