#include "isp/bench/marks/development_marks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "isp/bench/accuracy_time.h"
#include "isp/metrics/picture_marks.h"
#include "isp/metrics/picture_metrics.h"

namespace lowlux::isp {
namespace {

constexpr double lift = 32;  // 5 EV
constexpr double lifted_grey = 0.18;
constexpr int edge_reach_px = 2;

DenoiseLight light_of(double mean_e) { return {mean_e, 2, 1.5}; }

double root_mean_square(std::initializer_list<double> values) {
  double sum = 0;
  for (const double v : values) sum += v * v;
  return std::sqrt(sum / static_cast<double>(values.size()));
}

Plane<float> codes_of_channel(const Plane<float>& light) {
  Plane<float> out(light.width(), light.height());
  std::transform(light.data(), light.data() + light.size(), out.data(), [](float v) { return srgb_code(v); });
  return out;
}

/// Returns channel a - b.
Plane<float> difference(const SceneLinear& error, std::size_t a, std::size_t b) {
  Plane<float> out(error.width(), error.height());
  for (std::size_t i = 0; i < out.size(); ++i) out.data()[i] = error.plane[a].data()[i] - error.plane[b].data()[i];
  return out;
}

BenchPicture flat_picture(const SceneSize& size) {
  BenchPicture out{"flat", SceneLinear(size.width, size.height)};
  for (Plane<float>& plane : out.linear.plane) {
    std::fill_n(plane.data(), plane.size(), static_cast<float>(lifted_grey / lift));
  }
  return out;
}

/// Returns the largest standard deviation of a channel's raw noise in codes of the lifted flat, to first order.
double raw_deviation(const DenoiseShot& shot) {
  constexpr double step = 1e-3;
  const double slope = (srgb_code(lifted_grey + step) - srgb_code(lifted_grey - step)) / (2 * step);
  const double constant_e2 = shot.light.dark_e + shot.light.read_noise_e * shot.light.read_noise_e;
  double most = 0;
  for (const double gain : bench_white_gain) {
    const double per_e = lift * gain / shot.white_e;
    most = std::max(most, slope * per_e * std::sqrt(lifted_grey / per_e + constant_e2));
  }
  return most;
}

void measure_flat(const Development& develop, double mean_e, const SceneSize& size, PictureMarks& out) {
  const DenoiseShot shot = take(flat_picture(size), light_of(mean_e), 7001);
  const SceneLinear light = develop(shot, lift);
  std::array<Plane<float>, 3> codes;
  for (std::size_t c = 0; c < 3; ++c) codes[c] = codes_of_channel(light.plane[c]);
  const double deviation = raw_deviation(shot);
  const auto measure = [&](int period_px, double& over_own, double& over_raw) {
    const int without_px = period_px == 2 ? 1 : 2;
    double own = 0, absolute = 0;
    for (const Plane<float>& plane : codes) {
      const PeriodicLines lines = periodic_lines(plane.view(), period_px, without_px);
      own += lines.amplitude * lines.amplitude / 3;
      absolute += lines.absolute * lines.absolute / 3;
    }
    over_own = std::sqrt(own);
    over_raw = std::sqrt(absolute) / deviation;
    return std::sqrt(absolute);
  };
  const double pixels_per_freedom = size.width * size.height / 3.0;
  out.cell_codes = 255 * measure(2, out.cell, out.cell_of_raw) / std::sqrt(pixels_per_freedom);
  measure(8, out.block_8, out.block_8_of_raw);
  measure(16, out.block_16, out.block_16_of_raw);
}

/// Returns the errors in standard deviations of the raw noise of each pixel, if it were of the channel's colour.
SceneLinear errors_in_noise(const SceneLinear& light, const BenchPicture& truth, const DenoiseShot& shot) {
  SceneLinear out(light.width(), light.height());
  const double constant_e2 = shot.light.dark_e + shot.light.read_noise_e * shot.light.read_noise_e;
  for (std::size_t c = 0; c < 3; ++c) {
    const double per_e = bench_white_gain[c] / shot.white_e;
    for (std::size_t i = 0; i < out.plane[c].size(); ++i) {
      const double expected = std::min(1.0, static_cast<double>(truth.linear.plane[c].data()[i]));
      const double deviation = per_e * std::sqrt(expected / per_e + constant_e2);
      out.plane[c].data()[i] = static_cast<float>((light.plane[c].data()[i] - expected) / deviation);
    }
  }
  return out;
}

/// Returns which pixels have a channel above a level.
Plane<float> brighter(const SceneLinear& light, double level) {
  Plane<float> out(light.width(), light.height());
  for (std::size_t i = 0; i < out.size(); ++i) {
    const float most = std::max({light.plane[0].data()[i], light.plane[1].data()[i], light.plane[2].data()[i]});
    out.data()[i] = most > level ? 1.0F : 0.0F;
  }
  return out;
}

struct Errors {
  BenchPicture truth;
  SceneLinear error;
};

Errors errors_of(const Development& develop, BenchPicture truth, double mean_e, std::uint64_t seed) {
  const DenoiseShot shot = take(truth, light_of(mean_e), seed, true);
  SceneLinear error = errors_in_noise(develop(shot, 1), truth, shot);
  return {std::move(truth), std::move(error)};
}

void measure_lamps(const Development& develop, double mean_e, const SceneSize& size, PictureMarks& out) {
  const std::uint64_t seed = seeds_of(PictureSet::held_out).front();
  const Errors of = errors_of(develop, lamps_scene(size, seed, 0), mean_e, 7002);
  const Plane<float> mask = brighter(of.truth.linear, 2 * lamp_ground);
  std::array<RingError, 3> ring;
  for (std::size_t c = 0; c < 3; ++c) ring[c] = ring_error(of.error.plane[c].view(), mask.view());
  out.lamp_ring = root_mean_square({ring[0].ring, ring[1].ring, ring[2].ring});
  out.lamp_far = root_mean_square({ring[0].far, ring[1].far, ring[2].far});
}

void measure_stars(const Development& develop, double mean_e, const SceneSize& size, PictureMarks& out) {
  const auto sets = generated_sets();
  const auto* const stars =
      &*std::find_if(sets.begin(), sets.end(), [](const GeneratedSet& set) { return set.name == "stars"; });
  const std::uint64_t seed = seeds_of(PictureSet::held_out).front();
  const Errors of = errors_of(develop, stars->scene(size, seed), mean_e, 7003);
  const Plane<float> mask = brighter(of.truth.linear, 1);
  double mean = 0;
  for (std::size_t c = 0; c < 3; ++c) mean += ring_error(of.error.plane[c].view(), mask.view()).mean / 3;
  const RingError red = ring_error(difference(of.error, 0, 1).view(), mask.view());
  const RingError blue = ring_error(difference(of.error, 2, 1).view(), mask.view());
  out.star_mean = mean;
  out.star_chroma = root_mean_square({red.ring, blue.ring});
  out.star_chroma_far = root_mean_square({red.far, blue.far});
}

void measure_edges(const Development& develop, double mean_e, const SceneSize& size, PictureMarks& out) {
  const BenchPicture truth = edges_scene(size, seeds_of(PictureSet::held_out).front(), 0);
  const SceneLinear light = develop(take(truth, light_of(mean_e), 7004), 1);
  SceneLinear error(size.width, size.height);
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < error.plane[c].size(); ++i) {
      error.plane[c].data()[i] =
          255 * (srgb_code(light.plane[c].data()[i]) - srgb_code(truth.linear.plane[c].data()[i]));
    }
  }
  double at_edges = 0, inside = 0, stripes = 0;
  for (const std::size_t c : {std::size_t{0}, std::size_t{2}}) {
    const Plane<float> chroma = difference(error, c, 1);
    for (int x = edge_pitch_px; x + edge_pitch_px <= size.width; x += edge_pitch_px, ++stripes) {
      const auto amplitude = [&](int middle) {
        return bead_amplitude(chroma.view().crop(middle - edge_reach_px, 0, 2 * edge_reach_px + 1, chroma.height()));
      };
      at_edges += std::pow(amplitude(x), 2);
      inside += std::pow(amplitude(x - edge_pitch_px / 2), 2);
    }
  }
  out.beads = std::sqrt(at_edges / stripes);
  out.beads_inside = std::sqrt(inside / stripes);
}

}  // namespace

PictureMarks measure_marks(const Development& develop, double mean_e, const SceneSize& size) {
  PictureMarks out;
  measure_flat(develop, mean_e, size, out);
  measure_lamps(develop, mean_e, size, out);
  measure_stars(develop, mean_e, size, out);
  measure_edges(develop, mean_e, size, out);
  return out;
}

double max_periodic_amplitude(int period_px) {
  return std::sqrt(1 + 5 * std::sqrt(2.0 / (period_px * period_px - (period_px == 2 ? 1 : 4))));
}

std::vector<Finding> mark_findings(const std::string& name, const PictureMarks& marks) {
  std::vector<Finding> out;
  const auto add = [&](const std::string& id, const std::string& claim, double limit, double found) {
    out.push_back(check_of(fmt::format("scenes/{}/{}", id, name), claim, fmt::format("at most {:.3g}", limit),
                           fmt::format("{:.3g}", found), found <= limit));
  };
  constexpr const char* lines = "spectral lines of a flat lifted by 5 EV, over those of white noise: period of {} px";
  add("cell", fmt::format(lines, 2), max_periodic_amplitude(2), marks.cell);
  add("block-8", fmt::format(lines, 8), max_periodic_amplitude(8), marks.block_8);
  add("block-16", fmt::format(lines, 16), max_periodic_amplitude(16), marks.block_16);
  out[0].note =
      fmt::format("{:.3f} codes of 255; over the lines of raw noise: {:.3g}", marks.cell_codes, marks.cell_of_raw);
  add("lamp-noise", "error 2 to 12 px from lamps, over the raw noise", 1, marks.lamp_ring);
  add("lamp-ripples", "error 2 to 12 px from lamps, over that of flats far away", 2, marks.lamp_ring / marks.lamp_far);
  add("star-ring", "mean error around saturated stars, in deviations of the raw noise", 0.1, std::abs(marks.star_mean));
  add("star-colour", "error of chroma around saturated stars, over that of the sky", 2,
      marks.star_chroma / marks.star_chroma_far);
  add("beads", "chroma of a period of 2 px along coloured edges, over that between them", 2,
      marks.beads / marks.beads_inside);
  return out;
}

}  // namespace lowlux::isp
