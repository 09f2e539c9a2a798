#include "isp/cli/develop/image_args.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "isp/cli/shared/option_values.h"
#include "isp/model/colour/correlated_colour_temperature.h"
#include "isp/render/capture_sharpening.h"

namespace lowlux::cli {
namespace {

using Choice = isp::WhiteBalanceChoice;

constexpr double min_gain = 0.01, max_gain = 100;
constexpr int max_side_px = 65535;
constexpr int max_place_px = 1'000'000'000;  // places outside of the image are refused where its size is known

Names<Choice> named_choices() {
  Names<Choice> out{{"as-shot", {.mode = Choice::Mode::as_shot}}, {"auto", {.mode = Choice::Mode::automatic}}};
  for (const isp::WhitePreset preset : isp::all_white_presets) {
    out.emplace(name_of(preset), {.mode = Choice::Mode::preset, .preset = preset});
  }
  return out;
}

std::optional<Choice> temperature_of(const std::string& text) {
  const std::vector<std::string> words = split_at_commas(text);
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
    return figure >= 0 && figure <= max_place_px && figure == std::floor(figure);
  };
  if (!std::ranges::all_of(*figures, usable)) return std::nullopt;
  Choice out{.mode = Choice::Mode::picked};
  out.picked.x = static_cast<int>((*figures)[0]);
  out.picked.y = static_cast<int>((*figures)[1]);
  if (figures->size() == 3) out.picked.size = static_cast<int>((*figures)[2]);
  return out.picked.size >= 1 && out.picked.size <= max_side_px ? std::optional(out) : std::nullopt;
}

constexpr double max_saturation = 3;

/// Returns a crop of four whole numbers of pixels, or of four percentages, each with its sign.
std::optional<isp::PictureCrop> crop_of(const std::string& text) {
  const std::vector<std::string> words = split_at_commas(text);
  if (words.size() != 4) return std::nullopt;
  const bool percent = words.front().ends_with('%');
  double figures[4]{};
  for (std::size_t i = 0; i < 4; ++i) {
    std::string word = words[i];
    if (word.ends_with('%') != percent) return std::nullopt;
    if (percent) word.pop_back();
    const auto figure = number_of(word);
    if (!figure || *figure < 0 || *figure > (percent ? 100 : max_side_px)) return std::nullopt;
    if (!percent && *figure != std::floor(*figure)) return std::nullopt;
    figures[i] = *figure;
  }
  if (!(figures[2] > 0 && figures[3] > 0)) return std::nullopt;
  return isp::PictureCrop{figures[0], figures[1], figures[2], figures[3], percent};
}

}  // namespace

std::optional<std::string> set_white_balance(const std::string& text, Choice& choice) {
  static const Names<Choice> names = named_choices();
  for (const auto& [name, named] : names) {
    if (!same_letters(name, text)) continue;
    choice = named;
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
  std::vector<std::string_view> words{"as-shot", "auto"};
  for (const isp::WhitePreset preset : isp::all_white_presets) words.push_back(name_of(preset));
  add_text(
      app, "--wb", fmt::format("{}|KELVIN|R,G,B|PIXEL", fmt::join(words, "|")),
      "white balance: of the camera, estimated, a preset, colour temperature and tint (5000,10), gains, or "
      "pick:X,Y[,SIZE], a place that becomes neutral (default: as-shot)",
      [&choice](const std::string& text) { return set_white_balance(text, choice); }, Comma::separator);
}

void add_adjustments(CLI::App& app, isp::DevelopOptions& options) {
  add_text(app, "--brightness", "EV", "brightness of mid-tones, -1 to 2; black and white do not change (default: 0)",
           store_within({isp::min_brightness_ev, isp::max_brightness_ev, "EV"}, options.tone_shape.brightness_ev));
  add_text(app, "--contrast", "FACTOR", "factor on the slope of the tone curve at middle grey, 0.5 to 1.5 (default: 1)",
           store_within({isp::min_contrast, isp::max_contrast}, options.tone_shape.contrast));
  add_text(app, "--saturation", "FACTOR",
           "factor on the saturation in linear light, 0 to 3; luminance does not change (default: 1)",
           store_within({0, max_saturation}, options.saturation));
}

void add_finish(CLI::App& app, isp::DevelopOptions& options) {
  add_choice<isp::Highlights>(
      app, "--highlights", {{"clip", isp::Highlights::clip}, {"reconstruct", isp::Highlights::reconstruct}},
      [&options](isp::Highlights highlights) { options.highlights = highlights; },
      "saturated areas: make them white, or reconstruct their colour from unsaturated channels and the surroundings "
      "(default: clip)");
  add_text(
      app, "--local-tone", "FRACTION",
      "brighten shadows and darken highlights, 0 to 1, and preserve detail; noise limits the brightening (default: 0)",
      store_within({0, 1}, options.local_tone));
  add_text(
      app, "--sharpen", "off|BLUR",
      "invert a blur of this standard deviation in pixels, 0.3 to 1.5, where detail exceeds the noise (default: off)",
      [&options](const std::string& text) -> std::optional<std::string> {
        options.sharpen_px.reset();
        if (text == "off") return std::nullopt;
        const auto blur = quantity_of(text, "px");
        if (!blur || !(*blur >= isp::min_sharpening_px && *blur <= isp::max_sharpening_px)) {
          return fmt::format("is neither off nor a blur from {} to {} pixels", isp::min_sharpening_px,
                             isp::max_sharpening_px);
        }
        options.sharpen_px = *blur;
        return std::nullopt;
      });
}

void add_framing(CLI::App& app, isp::DevelopOptions& options) {
  add_text(
      app, "--crop", "X,Y,W,H", "part of the upright image to keep, in pixels or in percent (10%,10%,80%,80%)",
      [&options](const std::string& text) -> std::optional<std::string> {
        options.crop = crop_of(text);
        if (options.crop) return std::nullopt;
        return "is not X,Y,W,H: four whole numbers of pixels or four percentages (10%,10%,80%,80%), W and H above 0";
      });
  app.add_option("--max-size", options.max_size,
                 "maximum of the longer side in pixels: larger images are reduced after --crop")
      ->check(CLI::Range(1, max_side_px))
      ->type_name("N");
}

}  // namespace lowlux::cli
