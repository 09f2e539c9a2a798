// Prints the figures of speed and accuracy that the documentation states.
//   measure NAME [ARGUMENTS]     measure alone: what there is
#include <algorithm>
#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "isp/base/text.h"
#include "tests/bench/measure/measure.h"

namespace {

using namespace lowlux::test;

struct Measurement {
  std::string_view name;
  std::string_view arguments;
  std::string_view purpose;
  int (*run)(Arguments&);
};

constexpr std::string_view rounds_15 = "[--rounds N, at least 15]";

constexpr Measurement measurements[]{
    {"align", "waves|pictures [PAIRS] or times [WIDTH HEIGHT [THREADS]]",
     "motion between simulated hand-held frames: error and time", measure_align},
    {"calibration", "[--seeds N, at least 4]", "figures of a camera: error and time, by pixels and frames",
     measure_calibration},
    {"colour-table", rounds_15, "maps of colours by tables: error, and time next to memcpy and the map itself",
     measure_colour_table},
    {"denoise", "[--rounds N, at least 5]", "noise reduction: time next to memcpy and its reference", measure_denoise},
    {"encoding", "", "image formats: time and size of 12 MP", measure_encoding},
    {"look", "[--width N] [--height N] [--rounds N]",
     "look of the eye: time next to the raw pass, error against double precision", measure_look},
    {"make-raw", "IN.dng WIDTH HEIGHT OUT.dng",
     "writes a large raw file for timing: the active area of another, repeated; 14 bits, lossless JPEG", make_raw},
    {"merge-budget", "[DRAW [MERGES]]", "predicted times of merging, and budgets kept, of series drawn by DRAW",
     measure_merge_budget},
    {"motion", "[FRAMES, at least 4]", "videos of pictures that move: errors with and without motion compensation",
     measure_motion},
    {"noise-ratio", "[--quality-only|--time-only]", "noise that differs from place to place: PSNR lost, time",
     measure_noise_ratio},
    {"picture-noise", "", "noise of single images: error, refusals and time", measure_picture_noise},
    {"pixel-cost", "[ratios|draw [DRAW]]", "developing frames that are not mosaics: time, measured and predicted",
     measure_pixel_cost},
    {"planned-time", "budget [DRAW [FRAMES]] or saved", "plans: predicted times, budgets kept, time saved",
     measure_planned_time},
    {"planner", "levels|truth|bounds", "change by levels of noise reduction, over what the planner predicts",
     measure_planner},
    {"raw-to-rgb", "[--json] [--rounds N, at least 15] [--width N] [--height N]",
     "raw mosaics to RGB: time next to memcpy, by threads", measure_raw_to_rgb},
    {"retarget", "PICTURES [--display CD_M2]", "images for dim displays: likeness by several models", measure_retarget},
    {"sampler", rounds_15, "Poisson draws and readout: time next to std::poisson_distribution and random words",
     measure_sampler},
    {"stage", "[PICTURE] [--small] [--mode NAME] [--threads N] [--look camera|eye]",
     "stage of a camera pipeline: time and PSNR", measure_stage},
    {"stars", "[ROUNDS, at least 3]", "registration on stars, drizzling, merged nights: error and time", measure_stars},
    {"temporal", "[ROUNDS, at least 5]", "temporal noise reduction: time, gain, false alarms, trails",
     measure_temporal},
    {"tile-margin", "PICTURE [best]", "tiles: difference to the whole frame, by margin", measure_tile_margin},
    {"unpack", rounds_15, "packed raw formats: time next to memcpy", measure_unpack},
};

int print_list() {
  fmt::print("measure NAME [ARGUMENTS], where NAME is one of\n");
  for (const Measurement& m : measurements) {
    fmt::print("{:<15}{}\n", m.name, m.purpose);
    if (!m.arguments.empty()) fmt::print("{:15}{}\n", "", m.arguments);
  }
  return 0;
}

int refuse_name(std::string_view name) {
  std::vector<std::string_view> names;
  for (const Measurement& m : measurements) names.push_back(m.name);
  const auto near = lowlux::near_matches(name, names);
  fmt::print(
      stderr, "measure: unknown measurement '{}'{}\n", name,
      near.empty() ? "; measure --help lists them" : fmt::format(" (did you mean {}?)", fmt::join(near, " or ")));
  return 2;
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> words(argv + 1, argv + argc);
  if (words.empty() || words[0] == "--help") return print_list();
  const auto* const found = std::ranges::find(measurements, std::string_view(words[0]), &Measurement::name);
  if (found == std::end(measurements)) return refuse_name(words[0]);
  try {
    Arguments arguments({words.begin() + 1, words.end()});
    return found->run(arguments);
  } catch (const Failure& failure) {
    const std::string hint = failure.exit_code == 2
                                 ? fmt::format("; arguments: {}", found->arguments.empty() ? "none" : found->arguments)
                                 : "";
    std::fprintf(stderr, "measure %s: %s%s\n", words[0].c_str(), failure.what(), hint.c_str());
    return failure.exit_code;
  }
}
