#include "isp/cli/develop/finish_args.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>

#include "isp/cli/shared/option_values.h"

namespace lowlux::cli {
namespace {

constexpr int max_side_px = 65535;

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

}  // namespace

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
