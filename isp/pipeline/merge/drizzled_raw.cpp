#include "isp/pipeline/merge/drizzled_raw.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

#include <fmt/format.h>

#include "isp/pipeline/finished/raw_codes.h"
#include "isp/pipeline/merge/merged_mosaic.h"

namespace lowlux::isp {
namespace {

/// Interleaves the colours of an image as R G B, pixels without data from the prediction.
Plane<float> interleaved(const merge::DrizzleImage& image, const CameraRgb& prediction, Executor& executor) {
  Plane<float> out(3 * image.width, image.height);
  for_each_index(executor, image.height, [&](int y) {
    const int v = static_cast<int>(static_cast<std::int64_t>(y) * prediction.height() / image.height);
    for (int colour = 0; colour < 3; ++colour) {
      const float* const value = image.value_e(colour).row(y);
      const float* const weight = image.weight(colour).row(y);
      const float* const expected = prediction.plane[static_cast<std::size_t>(colour)].row(v);
      for (int x = 0; x < image.width; ++x) {
        const auto u = static_cast<std::int64_t>(x) * prediction.width() / image.width;
        out.at(3 * x + colour, y) = weight[x] > 0 ? value[x] : expected[u];
      }
    }
  });
  return out;
}

/// Returns the mean over pixels with data of their variance over that of a pixel of one frame at their value.
double variance_ratio(const merge::DrizzleImage& image, const std::array<double, 3>& dark_variance_e2, int colour,
                      Executor& executor) {
  struct Sum {
    double ratio = 0, pixels = 0;
  };
  std::vector<Sum> of_row(static_cast<std::size_t>(image.height));
  for_each_index(executor, image.height, [&](int y) {
    const PlaneView<const float> value = image.value_e(colour), variance = image.variance_e2(colour);
    for (int x = 0; x < image.width; ++x) {
      if (!(image.weight(colour).at(x, y) > 0)) continue;
      const double one = std::max(static_cast<double>(value.at(x, y)), 0.0) + dark_variance_e2[colour];
      of_row[y].ratio += variance.at(x, y) / one;
      of_row[y].pixels += 1;
    }
  });
  Sum sum;
  for (const Sum& row : of_row) {
    sum.ratio += row.ratio;
    sum.pixels += row.pixels;
  }
  return sum.pixels > 0 ? sum.ratio / sum.pixels : 1;
}

NoiseProfile profile_of(const merge::DrizzleImage& image, const merge::DrizzleOptions& options,
                        const ColourLevels& levels, MergedRaw& out, Executor& executor) {
  const double larger_areas = std::pow(merge::noise_correlation_ratio(options), 2);
  NoiseProfile profile;
  double mean_ratio = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const double ratio = larger_areas * variance_ratio(image, levels.variance_e2, static_cast<int>(c), executor);
    profile.scale[c] = ratio / levels.white_e[c];
    profile.offset[c] = ratio * levels.variance_e2[c] / std::pow(levels.white_e[c], 2);
    mean_ratio += ratio / 3;
  }
  out.mean_count = 1 / mean_ratio;
  return profile;
}

/// Returns the colour of the sites that a gain map of a mosaic multiplies; 3 if it multiplies several.
int colour_of(const GainMap& map, BayerPhase phase) {
  if (map.row_pitch % 2 != 0 || map.column_pitch % 2 != 0) return 3;  // rows or columns of several colours
  return static_cast<int>(colour_at(phase, map.left, map.top));
}

/// Converts gain maps of a mosaic to gain maps of R, G and B. Both maps of green are applied by their square roots.
std::vector<GainMap> maps_of_planes(std::vector<GainMap> maps, const RawDn& mosaic, const RawDn& image) {
  std::array<int, 4> count{};
  for (const GainMap& map : maps) ++count[static_cast<std::size_t>(colour_of(map, mosaic.phase))];
  const double scale = static_cast<double>(image.active.width) / mosaic.active.width;
  const auto scaled = [scale](int px) { return static_cast<int>(std::lround(scale * px)); };
  for (GainMap& map : maps) {
    const int colour = colour_of(map, mosaic.phase);
    map.first_plane = colour % 3;
    map.planes = colour == 3 ? 3 : 1;
    map.top = scaled(map.top - map.top % map.row_pitch);
    map.left = scaled(map.left - map.left % map.column_pitch);
    map.bottom = std::min(scaled(map.bottom), image.active.height);
    map.right = std::min(scaled(map.right), image.active.width);
    map.row_pitch = map.column_pitch = 1;
    map.noise = {};
    if (colour != 1 || count[1] < 2) continue;
    for (float& gain : map.gain) gain = std::pow(gain, 1.0F / static_cast<float>(count[1]));
  }
  return maps;
}

Rect scaled_crop(const Rect& crop, double scale, const RawDn& image) {
  const auto scaled = [scale](int px) { return static_cast<int>(std::floor(scale * px)); };
  const int x = scaled(crop.x), y = scaled(crop.y);
  return {x, y, std::min(scaled(crop.width), image.active.width - x),
          std::min(scaled(crop.height), image.active.height - y)};
}

}  // namespace

Result<void> check_drizzle_memory(int width, int height, const merge::DrizzleOptions& options, double limit_bytes) {
  constexpr double sum_bytes = 36, encoding_bytes = 16;  // bytes of an output pixel
  const auto sums = static_cast<double>(merge::Drizzle::memory_bytes(width, height, options));
  const double needed = sums * (sum_bytes + encoding_bytes) / sum_bytes;
  if (needed <= limit_bytes) return {};
  constexpr double gib = 1024.0 * 1024 * 1024;
  return fail(ErrorCode::too_large,
              fmt::format("drizzling {} x {} pixels to {:.3g} times their width takes {:.2g} GiB, and {:.2g} GiB are "
                          "available: choose a smaller image",
                          width, height, options.scale, needed / gib, limit_bytes / gib));
}

void encode_drizzled(merge::DrizzleImage& image, const merge::DrizzleOptions& options, const CameraRgb& prediction,
                     const FrameElectrons& reference, RawFrame& frame, MergedRaw& out, Executor& executor) {
  const ColourLevels colours = colour_levels(reference);
  out.frame.noise = profile_of(image, options, colours, out, executor);
  out.frame.noise->source = frame.noise->source;
  out.empty_fraction = image.empty_fraction;
  const Plane<float> samples = interleaved(image, prediction, executor);
  const PerSite<double>& site_white_e = reference.light_at_white_e;
  const SampleLevels codes = rgb_code_levels(dark_noise(reference, site_white_e), min_sample(samples, colours.white_e));
  const SampleLevels levels = fine_levels(codes, reference, site_white_e, out);
  for (double& offset : out.frame.noise->offset) offset += levels.rounding_variance();
  image = {};
  RawDn like;
  like.layout = SensorLayout::linear_rgb;
  like.info = frame.raw.info;
  out.frame.raw = encode_signal({.signal_e = samples.view(),
                                 .charge_e = samples.view(),
                                 .saturation_e = reference.saturation_e,
                                 .signal_at_white_e = colours.white_e,
                                 .charge_at_white_e = colours.white_e},
                                like, levels, executor);
  out.frame.raw.default_crop = scaled_crop(frame.raw.default_crop, options.scale, out.frame.raw);
  out.frame.colour = std::move(frame.colour);
  out.frame.corrections = std::move(frame.corrections);
  out.frame.corrections.defects.clear();
  out.frame.corrections.not_applied = {};  // they are for the pixels of a frame, not for those of a drizzled image
  out.frame.source_tags = std::move(frame.source_tags);
  smooth_gain_maps(out.frame.corrections, frame.raw.active.height, executor);
  out.frame.corrections.gain_maps =
      maps_of_planes(std::move(out.frame.corrections.gain_maps), frame.raw, out.frame.raw);
}

}  // namespace lowlux::isp
