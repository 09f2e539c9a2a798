#include "isp/pipeline/budget/visible_noise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "isp/model/colour/colorimetry.h"
#include "isp/model/colour/colour_difference.h"
#include "isp/pipeline/plan/local_noise.h"
#include "isp/pipeline/render/cell_figures.h"
#include "isp/pipeline/render/pixel_cells.h"
#include "isp/render/output_space.h"
#include "isp/render/retarget/retarget_rows.h"
#include "isp/render/tone.h"

namespace lowlux::isp {
namespace {

constexpr int max_blocks_along = 16;
constexpr std::array<double, 3> samples_in_box{16, 32, 16};  // of R, G, B in a mosaic
constexpr double min_variance_e2 = 1e-6;
constexpr double surroundings_px =
    12;  // each way: a block of the denoiser, whose thresholds are those of its mean variance
constexpr double max_surroundings = 2;
/// States the scatter of the image's pixels over that of their raw values: on the tuning images.
constexpr double pixel_scatter = 1.3;

double normal_density(double t) { return std::exp(-0.5 * t * t) * std::numbers::inv_sqrtpi / std::numbers::sqrt2; }

/// Returns the mean of a normally distributed value that is clipped at black.
double mean_above_black(double mean, double std) {
  if (!(std > 0)) return std::max(mean, 0.0);
  const double t = mean / std;
  return std * normal_density(t) + mean * 0.5 * std::erfc(-t / std::numbers::sqrt2);
}

/// Converts camera RGB, a fraction of white with black subtracted, to the displayed colour.
class Display {
 public:
  Display(const DevelopOptions& options, const Rendering& rendering)
      : options_(options),
        rendering_(rendering),
        limit_(rendering.limit),
        to_xyz_(*inverse(*xyz_to_output(options.space))),
        white_(*xyz_of(output_white)) {}

  Lab lab(const Vector3& camera) const { return lab_of_shown(shown(camera)); }

  /// Returns the colour of the mean of pixels that scatter and are clipped at black.
  /// @param std  standard deviation of each colour, a fraction of white
  Lab lab_of_clipped(const Vector3& camera, const Vector3& std) const {
    const Vector3 mean = linear(camera);
    Vector3 raised{};
    double luminance = 0, too_bright = 0;
    for (int i = 0; i < 3; ++i) {
      double variance = 0;
      for (int c = 0; c < 3; ++c) {
        variance += std::pow(matrix(i, c) * static_cast<double>(rendering_.white_gain[c]) * std[c], 2);
      }
      const auto weight = static_cast<double>(rendering_.transform.luminance[i]);
      raised[i] = mean_above_black(mean[i], pixel_scatter * std::sqrt(variance));
      luminance += weight * std::max(mean[i], 0.0);
      too_bright += weight * raised[i];
    }
    if (luminance > 0) {
      for (double& v : raised) v *= luminance / too_bright;
    }
    return lab_of_shown(toned(raised));
  }

  /// Returns the CIEDE2000 by which a colour changes when its code is changed for the planned display, from the colours
  /// that the codes represent.
  double changed_for_display(const Vector3& camera) const {
    if (!options_.display) return 0;
    const Vector3 before = shown(camera);
    std::array<std::uint16_t, 3> code{};
    for (int i = 0; i < 3; ++i) {
      code[i] = static_cast<std::uint16_t>(std::lround(65535 * encode_transfer(options_.space, before[i])));
    }
    apply(options_.display->made.table, code.data(), 1, code.data());
    Vector3 after{};
    for (int i = 0; i < 3; ++i) after[i] = decode_transfer(options_.space, code[i] / 65535.0);
    return ciede2000(lab_of_shown(before), lab_of_shown(after));
  }

 private:
  double matrix(int row, int column) const {
    return static_cast<double>(rendering_.transform.matrix[3 * row + column]);
  }
  Vector3 linear(const Vector3& camera) const {
    Vector3 out{};
    for (int c = 0; c < 3; ++c) {
      const double balanced = std::min(camera[c] * static_cast<double>(rendering_.white_gain[c]), 1.0);
      for (int i = 0; i < 3; ++i) out[i] += matrix(i, c) * balanced;
    }
    return out;
  }
  Vector3 toned(const Vector3& linear) const {
    Vector3 out{};
    for (int i = 0; i < 3; ++i) {
      out[i] = std::min(
          apply_tone(options_.tone, std::clamp(linear[i], 0.0, 1.0) * limit_, limit_, options_.tone_shape), 1.0);
    }
    return out;
  }
  Vector3 shown(const Vector3& camera) const { return toned(linear(camera)); }
  Lab lab_of_shown(const Vector3& shown) const { return lab_of(xyz_of(to_xyz_ * shown), white_); }

  const DevelopOptions& options_;
  const Rendering& rendering_;
  double limit_;
  Matrix3 to_xyz_;
  Xyz white_;
};

/// Holds values of the frame for each colour.
struct Channels {
  std::array<double, 3> electrons_at_white{};
  std::array<double, 3> light_at_white_e{};
  std::array<double, 3> dark_e{};
  std::array<double, 3> samples = samples_in_box;
  bool is_grey = false;  // one value serves for all colours
};

Channels channels_of(const RawFrame& frame, const RawLevels& levels, const denoise::RawNoise& noise) {
  if (!is_mosaic(frame.raw)) {
    Channels out;
    for (std::size_t c = 0; c < 3; ++c) {
      out.electrons_at_white[c] = 1 / frame.noise->scale[planes_of(frame.raw) == 3 ? c : 0];
    }
    out.light_at_white_e = out.electrons_at_white;
    out.samples.fill(visible_box_px * visible_box_px);
    out.is_grey = planes_of(frame.raw) == 1;
    return out;
  }
  Channels out{.electrons_at_white = electrons_by_colour(frame.raw, levels),
               .light_at_white_e = light_at_white_by_colour(frame.raw, levels)};
  for (int site = 0; site < 4; ++site) {
    const auto c = static_cast<std::size_t>(colour_at(frame.raw.phase, site & 1, site >> 1));
    out.dark_e[c] += noise.dark_mean_e[site] * (c == 1 ? 0.5 : 1);
  }
  return out;
}

/// Returns the visible standard deviation of noise whose mean lies below black, as it does where dark charge is
/// overestimated: sqrt(2) times the rms of what reaches above, which for a mean at black is all of it. Half the
/// distance counts: the light of a block varies.
double above_black_e(double mean_e, double std_e) {
  const double below = std::max(-mean_e / (2 * std_e), 0.0);
  const double reaching = 0.5 * std::erfc(below / std::numbers::sqrt2);
  return std_e * std::sqrt(std::max(2 * ((1 + below * below) * reaching - below * normal_density(below)), 0.0));
}

/// Holds the mean charge of a block of the thumbnail, and its noise ratio.
struct NoisyCharge {
  Vector3 charge_e{};
  double ratio = 1;

  double variance_e2(int colour, const denoise::RawNoise& noise) const {
    return ratio * (std::max(charge_e[colour], 0.0) + noise.variance_e2[colour]);
  }
};

VisibilityBlock seen(const NoisyCharge& block, const Channels& channels, const denoise::RawNoise& noise,
                     const Display& display) {
  const Vector3& charge_e = block.charge_e;
  Vector3 signal{};
  double mean_signal = 0, mean_variance = 0, squares = 0;
  for (int c = 0; c < 3; ++c) {
    signal[c] = (charge_e[c] - channels.dark_e[c]) / channels.light_at_white_e[c];
    mean_signal += fraction_of_sites[c] * (charge_e[c] - channels.dark_e[c]);
    mean_variance += fraction_of_sites[c] * block.variance_e2(c, noise);
  }
  Vector3 lit{};
  for (int c = 0; c < 3; ++c) lit[c] = std::max(signal[c], 0.0);
  const Lab lab = display.lab(lit);
  Vector3 with_dark = signal, with_line = lit;
  const double line_e = std::sqrt(std::max(mean_variance, min_variance_e2) / (visible_box_px * visible_box_px));
  Vector3 pixel_std{};
  for (int c = 0; c < 3; ++c) {
    const double variance_e2 = block.variance_e2(c, noise);
    const double step_e = std::sqrt(std::max(variance_e2, min_variance_e2) / channels.samples[c]);
    const double step = above_black_e(charge_e[c] - channels.dark_e[c], step_e) / channels.light_at_white_e[c];
    Vector3 moved = lit;
    for (int i = 0; i < 3; ++i) moved[i] += i == c || channels.is_grey ? step : 0;
    const double difference = ciede2000(lab, display.lab(moved));
    squares += difference * difference / (channels.is_grey ? 3 : 1);
    pixel_std[c] = std::sqrt(std::max(variance_e2, 0.0)) / channels.light_at_white_e[c];
    with_dark[c] += channels.dark_e[c] / channels.light_at_white_e[c];
    with_line[c] += line_e / channels.light_at_white_e[c];
  }
  VisibilityBlock out;
  out.line_delta_e = static_cast<float>(ciede2000(lab, display.lab(with_line)) / line_e);
  out.display_delta_e = static_cast<float>(display.changed_for_display(signal));
  out.snr = static_cast<float>(std::max(mean_signal, 0.0) / std::sqrt(std::max(mean_variance, min_variance_e2)));
  out.noise_delta_e = static_cast<float>(std::sqrt(squares));
  out.clip_delta_e = static_cast<float>(ciede2000(lab, display.lab_of_clipped(signal, pixel_std)));
  if (with_dark != signal)
    out.dark_delta_e = static_cast<float>(ciede2000(display.lab(signal), display.lab(with_dark)));
  return out;
}

/// Holds the thumbnail in electrons.
class Charge {
 public:
  Charge(const RawFrame& frame, const Thumbnail& thumbnail, const Channels& channels, const denoise::RawNoise& noise)
      : frame_(frame), thumbnail_(thumbnail), channels_(channels), noise_(noise) {}

  NoisyCharge at(int x, int y) const {
    NoisyCharge out{.ratio = ratio_of_block(frame_, thumbnail_, x, y)};
    for (int c = 0; c < 3; ++c) {
      const auto mean = static_cast<double>(thumbnail_.mean.plane[c].at(x, y));
      out.charge_e[c] = (std::isfinite(mean) ? mean : 0) * channels_.electrons_at_white[c];
    }
    return out;
  }

  /// Returns VisibilityBlock::surroundings.
  /// @param reach  in blocks
  double surroundings(int x, int y, int reach) const {
    double sum = 0;
    int count = 0;
    for (int j = std::max(y - reach, 0); j <= std::min(y + reach, thumbnail_.mean.height() - 1); ++j) {
      for (int i = std::max(x - reach, 0); i <= std::min(x + reach, thumbnail_.mean.width() - 1); ++i, ++count) {
        sum += variance(i, j);
      }
    }
    const double own = std::max(variance(x, y), min_variance_e2);
    return std::clamp(std::sqrt(sum / count / own), 1.0, max_surroundings);
  }

 private:
  double variance(int x, int y) const {
    const NoisyCharge block = at(x, y);
    double out = 0;
    for (int c = 0; c < 3; ++c) out += fraction_of_sites[c] * block.variance_e2(c, noise_);
    return out;
  }

  const RawFrame& frame_;
  const Thumbnail& thumbnail_;
  const Channels& channels_;
  const denoise::RawNoise& noise_;
};

/// States the weight of a pixel's own value in R, G and B at its site, by the colour of the site (Malvar, He and
/// Cutler, "High-quality linear interpolation for demosaicing of Bayer-patterned color images", ICASSP 2004, figure 2).
constexpr std::array<std::array<double, 3>, 3> own_weight{{{1, 0.5, 0.75}, {0.625, 1, 0.625}, {0.75, 0.5, 1}}};

bool has_primaries(OutputSpace space) { return space != OutputSpace::camera && space != OutputSpace::xyz; }

}  // namespace

std::vector<VisibilityBlock> visibility_blocks(const RawFrame& frame, const DevelopOptions& options,
                                               const RawLevels& levels, const Rendering& rendering,
                                               const denoise::RawNoise& noise, const Thumbnail& thumbnail,
                                               Executor& executor) {
  if (!has_primaries(options.space)) return {};
  const Display display(options, rendering);
  const Channels channels = channels_of(frame, levels, noise);
  const int columns = thumbnail.mean.width(), rows = thumbnail.mean.height();
  const int along = std::min(columns, max_blocks_along), down = std::min(rows, max_blocks_along);
  const Charge charge(frame, thumbnail, channels, noise);
  const int reach = static_cast<int>(std::ceil(surroundings_px * columns / frame.raw.active.width));
  std::vector<VisibilityBlock> out(static_cast<std::size_t>(along) * static_cast<std::size_t>(down));
  for_each_index(executor, down, [&](int j) {
    for (int i = 0; i < along; ++i) {
      const int x = (2 * i + 1) * columns / (2 * along), y = (2 * j + 1) * rows / (2 * down);
      VisibilityBlock& block =
          out[static_cast<std::size_t>(j) * static_cast<std::size_t>(along) + static_cast<std::size_t>(i)];
      block = seen(charge.at(x, y), channels, noise, display);
      block.surroundings = static_cast<float>(charge.surroundings(x, y, reach));
      block.x = (static_cast<float>(x) + 0.5f) / static_cast<float>(columns);
      block.y = (static_cast<float>(y) + 0.5f) / static_cast<float>(rows);
    }
  });
  return out;
}

std::optional<double> pixel_delta_e(const RawDn& raw, const DevelopOptions& options, const Rendering& rendering,
                                    const Thumbnail& light, const DeviatingPixel& pixel) {
  if (!has_primaries(options.space)) return std::nullopt;
  const CameraRgb& mean = light.mean;
  const int x = static_cast<int>(std::int64_t{pixel.at.x} * mean.width() / raw.active.width);
  const int y = static_cast<int>(std::int64_t{pixel.at.y} * mean.height() / raw.active.height);
  Vector3 around{};
  for (std::size_t c = 0; c < 3; ++c) {
    const auto signal = static_cast<double>(mean.plane[c].at(x, y));
    around[c] = std::isfinite(signal) ? std::max(signal, 0.0) : 0;
  }
  const auto site = static_cast<std::size_t>(colour_at(raw.phase, pixel.at.x, pixel.at.y));
  const auto& gain = rendering.white_gain;
  Vector3 deviating = around;
  for (std::size_t c = 0; c < 3; ++c) {
    deviating[c] += pixel.excess * own_weight[site][c] * static_cast<double>(gain[site] / gain[c]);
  }
  const Display display(options, rendering);
  return ciede2000(display.lab(around), display.lab(deviating));
}

double visible_percentile(std::span<const float> rms_delta_e) {
  const auto noisy = std::ranges::count_if(rms_delta_e, [](float rms) { return rms > 0; });
  if (static_cast<double>(noisy) <= (1 - seen_fraction) * static_cast<double>(rms_delta_e.size())) return 0;
  const auto fraction_above = [&](double x) {
    double sum = 0;
    for (const float rms : rms_delta_e) {
      sum += rms > 0 ? std::erfc(x / (std::sqrt(2.0) * static_cast<double>(rms))) : 0;
    }
    return sum / static_cast<double>(rms_delta_e.size());
  };
  double low = 0, high = 5 * static_cast<double>(*std::ranges::max_element(rms_delta_e));
  for (int step = 0; step < 24; ++step) {
    const double middle = (low + high) / 2;
    (fraction_above(middle) > 1 - seen_fraction ? low : high) = middle;
  }
  return (low + high) / 2;
}

double residual_noise_fraction(std::optional<denoise::Level> level, double snr) {
  constexpr std::array at{0.2, 0.7, 1.5, 3.0, 6.0, 12.0};
  constexpr std::array draft{0.14, 0.15, 0.17, 0.19, 0.22, 0.265};
  constexpr std::array standard{0.08, 0.105, 0.12, 0.14, 0.165, 0.19};
  if (!level) return 0.9;
  if (*level >= denoise::Level::high) return 0;
  const auto& left = *level == denoise::Level::draft ? draft : standard;
  if (!(snr > at.front())) return left.front();
  for (std::size_t i = 1; i < at.size(); ++i) {
    if (snr < at[i]) return std::lerp(left[i - 1], left[i], std::log(snr / at[i - 1]) / std::log(at[i] / at[i - 1]));
  }
  return left.back();
}

float residual_delta_e(std::optional<denoise::Level> level, const VisibilityBlock& block) {
  const auto left = static_cast<float>(residual_noise_fraction(level, static_cast<double>(block.snr)));
  const float noise = left * block.surroundings * block.noise_delta_e;
  return level ? noise : std::hypot(noise, block.clip_delta_e);
}

double error_fraction(std::optional<denoise::Level> level) {
  constexpr std::array share{0.70, 0.67, 0.63, 0.54};
  return level ? share[static_cast<std::size_t>(*level)] : 0.85;
}

}  // namespace lowlux::isp
