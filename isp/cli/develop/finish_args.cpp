#include "isp/cli/develop/finish_args.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "isp/cli/shared/option_values.h"
#include "isp/render/capture_sharpening.h"

namespace lowlux::cli {
namespace {

constexpr int max_side_px = 65535;
constexpr double max_saturation = 3;

/// Returns a crop of four whole numbers of pixels, or of four percentages, each with its sign.
std::optional<isp::PictureCrop> crop_of(const std::string& text) {
  const std::vector<std::string> words = words_of(text);
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

/// Returns a store for a number within a range, the unit in any case or left out.
OptionStore store_in_range(double least, double most, const char* unit, double& out) {
  return [=, &out](const std::string& text) -> std::optional<std::string> {
    const auto figure = *unit == '\0' ? number_of(text) : quantity_of(text, unit);
    if (!figure || !(*figure >= least && *figure <= most))
      return fmt::format("is not a number from {} to {}", least, most);
    out = *figure;
    return std::nullopt;
  };
}

}  // namespace

void add_adjustments(CLI::App& app, isp::DevelopOptions& options) {
  add_text(app, "--brightness", "EV", "show mid-tones 2^EV times as bright, black and white stay: -1 to 2 (default: 0)",
           store_in_range(isp::min_brightness_ev, isp::max_brightness_ev, "EV", options.tone_shape.brightness_ev));
  add_text(app, "--contrast", "FACTOR", "factor of the tone curve's slope at middle grey: 0.5 to 1.5 (default: 1)",
           store_in_range(isp::min_contrast, isp::max_contrast, "", options.tone_shape.contrast));
  add_text(app, "--saturation", "FACTOR",
           "factor of the distance to the grey of the same luminance, in linear light: 0 to 3 (default: 1)",
           store_in_range(0, max_saturation, "", options.saturation));
}

void add_finish(CLI::App& app, isp::DevelopOptions& options) {
  add_choice<isp::Highlights>(
      app, "--highlights", {{"clip", isp::Highlights::clip}, {"reconstruct", isp::Highlights::reconstruct}},
      [&options](isp::Highlights highlights) { options.highlights = highlights; },
      "saturated colours: make them white, or reconstruct them from the unsaturated channels and the light around "
      "(default: clip)");
  add_text(app, "--local-tone", "SHARE",
           "make shadows brighter and highlights darker, 0 to 1, and preserve detail and the order of areas; noise "
           "limits the brightening of shadows (default: 0)",
           store_in_range(0, 1, "", options.local_tone));
  add_text(app, "--sharpen", "off|BLUR",
           "sharpen for a blur of this standard deviation in pixels, 0.3 to 1.5, as far as detail exceeds the noise "
           "(default: off)",
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
      app, "--crop", "X,Y,W,H", "keep a part of the upright image: pixels, or percent of its sides (10%,10%,80%,80%)",
      [&options](const std::string& text) -> std::optional<std::string> {
        options.crop = crop_of(text);
        if (options.crop) return std::nullopt;
        return "is not X,Y,W,H: four whole numbers of pixels or four percentages (10%,10%,80%,80%), W and H above 0";
      });
  app.add_option("--max-size", options.max_size,
                 "longer side of the image in pixels, after --crop; larger images are shrunk, none is enlarged")
      ->check(CLI::Range(1, max_side_px))
      ->type_name("N");
}

}  // namespace lowlux::cli
