#include "isp/pipeline/plan/plan_noise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "denoise/check/noise_check.h"
#include "isp/pipeline/budget/frame_sample.h"
#include "isp/pipeline/plan/local_noise.h"
#include "isp/pipeline/plan/pixel_noise.h"
#include "isp/pipeline/render/cell_figures.h"
#include "isp/pipeline/render/electron_mosaic.h"
#include "isp/pipeline/render/pixel_cells.h"

namespace lowlux::isp {
namespace {

int colour_of(const RawDn& raw, int site) { return static_cast<int>(colour_at(raw.phase, site & 1, site >> 1)); }

/// Returns the variance of a raw value of each colour without light.
std::array<double, 3> black_variance_e2(const RawFrame& frame, const RawLevels& levels) {
  std::array<double, 3> out{};
  for (int site = 0; site < 4; ++site) {
    const int colour = colour_of(frame.raw, site);
    const double electrons = (*levels.electrons_at_white)[site];
    const double e_per_dn = electrons / (white_at(frame.raw, site) - levels.black.pedestal_dn[site]);
    out[colour] += black_variance_e2(frame, levels, site, colour, electrons, e_per_dn) * (colour == 1 ? 0.5 : 1);
  }
  return out;
}

denoise::RawNoise noise_of(const RawFrame& frame, const RawLevels& levels) {
  denoise::RawNoise out;
  out.dark_mean_e = levels.black.dark_mean_e;
  out.variance_e2 = black_variance_e2(frame, levels);
  // White levels of a thousandth of a code give larger variances.
  for (double& variance : out.variance_e2) variance = std::min(variance, denoise::largest_e);
  const std::array<double, 3> saturated = saturated_from(frame.raw, levels);
  for (int site = 0; site < 4; ++site) {
    const int colour = colour_of(frame.raw, site);
    const double fraction = std::min(saturated_fraction_of_white, saturated[colour]);
    out.saturation_e[colour] = std::min(out.saturation_e[colour], fraction * (*levels.electrons_at_white)[site]);
  }
  return out;
}

/// Returns the gains that make a neutral equal in R, G and B [e-]; that of G is 1.
std::array<double, 3> balance_of(const RawFrame& frame, const RawLevels& levels,
                                 const std::array<float, 3>& white_gain) {
  std::array<double, 3> gain{white_gain[0], white_gain[1], white_gain[2]};
  const PerSite<double> light_e = light_at_white_e(levels);
  for (int site = 0; site < 4; ++site) {
    const int colour = colour_of(frame.raw, site);
    gain[colour] /= std::pow(light_e[site], colour == 1 ? 0.5 : 1.0);
  }
  const double green = gain[1];
  for (double& g : gain) g = std::clamp(g / green, 1e-3, 1e3);
  return gain;
}

/// Returns the standard deviation of the noise of a pixel without light.
double black_std_e(const denoise::RawNoise& noise) {
  const auto& v = noise.variance_e2;
  return std::sqrt(noise.dark_mean_e[0] + (v[0] + 2 * v[1] + v[2]) / 4);
}

constexpr double min_strong_lines = 0.5;  // of the noise of the median pixel
/// Lines that are stronger than a pixel's noise without light are noise below this LineOffsets::unevenness. That of the
/// scene is ((1 - r) / (1 + r))^2 at least, r the ratio of the two channels of a line: 0.06 for r = 0.6.
constexpr double max_unevenness = 0.02;

/// Returns the least visible standard deviation of line noise: the eye integrates it along lines.
double min_line_std_e(const denoise::RawNoise& noise) { return 0.03 * black_std_e(noise); }

/// Returns the standard deviation of a pixel whose signal-to-noise ratio is `snr`: s^2 = snr s + v.
double pixel_std_e(const denoise::RawNoise& noise, double snr) {
  return 0.5 * (snr + std::hypot(snr, 2 * black_std_e(noise)));
}

/// Returns the warning of lines that are too strong to be taken for noise, where they are visible above that of the
/// median pixel; empty for others.
std::string warning_of_strong_lines(const denoise::LineOffsets& found, const denoise::RawNoise& noise, double snr) {
  if (found.gain < 0.5 || lines_are_visible(found, noise)) return {};
  if (found.line_std_e < min_strong_lines * pixel_std_e(noise, snr)) return {};
  return fmt::format(
      "{} have offsets of {:.3g} e-, more than the read noise, and are not corrected, because they may be part of the "
      "scene, such as a fence; --dark-frame removes a pattern that is the same in all frames",
      found.lines == denoise::Lines::rows ? "rows" : "columns", found.line_std_e);
}

std::vector<denoise::LineOffsets> lines_of(const denoise::RawNoise& noise, double snr, PlaneView<const float> charge_e,
                                           std::vector<std::string>& warnings, Executor& executor) {
  const denoise::FrameLineOptions options{.min_std_e = min_line_std_e(noise)};
  std::array<std::optional<denoise::LineOffsets>, 2> of_kind;
  for_each_index(executor, 2, [&](int kind) {
    auto found = denoise::line_offsets_of_frame(charge_e, static_cast<denoise::Lines>(kind), options);
    if (found) of_kind[static_cast<std::size_t>(kind)] = *std::move(found);
  });
  std::vector<denoise::LineOffsets> lines;
  for (auto& found : of_kind) {
    if (!found) continue;
    std::string warning = warning_of_strong_lines(*found, noise, snr);
    if (!warning.empty()) warnings.push_back(std::move(warning));
    if (lines_are_visible(*found, noise)) lines.push_back(*std::move(found));
  }
  return lines;
}

/// Subtracts line noise, and its contribution to the variance of a pixel.
void subtract_measured_lines(const RawFrame& frame, RawElectrons& charge, NoiseReduction& out, Executor& executor) {
  out.lines =
      lines_of(median_noise(frame, out.noise), out.snr.value_or(0), charge.value.view(), out.warnings, executor);
  for (const denoise::LineOffsets& lines : out.lines) {
    subtract_lines(lines, charge.value.view());
    const double gone_e2 = lines.line_std_e * lines.line_std_e - lines.residual_std_e * lines.residual_std_e;
    const double left_e2 = lines.residual_std_e * lines.residual_std_e;
    for (double& variance : out.noise.variance_e2) {
      // Lines that are stronger than the model's noise are not in it: what is left of them is more.
      variance = gone_e2 < variance ? std::max(variance - gone_e2, 0.25 * variance) : variance + left_e2;
    }
  }
}

NoiseReduction left_alone(const RawFrame& frame, std::string reason) {
  NoiseReduction out;
  out.noise_ratio = frame.noise_ratio;
  out.reason = std::move(reason);
  return out;
}

/// Measures lines if requested, and compares the noise with its model. Lines need the charge of the whole frame, which
/// is returned in `whole` then; the remaining noise is checked on a sample of it where there is one.
denoise::NoiseCheck check_frame(const RawFrame& frame, const RawLevels& levels, bool with_lines, NoiseReduction& out,
                                RawElectrons& whole, Executor& executor) {
  const std::vector<Rect> squares = sample_squares(frame, levels);
  if (with_lines || squares.empty()) whole = raw_electrons(frame, levels, executor);
  if (with_lines) subtract_measured_lines(frame, whole, out, executor);
  RawElectrons sample;
  if (!squares.empty()) {
    sample = with_lines ? sample_of(whole, squares) : sample_electrons(frame, levels, squares, executor);
  }
  const RawElectrons& charge = squares.empty() ? whole : sample;
  NoiseRatioView ratio = view_of(frame.noise_ratio.get());
  NoiseRatio of_sample;
  if (frame.noise_ratio && !squares.empty()) {
    of_sample = sample_ratio(ratio, squares);
    ratio = view_of(&of_sample);
  }
  return denoise::check_noise({charge.value.view(), charge.phase, ratio}, out.noise, executor);
}

}  // namespace

std::optional<Error> noise_obstacle(const RawFrame& frame, const RawLevels& levels) {
  if (is_mosaic(frame.raw) && (frame.raw.active.width < 2 || frame.raw.active.height < 2)) {
    return Error{ErrorCode::invalid_argument, "the image is too small to separate noise from detail"};
  }
  if (!levels.electrons_at_white) {
    return Error{
        ErrorCode::insufficient,
        fmt::format("the noise is unknown: the file has no usable NoiseProfile; state it with --noise GAIN,READ{}",
                    is_mosaic(frame.raw) ? ", or give a profile (--profile, see calibrate and calib/profiles)" : "")};
  }
  return std::nullopt;
}

bool is_denoised_before(const RawFrame& frame, const DenoiseChoice& choice) {
  return choice.mode == DenoiseChoice::Mode::automatic && !choice.always && frame.noise && frame.noise->reduced;
}

bool lines_are_visible(const denoise::LineOffsets& found, const denoise::RawNoise& noise) {
  if (found.gain < 0.5 || !(found.line_std_e > min_line_std_e(noise))) return false;
  return found.line_std_e < black_std_e(noise) || found.unevenness < max_unevenness;
}

std::optional<denoise::Level> level_for(double snr) {
  if (snr >= 60) return std::nullopt;
  if (snr >= 20) return denoise::Level::draft;
  return snr >= 3 ? denoise::Level::standard : denoise::Level::high;
}

NoiseModel noise_model(const RawFrame& frame, const RawLevels& levels, const std::array<float, 3>& white_gain) {
  return {frame.noise->source, noise_of(frame, levels), balance_of(frame, levels, white_gain)};
}

double middle_snr(const RawFrame& frame, const RawLevels& levels, const denoise::RawNoise& noise,
                  const Thumbnail& thumbnail, std::vector<double>& snr) {
  return middle_snr(frame, thumbnail, electrons_by_colour(frame.raw, levels), noise, snr);
}

Result<NoiseReduction> plan_noise(const RawFrame& frame, const Thumbnail& thumbnail, const RawLevels& levels,
                                  const NoiseRequest& request, Executor& executor, RawElectrons* charge) {
  const DenoiseChoice& choice = request.choice;
  if (choice.mode == DenoiseChoice::Mode::off) return left_alone(frame, "not asked for");
  if (auto error = noise_obstacle(frame, levels)) {
    if (choice.mode == DenoiseChoice::Mode::level) return tl::make_unexpected(*std::move(error));
    return left_alone(frame, std::move(error->message));
  }
  if (is_denoised_before(frame, choice)) return left_alone(frame, "the raw was denoised before");
  if (!is_mosaic(frame.raw)) return plan_pixel_noise(frame, thumbnail, levels, request, executor);
  const NoiseModel model = noise_model(frame, levels, request.white_gain);
  NoiseReduction out;
  out.source = model.source;
  out.noise = model.noise;
  out.noise_ratio = frame.noise_ratio;
  out.options.white_gain = model.white_gain;
  std::vector<double> memory;
  out.snr = middle_snr(frame, levels, out.noise, thumbnail, memory);
  choose_level(request, out);
  if (!out.level) return out;
  out.options.level = *out.level;
  if (choice.unbiased_chroma) {
    out.options.rho = std::numeric_limits<double>::infinity();
    out.options.keep_means = true;
  }
  RawElectrons whole;
  const bool with_lines = choice.line_noise && request.lines;
  const denoise::NoiseCheck check = check_frame(frame, levels, with_lines, out, whole, executor);
  if (charge != nullptr) *charge = std::move(whole);
  NoiseProfile of_frame = *frame.noise;
  // Merged frames that moved were interpolated: they have less noise on fine scales than in the mean of a pixel.
  of_frame.reduced = of_frame.reduced || frame.noise_ratio != nullptr;
  add_remarks(check, of_frame, out.warnings);
  out.options.variance_scale = denoise::variance_scale_of(check);
  return out;
}

}  // namespace lowlux::isp
