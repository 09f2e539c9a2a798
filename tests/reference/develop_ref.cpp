#include "tests/reference/develop_ref.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <utility>

#include "denoise/denoiser.h"
#include "isp/raw/corrections.h"
#include "isp/raw/repair.h"
#include "isp/raw/subtract_dark_frame.h"
#include "isp/raw/to_linear.h"
#include "isp/render/highlights.h"
#include "isp/render/night/night_look.h"
#include "tests/reference/demosaic_ref.h"

namespace lowlux::reference {
namespace {

using isp::apply_gains;
using isp::DevelopPlan;
using isp::subtract_dark;
using isp::to_electrons;
using isp::to_fraction;

RawFraction black_subtracted(const RawDn& raw, const isp::RawLevels& levels, Executor& executor) {
  if (!levels.dark_frame) return to_fraction(raw, levels.black, executor);
  RawFraction out{Plane<float>(raw.active.width, raw.active.height), raw.phase};
  to_fraction(raw, *levels.dark_frame, levels.black, out.value.view(), executor);
  return out;
}

template <class Mosaic>
Mosaic repaired(Mosaic raw, const DevelopPlan& plan) {
  repair(raw.value.view(), plan.levels.defects, 2);
  return raw;
}

RawElectrons without_lines(RawElectrons raw, const DevelopPlan& plan) {
  for (const denoise::LineOffsets& lines : plan.noise_reduction.lines) subtract_lines(lines, raw.value.view());
  return raw;
}

SignalElectrons reduced(const RawElectrons& raw, const isp::NoiseReduction& how, Executor& executor) {
  const int width = raw.value.width(), height = raw.value.height();
  SignalElectrons out{Plane<float>(width, height), raw.phase};
  denoise::DenoiseOptions options = how.options;
  options.level = *how.level;
  denoise::Denoiser(width, height, executor.width(), options.level)
      .run({raw.value.view(), raw.phase, view_of(how.noise_ratio.get())}, how.noise, options, out.value.view(), {},
           executor);
  return out;
}

template <class Mosaic>
Mosaic flat_fielded(Mosaic signal, const RawFrame& frame, Executor& executor) {
  apply_gains(frame.corrections, signal.value.view(), executor);
  return signal;
}

/// Returns the mosaic of the image with its white balance, white at 1.
template <class Mosaic>
LinearisedMosaic balanced(const Mosaic& signal, const PerSite<double>& at_white, const RawFrame& frame,
                          const DevelopPlan& plan) {
  const Rect& crop = frame.raw.default_crop;
  LinearisedMosaic out{crop.width, crop.height, phase_of_crop(signal.phase, crop.x, crop.y), {}};
  for (int y = crop.y; y < crop.y + crop.height; ++y) {
    for (int x = crop.x; x < crop.x + crop.width; ++x) {
      const auto colour = static_cast<std::size_t>(colour_at(signal.phase, x, y));
      const auto gain = static_cast<double>(plan.rendering.white_gain[colour]);
      out.value.push_back(static_cast<double>(signal.value.at(x, y)) * gain / at_white[site_of(x, y)]);
    }
  }
  return out;
}

/// Returns the mean of each colour in each complete cell of a mosaic.
Image halved(const LinearisedMosaic& mosaic) {
  Image out{mosaic.width / 2, mosaic.height / 2, {}};
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) {
      Rgb sum{};
      for (int site = 0; site < 4; ++site) {
        const int column = 2 * x + (site & 1), row = 2 * y + (site >> 1);
        const auto colour = static_cast<std::size_t>(colour_at(mosaic.phase, column, row));
        sum[colour] += mosaic.at(column, row) / (colour == 1 ? 2 : 1);
      }
      out.pixel.push_back(sum);
    }
  }
  return out;
}

/// Holds camera RGB with its white balance, and the means of blocks of 4 x 4 pixels that a look is made of: of the
/// samples of each colour, where the image is still a mosaic.
struct Camera {
  Image rgb;
  SceneLinear quarter;
};

/// @param add  add(x, y, sum, count) adds what there is at a pixel of the image
template <class Add>
SceneLinear means_of_blocks(int width, int height, const Add& add) {
  const auto mirrored = [](int i, int n) {  // without repeating the edge
    if (n == 1) return 0;
    const int turn = i % (2 * n - 2);
    return turn < n ? turn : 2 * n - 2 - turn;
  };
  SceneLinear out(cells_along(width), cells_along(height));
  for (int y = 0; y < out.height(); ++y) {
    for (int x = 0; x < out.width(); ++x) {
      Rgb sum{}, count{};
      for (int i = 0; i < 16; ++i) add(mirrored(4 * x + i % 4, width), mirrored(4 * y + i / 4, height), sum, count);
      for (std::size_t c = 0; c < 3; ++c) out.plane[c].at(x, y) = static_cast<float>(sum[c] / count[c]);
    }
  }
  return out;
}

SceneLinear quartered(const LinearisedMosaic& mosaic) {
  return means_of_blocks(mosaic.width, mosaic.height, [&](int x, int y, Rgb& sum, Rgb& count) {
    const auto colour = static_cast<std::size_t>(colour_at(mosaic.phase, x, y));
    sum[colour] += mosaic.at(x, y);
    count[colour] += 1;
  });
}

SceneLinear quartered(const Image& image) {
  return means_of_blocks(image.width, image.height, [&](int x, int y, Rgb& sum, Rgb& count) {
    for (std::size_t c = 0; c < 3; ++c) {
      sum[c] += image.at(x, y)[c];
      count[c] += 1;
    }
  });
}

Camera camera_of(Image image) {
  SceneLinear quarter = quartered(image);
  return {std::move(image), std::move(quarter)};
}

Camera camera_of(const LinearisedMosaic& mosaic, const DevelopPlan& plan) {
  if (plan.options.half) return camera_of(halved(mosaic));
  const auto clip = static_cast<double>(plan.rendering.transform.clip);
  return {{mosaic.width, mosaic.height, demosaiced(mosaic, plan.demosaic.demosaic, clip)}, quartered(mosaic)};
}

/// Returns camera RGB of frames that are not mosaics, and whose noise stays.
Image image_of_pixels(const RawFrame& frame, const DevelopPlan& plan, Executor& executor) {
  const RawDn& raw = frame.raw;
  const bool grey = raw.layout == SensorLayout::monochrome;
  CameraRgb planes(raw.active.width, raw.active.height);
  if (grey) {
    RawFraction fraction = black_subtracted(raw, plan.levels, executor);
    repair(fraction.value.view(), plan.levels.defects, 1);
    planes.plane[0] = flat_fielded(std::move(fraction), frame, executor).value;
  } else {
    isp::to_fraction_rgb(raw, plan.levels.black, planes.view(), executor);
    apply_gains(frame.corrections, planes.view(), executor);
  }
  const int cell = plan.options.half ? 2 : 1;
  const Rect& crop = raw.default_crop;
  Image out{crop.width / cell, crop.height / cell, {}};
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) {
      Rgb mean{};
      for (std::size_t c = 0; c < 3; ++c) {
        for (int i = 0; i < cell * cell; ++i) {
          const int column = crop.x + cell * x + i % cell, row = crop.y + cell * y + i / cell;
          mean[c] += static_cast<double>(planes.plane[grey ? 0 : c].at(column, row)) / (cell * cell);
        }
        mean[c] *= static_cast<double>(plan.rendering.white_gain[c]);
      }
      out.pixel.push_back(mean);
    }
  }
  return out;
}

Camera camera_of(const RawFrame& frame, const DevelopPlan& plan, Executor& executor) {
  if (frame.raw.layout != SensorLayout::bayer) return camera_of(image_of_pixels(frame, plan, executor));
  if (plan.levels.electrons_at_white) {
    const SignalElectrons signal = flat_fielded(signal_electrons(frame, plan, executor), frame, executor);
    return camera_of(balanced(signal, light_at_white_e(plan.levels), frame, plan), plan);
  }
  const RawFraction raw = repaired(black_subtracted(frame.raw, plan.levels, executor), plan);
  const SignalFraction signal = flat_fielded(subtract_dark(RawFraction{raw.value.clone(), raw.phase}), frame, executor);
  return camera_of(balanced(signal, {1, 1, 1, 1}, frame, plan), plan);
}

SceneLinear planes_of(const Image& image) {
  SceneLinear out(image.width, image.height);
  for (std::size_t c = 0; c < 3; ++c) {
    std::ranges::transform(image.pixel, out.plane[c].data(), [c](const Rgb& v) { return static_cast<float>(v[c]); });
  }
  return out;
}

Camera with_highlights(Camera camera, const DevelopPlan& plan, Executor& executor) {
  if (plan.options.highlights != isp::Highlights::reconstruct) return camera;
  Image& image = camera.rgb;
  std::array<float, 3> saturation = plan.rendering.white_gain;
  for (std::size_t c = 0; c < 3; ++c) saturation[c] *= static_cast<float>(plan.saturation[c]);
  SceneLinear planes = planes_of(image);
  isp::reconstruct_highlights(planes.view(), saturation, executor);
  for (std::size_t i = 0; i < image.pixel.size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) image.pixel[i][c] = static_cast<double>(planes.plane[c].data()[i]);
  }
  return camera_of(std::move(image));
}

/// Applies matrix, look of the eye and the move into the gamut.
Image seen_light(const Camera& camera, const DevelopPlan& plan, Executor& executor) {
  const Image& rgb = camera.rgb;
  isp::RgbTransform transform = plan.rendering.transform;
  isp::NightLookGrid grid(rgb.width, rgb.height);
  LookGrid look;
  if (plan.rendering.look) {
    look = grid.make(camera.quarter.view(), transform.matrix, transform.clip, plan.rendering.look->look, {}, executor);
  }
  const bool into_gamut = std::exchange(transform.move_into_gamut, false);
  Image out{rgb.width, rgb.height, {}};
  for (int y = 0; y < rgb.height; ++y) {
    for (int x = 0; x < rgb.width; ++x) {
      Rgb v = transformed(rgb.pixel[out.pixel.size()], transform);
      if (plan.rendering.look) v = seen(v, look, x, y);
      if (into_gamut) v = moved_into_gamut(v, transform.luminance);
      out.pixel.push_back(v);
    }
  }
  return out;
}

/// Returns the value of the tone curve at v, between the edges of its bins.
double toned(const ToneTable& tone, double v) {
  const float clamped = static_cast<float>(std::clamp(v, 0.0, 1.0));
  const auto bin = static_cast<std::size_t>(tone.bin_of(clamped));
  const auto edge_of = [&](std::size_t i) {
    const std::uint32_t bits = tone.base_bits() + (static_cast<std::uint32_t>(i) << tone.shift);
    return static_cast<double>(std::bit_cast<float>(bits)) - static_cast<double>(tone.offset);
  };
  const double from = edge_of(bin), way = (static_cast<double>(clamped) - from) / (edge_of(bin + 1) - from);
  return std::lerp(static_cast<double>(tone.edge[bin]), static_cast<double>(tone.edge[bin + 1]), way);
}

Image encoded(Image light, const DevelopPlan& plan) {
  if (plan.options.samples == SampleType::f32) return light;
  for (Rgb& pixel : light.pixel) {
    for (double& v : pixel) v = toned(plan.rendering.tone, v);
  }
  return light;
}

}  // namespace

SignalElectrons signal_electrons(const RawFrame& frame, const DevelopPlan& plan, Executor& executor) {
  RawFraction fraction = black_subtracted(frame.raw, plan.levels, executor);
  RawElectrons raw = to_electrons(std::move(fraction), *plan.levels.electrons_at_white, executor);
  raw = without_lines(repaired(std::move(raw), plan), plan);
  if (plan.noise_reduction.has_level()) return reduced(raw, plan.noise_reduction, executor);
  return subtract_dark(std::move(raw), plan.levels.black, executor);
}

Image developed(const RawFrame& frame, const DevelopPlan& plan, Executor& executor) {
  const Camera camera = with_highlights(camera_of(frame, plan, executor), plan, executor);
  return encoded(seen_light(camera, plan, executor), plan);
}

}  // namespace lowlux::reference
