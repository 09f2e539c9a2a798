#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "isp/bench/methods/method_scenes.h"
#include "isp/reproduce/bench_picture.h"

/// Scenes that are computed, with known light at every pixel: what pictures show too rarely.
namespace lowlux::isp {

/// A set of scenes with one subject. Light is linear Rec. 709; in scenes that saturate it exceeds 1.
struct GeneratedSet {
  std::string_view name;
  bool saturates = false;
  BenchPicture (*scene)(const SceneSize& size, std::uint64_t seed) = nullptr;  // a pure function
};

/// Returns all sets: text and lamps, sharp and behind the lens of bench_lens_px; stars; fine texture whose channels
/// are weakly and strongly correlated, sharp and behind the lens; hard coloured edges.
std::span<const GeneratedSet> generated_sets();

/// Returns the seeds of the scenes on which parameters are chosen, or on which results are reported: no seed is in
/// both.
std::span<const std::uint64_t> seeds_of(PictureSet set);

/// Returns words of strokes 1 to 6 px wide, at any angle, dark and light on coloured grounds. Each pixel holds the mean
/// over 8 x 8 points.
BenchPicture text_scene(const SceneSize& size, std::uint64_t seed, double lens_px);

/// Returns coloured discs and bars 30 to 10,000 times brighter than the dark grey around them: 0.005 of white.
BenchPicture lamps_scene(const SceneSize& size, std::uint64_t seed, double lens_px);

/// Light around the lamps of lamps_scene(), all channels.
inline constexpr double lamp_ground = 0.005;

/// Width of the stripes of edges_scene() [px].
inline constexpr int edge_pitch_px = 24;

/// Returns stripes of uniform random colours, edge_pitch_px wide, whose vertical edges are at multiples of that width
/// plus an offset below 1 px, drawn for each edge.
BenchPicture edges_scene(const SceneSize& size, std::uint64_t seed, double lens_px);

}  // namespace lowlux::isp
