#include "isp/bench/methods/method_frame.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "isp/model/colour/colorimetry.h"
#include "isp/render/output_space.h"

namespace lowlux::isp {
namespace {

constexpr double noise_margin = 8;  // standard deviations of noise below black and above white that are kept
constexpr double max_gain_dn_per_e = 64;
constexpr double max_dn = 65535;
constexpr double d65_cct_k = 6504;

/// Charges of the frame that the codes span, relative to the mean of black.
struct Span {
  double below_e = 0;
  double above_e = 0;
};

double deviation_e(const DenoiseShot& shot, double signal_e) {
  return std::sqrt(signal_e + shot.light.dark_e + shot.light.read_noise_e * shot.light.read_noise_e);
}

Span span_of(const DenoiseShot& shot) {
  return {noise_margin * deviation_e(shot, 0), shot.white_e + noise_margin * deviation_e(shot, shot.white_e)};
}

double black_dn(const DenoiseShot& shot) { return std::ceil(gain_dn_per_e(shot) * span_of(shot).below_e); }

double white_dn(const DenoiseShot& shot) {
  return std::min(max_dn, std::floor(black_dn(shot) + gain_dn_per_e(shot) * span_of(shot).above_e));
}

/// Charge from black to white.
double range_e(const DenoiseShot& shot) { return (white_dn(shot) - black_dn(shot)) / gain_dn_per_e(shot); }

CameraColour bench_colour() {
  Matrix3 camera{};
  Vector3 neutral{};
  for (std::size_t c = 0; c < 3; ++c) neutral[c] = camera[c][c] = 1 / bench_white_gain[c];
  const Matrix3 from_xyz = xyz_to_output(OutputSpace::linear_srgb).value();  // cannot fail for a space with primaries
  CameraColour out;
  out.calibrations = {{.cct_k = d65_cct_k, .xyz_to_camera = camera * from_xyz}};
  out.as_shot_neutral = neutral;
  out.source = CameraColour::Source::file_tags;
  return out;
}

std::string size_text(int width, int height) { return fmt::format("{} x {}", width, height); }

tl::unexpected<Error> wrong_size(const std::string& found, const std::string& expected) {
  return fail(ErrorCode::malformed, fmt::format("its output has {} pixels, expected {}", found, expected));
}

/// Calls use(x, y, colour, fraction of white) for each sample of the active area.
template <class Use>
void for_each_sample(const RawDn& raw, int samples, const Use& use) {
  const BlackLevel none{.samples = samples, .pattern_dn = std::vector<double>(static_cast<std::size_t>(samples))};
  const BlackLevel& black = raw.black_tag ? *raw.black_tag : none;
  with_samples(raw, [&](const auto& dn) {
    for (int y = 0; y < raw.active.height; ++y) {
      for (int x = 0; x < raw.active.width; ++x) {
        for (int s = 0; s < samples; ++s) {
          const auto c =
              samples == 3 ? static_cast<std::size_t>(s) : static_cast<std::size_t>(colour_at(raw.phase, x, y));
          const double level = black.at(x, y, s);
          const double value = dn.at(samples * (raw.active.x + x) + s, raw.active.y + y);
          use(x, y, c, (value - level) / (raw.white_dn[c] - level));
        }
      }
    }
  });
}

Result<RenderedPicture> rendered_raw(const RawFrame& frame, const DenoiseShot& shot, BenchRenderer& renderer) {
  const int width = shot.raw_e.width(), height = shot.raw_e.height();
  const RawDn& raw = frame.raw;
  if (raw.active.width != width || raw.active.height != height) {
    return wrong_size(size_text(raw.active.width, raw.active.height), size_text(width, height));
  }
  if (raw.layout == SensorLayout::linear_rgb) {
    RenderedPicture out{{}, SceneLinear(width, height)};
    for_each_sample(raw, 3, [&](int x, int y, std::size_t c, double value) {
      out.light.plane[c].at(x, y) = static_cast<float>(value * bench_white_gain[c] * range_e(shot) / shot.white_e);
    });
    out.display = renderer.display_of(out.light);
    return out;
  }
  if (raw.layout != SensorLayout::bayer || raw.phase != BayerPhase::rggb) {
    return fail(ErrorCode::malformed, "its output is a mosaic of another kind, expected RGGB");
  }
  Plane<float> mosaic_e(width, height);
  const double range = range_e(shot);
  for_each_sample(
      raw, 1, [&](int x, int y, std::size_t, double value) { mosaic_e.at(x, y) = static_cast<float>(value * range); });
  return renderer.render(mosaic_e.view(), shot, NoiseLeft::reduced);
}

double mean_of(const Plane<float>& plane) {
  double sum = 0;
  for (std::size_t i = 0; i < plane.size(); ++i) sum += static_cast<double>(plane.data()[i]);
  return sum / static_cast<double>(plane.size());
}

double mean_luminance(const SceneLinear& linear) {
  const Vector3 weights = luminance_weights(OutputSpace::linear_srgb).value();
  double sum = 0;
  for (std::size_t c = 0; c < 3; ++c) sum += weights[c] * mean_of(linear.plane[c]);
  return sum;
}

/// @param truth  linear Rec. 709
Result<RenderedPicture> rendered_picture(const SceneLinear& xyz, const SceneLinear& truth) {
  if (xyz.width() != truth.width() || xyz.height() != truth.height()) {
    return wrong_size(size_text(xyz.width(), xyz.height()), size_text(truth.width(), truth.height()));
  }
  const double luminance = mean_of(xyz.plane[1]);
  if (!(luminance > 0)) return fail(ErrorCode::malformed, "its output is black");
  const Matrix3 to_rgb = mean_luminance(truth) / luminance * xyz_to_output(OutputSpace::linear_srgb).value();
  RenderedPicture out{SceneLinear(xyz.width(), xyz.height()), SceneLinear(xyz.width(), xyz.height())};
  for (std::size_t i = 0; i < xyz.plane[0].size(); ++i) {
    const Vector3 rgb = to_rgb * Vector3{xyz.plane[0].data()[i], xyz.plane[1].data()[i], xyz.plane[2].data()[i]};
    for (std::size_t c = 0; c < 3; ++c) {
      out.display.plane[c].data()[i] = out.light.plane[c].data()[i] = static_cast<float>(rgb[c]);
    }
  }
  return out;
}

}  // namespace

double gain_dn_per_e(const DenoiseShot& shot) {
  const Span span = span_of(shot);
  return std::min(max_gain_dn_per_e, (max_dn - 2) / (span.below_e + span.above_e));
}

RawFrame noisy_frame(const DenoiseShot& shot) {
  const int width = shot.raw_e.width(), height = shot.raw_e.height();
  const double gain = gain_dn_per_e(shot), black = black_dn(shot), range = range_e(shot);
  RawFrame out;
  out.raw.dn = Plane<std::uint16_t>(width, height);
  for (std::size_t i = 0; i < out.raw.dn.size(); ++i) {
    const double dn = black + gain * (static_cast<double>(shot.raw_e.data()[i]) - shot.light.dark_e);
    out.raw.dn.data()[i] = static_cast<std::uint16_t>(std::lround(std::clamp(dn, 0.0, max_dn)));
  }
  out.raw.active = out.raw.default_crop = {0, 0, width, height};
  out.raw.black_tag = BlackLevel{.pattern_dn = {black}};
  out.raw.white_dn.fill(white_dn(shot));
  out.raw.info.make = "lowlux";
  out.raw.info.model = "bench";
  out.colour = bench_colour();
  NoiseProfile noise;
  noise.scale.fill(1 / range);
  noise.offset.fill(std::pow(deviation_e(shot, 0) / range, 2));
  out.noise = noise;
  return out;
}

Result<RenderedPicture> rendered(const MethodImage& image, const DenoiseShot& shot, const SceneLinear& truth,
                                 BenchRenderer& renderer) {
  if (const auto* raw = std::get_if<RawFrame>(&image)) return rendered_raw(*raw, shot, renderer);
  return rendered_picture(std::get<SceneLinear>(image), truth);
}

}  // namespace lowlux::isp
