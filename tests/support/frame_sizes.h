#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include "isp/base/random/random.h"

/// These are the frame sizes that tests go through: drawn over the whole range, and those of real cameras.
namespace lowlux::test {

struct FrameSize {
  int width = 0;
  int height = 0;

  std::string text() const { return std::to_string(width) + " x " + std::to_string(height); }
  std::int64_t pixels() const { return std::int64_t{width} * height; }
};

inline constexpr int max_drawn_side = 20000;

/// Returns size `index` of a sequence: one side is log-uniform in min_side..max_drawn_side, the other log-uniform from
/// min_side up to what `max_pixels` leaves. Odd and even indices exchange width and height.
inline FrameSize drawn_size(std::uint64_t seed, std::uint32_t index, int min_side, std::int64_t max_pixels) {
  const PhiloxWords words = words_at({.seed = seed}, index, 0);
  const auto log_uniform = [min_side](std::uint32_t word, double largest) {
    const double unit = (word + 0.5) / 4294967296.0;
    return std::clamp(static_cast<int>(min_side * std::pow((largest + 1) / min_side, unit)), min_side,
                      static_cast<int>(largest));
  };
  const int longer = log_uniform(words[0], max_drawn_side);
  const double left = std::clamp(static_cast<double>(max_pixels) / longer, static_cast<double>(min_side),
                                 static_cast<double>(max_drawn_side));
  const int other = log_uniform(words[1], std::floor(left));
  return index % 2 == 0 ? FrameSize{longer, other} : FrameSize{other, longer};
}

/// Returns how many sizes a test draws; scripts/nightly draws twenty times as many.
inline std::uint32_t drawn_sizes(std::uint32_t count) {
  return std::getenv("LOWLUX_NIGHTLY") == nullptr ? count : 20 * count;
}

struct CameraSize {
  const char* camera;
  FrameSize size;
};

/// Lists the largest images of thirty cameras and sensors with a Bayer mosaic, as their makers' specifications state
/// them.
inline constexpr std::array<CameraSize, 30> camera_sizes{{
    {"Nokia N900", {2592, 1968}},
    {"ZWO ASI533MC (IMX533)", {3008, 3008}},
    {"Raspberry Pi Camera 2 (IMX219)", {3280, 2464}},
    {"GoPro HERO6", {4000, 3000}},
    {"Apple iPhone 12", {4032, 3024}},
    {"Raspberry Pi HQ Camera (IMX477)", {4056, 3040}},
    {"Google Pixel 6", {4080, 3072}},
    {"Sony A7S III", {4240, 2832}},
    {"Nikon D700", {4256, 2832}},
    {"Olympus E-M5", {4608, 3456}},
    {"Nikon D7000", {4928, 3264}},
    {"Canon EOS 550D", {5184, 3456}},
    {"Panasonic GH5", {5184, 3888}},
    {"DJI Mavic 3", {5280, 3956}},
    {"Canon EOS 6D", {5472, 3648}},
    {"Nikon D500", {5568, 3712}},
    {"Canon EOS 5D Mark III", {5760, 3840}},
    {"Leica M10", {5976, 3984}},
    {"Sony A7 III", {6000, 4000}},
    {"Nikon D750", {6016, 4016}},
    {"Nikon Z6", {6048, 4024}},
    {"Pentax K-3 III", {6192, 4128}},
    {"ZWO ASI2600MC (IMX571)", {6248, 4176}},
    {"Pentax K-1", {7360, 4912}},
    {"Canon EOS R5", {8192, 5464}},
    {"Nikon D850", {8256, 5504}},
    {"Sony A1", {8640, 5760}},
    {"Sony A7R IV", {9504, 6336}},
    {"Fujifilm GFX100", {11648, 8736}},
    {"Phase One IQ4 150MP", {14204, 10652}},
}};

/// Returns which cameras' whole images a test goes through: of those of up to `max_pixels`, one drawn of each three
/// that follow each other, which are of about the same size; scripts/nightly takes all.
inline std::vector<std::uint32_t> drawn_cameras(std::uint64_t seed, std::int64_t max_pixels) {
  std::vector<std::uint32_t> all, drawn;
  for (std::uint32_t i = 0; i < camera_sizes.size(); ++i) {
    if (camera_sizes[i].size.pixels() <= max_pixels) all.push_back(i);
  }
  if (std::getenv("LOWLUX_NIGHTLY") != nullptr) return all;
  for (std::uint32_t first = 0; first < all.size(); first += 3) {
    const auto of = std::min<std::uint32_t>(3, static_cast<std::uint32_t>(all.size()) - first);
    drawn.push_back(all[first + words_at({.seed = seed}, first, 3)[0] % of]);
  }
  return drawn;
}

}  // namespace lowlux::test
