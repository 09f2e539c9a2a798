#include "isp/cli/capture/exposure_args.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "isp/cli/shared/option_values.h"

namespace lowlux::cli {
namespace {

constexpr double min_exposure_s = 1e-7, max_exposure_s = 1e5, most_gain = 1e4;

/// Reads "16=1,32=2,64=4".
ArgumentError set_gain_codes(const std::string& text, std::vector<capture::CameraGain>& out) {
  out.clear();
  for (const std::string& word : split_at_commas(text)) {
    const auto equals = word.find('=');
    const auto code = number_of(word.substr(0, equals));
    const auto factor = equals == std::string::npos ? std::nullopt : quantity_of(word.substr(equals + 1), "x");
    if (!code || !factor || std::abs(*code) > 1e9 || *code != std::round(*code) ||
        !(*factor > 0 && *factor <= most_gain)) {
      return "is not a list such as 16=1,32=2,64=4: codes and their factors";
    }
    out.push_back({.factor = *factor, .code = static_cast<int>(*code)});
  }
  std::ranges::sort(out, {}, &capture::CameraGain::code);
  const auto twice = std::ranges::adjacent_find(out, {}, &capture::CameraGain::code);
  if (twice != out.end()) return fmt::format("has the code {} twice", twice->code);
  std::ranges::sort(out, {}, &capture::CameraGain::factor);
  const auto same = std::ranges::adjacent_find(out, {}, &capture::CameraGain::factor);
  if (same != out.end()) return fmt::format("has the factor {:g} twice", same->factor);
  if (out.empty()) return "names no code";
  return std::nullopt;
}

}  // namespace

void add_auto_exposure(CLI::App& app, AutoExposureArgs& args) {
  app.add_flag("--auto-exposure", args.wanted, "set exposure time and gain for the best signal-to-noise ratio")
      ->excludes("--exposure-time");
  add_text(app, "--max-exposure", "S", "with --auto-exposure: longest exposure time (default: one frame period)",
           store_within({min_exposure_s, max_exposure_s, "s"}, args.longest_s));
  add_text(app, "--max-gain", "X", "with --auto-exposure: largest analogue gain (default: the camera's)",
           store_within({1e-3, most_gain, "x"}, args.max_gain));
  add_choice<isp::Mains>(
      app, "--mains",
      {{"auto", isp::Mains::either}, {"50", isp::Mains::hz50}, {"60", isp::Mains::hz60}, {"off", isp::Mains::off}},
      [&args](isp::Mains mains) { args.mains = mains; },
      "with --auto-exposure: mains frequency of flickering lamps (default: auto, 50 and 60 Hz)");
  add_text(app, "--clip", "FRACTION",
           "with --auto-exposure: largest fraction of clipped pixels in the brightest channel (default 0.001)",
           store_within({1e-9, 0.5}, args.clipped_fraction));
  add_text(app, "--gain-codes", "CODE=X,...", "with --auto-exposure: gain codes of a V4L2 camera and their factors",
           [&args](const std::string& text) { return set_gain_codes(text, args.gain_codes); })
      ->excludes("--gain")
      ->excludes("--gain-code");
}

std::optional<std::string> auto_exposure_error(const CLI::App& app, const AutoExposureArgs& args) {
  constexpr std::array of_automatic{"--max-exposure", "--max-gain", "--mains", "--clip", "--gain-codes"};
  if (!args.wanted) {
    const auto* const given =
        std::ranges::find_if(of_automatic, [&](const char* option) { return app.count(option) > 0; });
    if (given == of_automatic.end()) return std::nullopt;
    return fmt::format("{} requires --auto-exposure", *given);
  }
  if (!args.gain_codes.empty() && app.count("--v4l2") == 0) {
    return "--gain-codes is an option of V4L2 cameras; libcamera states factors";
  }
  return std::nullopt;
}

}  // namespace lowlux::cli
