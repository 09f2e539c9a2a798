#include "isp/bench/scenes/generated_scenes.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "isp/base/matrix3.h"
#include "isp/base/random/random.h"

namespace lowlux::isp {
namespace {

/// Streams of random numbers of one seed, apart from those of method_scenes.cpp.
enum class Stream : std::uint32_t { ground = 100, word, stroke, lamp, lamp_colour, edge };

std::array<double, 4> drawn(std::uint64_t seed, Stream stream, std::size_t index) {
  const DrawStream draws{.seed = seed, .frame = static_cast<std::uint32_t>(stream), .purpose = draw_purpose::scene};
  std::array<double, 4> out{};
  const PhiloxWords words = words_at(draws, static_cast<std::uint32_t>(index), 0);
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = (words[i] + 0.5) / 4294967296.0;
  return out;
}

double log_uniform(double least, double most, double u) { return least * std::pow(most / least, u); }

/// A straight stroke with square ends; discs are strokes of no length with round ends.
struct Stroke {
  double x_px;
  double y_px;
  double angle;
  double half_length_px;
  double half_width_px;
  bool round = false;

  bool contains(double x, double y) const {
    const double dx = x - x_px, dy = y - y_px;
    const double along = dx * std::cos(angle) + dy * std::sin(angle);
    const double across = dy * std::cos(angle) - dx * std::sin(angle);
    if (round) return std::hypot(dx, dy) <= half_width_px;
    return std::abs(along) <= half_length_px && std::abs(across) <= half_width_px;
  }
  double reach_px() const { return std::hypot(half_length_px, half_width_px) + 1; }
};

/// Covers an image with a shape: each pixel by the fraction of 8 x 8 points that are inside.
void paint(SceneLinear& image, const Stroke& stroke, const Vector3& rgb) {
  constexpr int points = 8;
  const double reach = stroke.reach_px();
  const int left = std::max(0, static_cast<int>(stroke.x_px - reach));
  const int right = std::min(image.width() - 1, static_cast<int>(stroke.x_px + reach) + 1);
  const int top = std::max(0, static_cast<int>(stroke.y_px - reach));
  const int bottom = std::min(image.height() - 1, static_cast<int>(stroke.y_px + reach) + 1);
  const auto offset = [](int i) { return (i + 0.5) / points - 0.5; };
  for (int y = top; y <= bottom; ++y) {
    for (int x = left; x <= right; ++x) {
      int inside = 0;
      for (int i = 0; i < points * points; ++i) {
        inside += stroke.contains(x + offset(i % points), y + offset(i / points)) ? 1 : 0;
      }
      const double cover = inside / (1.0 * points * points);
      for (std::size_t c = 0; c < 3; ++c) {
        float& value = image.plane[c].at(x, y);
        value = static_cast<float>(std::lerp(static_cast<double>(value), rgb[c], cover));
      }
    }
  }
}

BenchPicture filled(std::string_view name, const SceneSize& size, double value) {
  BenchPicture out{std::string(name), SceneLinear(size.width, size.height)};
  for (Plane<float>& plane : out.linear.plane) std::fill_n(plane.data(), plane.size(), static_cast<float>(value));
  return out;
}

BenchPicture behind_lens(BenchPicture picture, double lens_px) {
  if (lens_px <= 0) return picture;
  for (Plane<float>& plane : picture.linear.plane) plane = lens_blurred(plane.view(), lens_px);
  return picture;
}

/// Draws a word: some strokes for each letter, along a line of some angle.
void write_word(SceneLinear& image, std::uint64_t seed, std::size_t word, double x_px, double y_px,
                const Vector3& ink) {
  constexpr std::size_t letters = 4, strokes = 3;
  const auto how = drawn(seed, Stream::word, word);
  const double angle = std::numbers::pi * (how[0] - 0.5) / 3, width = log_uniform(1, 6, how[1]);
  const double height = 5 * width + 3, advance = 0.9 * height;
  for (std::size_t i = 0; i < letters * strokes; ++i) {
    const auto at = drawn(seed, Stream::stroke, 64 * word + i);
    const std::size_t letter = i / strokes;
    const double along = advance * (static_cast<double>(letter) - 1.5) + 0.5 * advance * (at[0] - 0.5);
    const double across = 0.5 * height * (at[1] - 0.5);
    // A quarter of the strokes are at any angle, the others upright or along the line.
    const double turn =
        std::floor(4 * at[2]) < 3 ? 0.5 * std::numbers::pi * std::floor(2 * at[3]) : std::numbers::pi * at[3];
    paint(image,
          {x_px + along * std::cos(angle) - across * std::sin(angle),
           y_px + along * std::sin(angle) + across * std::cos(angle), angle + turn, 0.35 * height, width / 2},
          ink);
  }
}

constexpr Leaves fine{.min_radius_px = 0.7, .max_radius_px = 5, .pixels_per_leaf = 2, .chroma = 0, .lens_px = 0};
constexpr StarField star_field{.law = StarLaw::log_uniform,
                               .faintest = 0.04,
                               .brightest = 20,
                               .min_lens_px = 0.6,
                               .max_lens_px = 1.5,
                               .limit = 1e3F};

BenchPicture texture(const SceneSize& size, std::uint64_t seed, double shared, double lens_px) {
  Leaves how = fine;
  how.shared = shared;
  how.lens_px = lens_px;
  return leaves_scene(size, seed, how).picture;
}

constexpr double weak = 0.3, strong = 0.9;  // correlations of logarithms: 0.155, 0.988

constexpr std::array registry{
    GeneratedSet{"text", false, [](const SceneSize& s, std::uint64_t seed) { return text_scene(s, seed, 0); }},
    GeneratedSet{"text, lens", false,
                 [](const SceneSize& s, std::uint64_t seed) { return text_scene(s, seed, bench_lens_px); }},
    GeneratedSet{"stars", true,
                 [](const SceneSize& s, std::uint64_t seed) { return stars_scene(s, seed, star_field).picture; }},
    GeneratedSet{"lamps", true, [](const SceneSize& s, std::uint64_t seed) { return lamps_scene(s, seed, 0); }},
    GeneratedSet{"lamps, lens", true,
                 [](const SceneSize& s, std::uint64_t seed) { return lamps_scene(s, seed, bench_lens_px); }},
    GeneratedSet{"texture, weak", false,
                 [](const SceneSize& s, std::uint64_t seed) { return texture(s, seed, weak, 0); }},
    GeneratedSet{"texture, weak, lens", false,
                 [](const SceneSize& s, std::uint64_t seed) { return texture(s, seed, weak, bench_lens_px); }},
    GeneratedSet{"texture, strong", false,
                 [](const SceneSize& s, std::uint64_t seed) { return texture(s, seed, strong, 0); }},
    GeneratedSet{"texture, strong, lens", false,
                 [](const SceneSize& s, std::uint64_t seed) { return texture(s, seed, strong, bench_lens_px); }},
    GeneratedSet{"edges", false, [](const SceneSize& s, std::uint64_t seed) { return edges_scene(s, seed, 0); }},
    GeneratedSet{"edges, lens", false,
                 [](const SceneSize& s, std::uint64_t seed) { return edges_scene(s, seed, bench_lens_px); }},
};

constexpr std::array<std::uint64_t, 4> seeds{1001, 1002, 2001, 2002};  // the tuning seeds come first
constexpr std::size_t tuning_seeds = 2;

}  // namespace

std::span<const GeneratedSet> generated_sets() { return registry; }

std::span<const std::uint64_t> seeds_of(PictureSet set) {
  const std::span<const std::uint64_t> all(seeds);
  if (set == PictureSet::tuning) return all.first(tuning_seeds);
  return set == PictureSet::held_out ? all.subspan(tuning_seeds) : all;
}

BenchPicture text_scene(const SceneSize& size, std::uint64_t seed, double lens_px) {
  constexpr int ground_px = 64;
  BenchPicture out = filled("text", size, 0.5);
  std::size_t word = 0;
  for (int y = ground_px / 2; y < size.height + ground_px / 2; y += ground_px) {
    for (int x = ground_px / 2; x < size.width + ground_px / 2; x += ground_px, ++word) {
      const auto colour = drawn(seed, Stream::ground, word);
      const bool is_dark = colour[3] < 0.5;  // the ground
      Vector3 ground{}, ink{};
      for (std::size_t c = 0; c < 3; ++c) {
        ground[c] = is_dark ? 0.02 + 0.2 * colour[c] : 0.35 + 0.6 * colour[c];
        ink[c] = is_dark ? 0.4 + 0.6 * colour[2 - c] : 0.02 + 0.15 * colour[2 - c];
      }
      paint(out.linear, {x - 0.5, y - 0.5, 0, ground_px / 2.0, ground_px / 2.0}, ground);
      write_word(out.linear, seed, word, x, y, ink);
    }
  }
  return behind_lens(std::move(out), lens_px);
}

BenchPicture lamps_scene(const SceneSize& size, std::uint64_t seed, double lens_px) {
  constexpr int pitch_px = 96;
  BenchPicture out = filled("lamps", size, lamp_ground);
  std::size_t lamp = 0;
  for (int y = pitch_px / 2; y < size.height; y += pitch_px) {
    for (int x = pitch_px / 2; x < size.width; x += pitch_px, ++lamp) {
      const auto how = drawn(seed, Stream::lamp, lamp), colour = drawn(seed, Stream::lamp_colour, lamp);
      const double times = log_uniform(30, 10000, how[0]);
      Vector3 rgb{};
      for (std::size_t c = 0; c < 3; ++c) rgb[c] = lamp_ground * times * (0.3 + 0.7 * colour[c]);
      const double half_px = log_uniform(0.8, 8, how[1]);
      const bool is_disc = lamp % 2 == 0;
      paint(out.linear,
            {x + how[2], y + how[3], std::numbers::pi * (lamp % 4 == 1 ? 0 : colour[3]), is_disc ? half_px : 16.0,
             half_px, is_disc},
            rgb);
    }
  }
  return behind_lens(std::move(out), lens_px);
}

BenchPicture edges_scene(const SceneSize& size, std::uint64_t seed, double lens_px) {
  BenchPicture out = filled("edges", size, 0);
  for (int x = 0; x < size.width; ++x) {
    const auto stripe = static_cast<std::size_t>(x / edge_pitch_px);
    const auto before = drawn(seed, Stream::edge, stripe), after = drawn(seed, Stream::edge, stripe + 1);
    // The last pixel of a stripe is divided.
    const double cover = x % edge_pitch_px == edge_pitch_px - 1 ? after[3] : 0;
    for (std::size_t c = 0; c < 3; ++c) {
      const double value = 0.05 + 0.9 * std::lerp(before[c], after[c], cover);
      for (int y = 0; y < size.height; ++y) out.linear.plane[c].at(x, y) = static_cast<float>(value);
    }
  }
  return behind_lens(std::move(out), lens_px);
}

}  // namespace lowlux::isp
