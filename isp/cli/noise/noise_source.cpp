#include "isp/cli/noise/noise_source.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "calib/picture/picture_noise.h"
#include "isp/base/sensor.h"
#include "isp/cli/noise/known_noise.h"
#include "isp/cli/shared/option_values.h"
#include "isp/raw/black_point.h"
#include "isp/raw/subtract_dark_frame.h"
#include "isp/raw/to_linear.h"

namespace lowlux::cli {
namespace {

using OptionalOrigin = std::optional<NoiseOrigin>;

/// Returns variance = gain (mean - black) + offset [DN^2] relative to white less black.
NoiseProfile profile_of(double gain_dn_per_e, double offset_dn2, const RawDn& raw, const BlackPoint& black,
                        NoiseProfile::Source source) {
  NoiseProfile out{.source = source};
  for (int site = 0; site < 4; ++site) {
    const auto colour = raw.layout == SensorLayout::bayer
                            ? static_cast<std::size_t>(colour_at(raw.phase, site & 1, site >> 1))
                            : static_cast<std::size_t>(std::min(site, 2));
    const double range_dn = isp::white_at(raw, site) - black.pedestal_dn[site];
    out.scale[colour] = gain_dn_per_e / range_dn;
    out.offset[colour] = offset_dn2 / (range_dn * range_dn);
  }
  return out;
}

/// Returns the variance without light: read noise and, for codes, quantisation.
double offset_dn2_of(const calib::NoiseFigures& figures, const RawDn& raw) {
  const double read_dn = figures.gain_dn_per_e * figures.read_noise_e;
  return read_dn * read_dn + (raw.is_float() ? 0 : quantisation_dn2);
}

/// Returns the figures of a measurement, with its standard errors as factors.
calib::NoiseFigures figures_of(const calib::PictureNoise& noise) {
  const double gain = noise.gain_dn_per_e.value, read_dn2 = std::max(noise.offset_dn2.value - quantisation_dn2, 0.0);
  const double gain_error = noise.gain_dn_per_e.standard_error / gain;
  calib::NoiseFigures out{.gain_dn_per_e = gain,
                          .read_noise_e = std::sqrt(read_dn2) / gain,
                          .gain_factor = std::exp(gain_error),
                          .read_noise_factor = 1};
  if (read_dn2 > 0) {  // ln R = ln(offset) / 2 - ln K
    const double offset_error = noise.offset_dn2.standard_error / (2 * read_dn2);
    const double shared = noise.covariance / (read_dn2 * gain);
    const double variance = offset_error * offset_error + gain_error * gain_error - shared;
    out.read_noise_factor = std::exp(std::sqrt(std::max(variance, 0.0)));
  }
  return out;
}

/// Returns the figures as what is known before the image is measured.
calib::NoisePrior prior_of(const calib::NoiseFigures& figures, const RawDn& raw) {
  const double gain_log_std = std::log(figures.gain_factor);
  const double offset_dn2 = offset_dn2_of(figures, raw);
  const double read_part = (offset_dn2 - quantisation_dn2) / offset_dn2;  // quantisation is certain
  return {
      .gain_dn_per_e = figures.gain_dn_per_e,
      .offset_dn2 = offset_dn2,
      .gain_log_std = gain_log_std,
      .offset_log_std = std::max(2 * read_part * std::hypot(gain_log_std, std::log(figures.read_noise_factor)), 0.1)};
}

std::string found_text(const calib::PictureNoise& noise) {
  const double gain = noise.gain_dn_per_e.value;
  std::string text = fmt::format(
      "neither a profile nor the file states usable noise: measured on the picture itself, {:.3g} DN/e-, "
      "{:.2g} e- without light",
      gain, std::sqrt(std::max(noise.offset_dn2.value, 0.0)) / gain);
  for (const std::string& doubt : noise.reasons) text += "; " + doubt;
  return text;
}

/// Sets the noise that is known of the sensor, adjusted to the image where it is of use.
NoiseOrigin assume_noise(const BlackPoint& black, std::string unmeasurable, RawFrame& frame, Executor& executor) {
  const RawDn& raw = frame.raw;
  NoiseOrigin out = known_noise(raw, isp::mean_range_dn(raw, black), frame.warnings);
  out.unmeasurable = std::move(unmeasurable);
  double offset_dn2 = offset_dn2_of(*out.figures, raw);
  if (const auto fitted = calib::fit_picture_noise(raw, black.pedestal_dn, prior_of(*out.figures, raw), {}, executor)) {
    const calib::NoiseFigures expected = std::exchange(*out.figures, figures_of(*fitted));
    out.is_adjusted = fitted->flat_fraction > 0;  // an image makes figures more certain, never less
    out.figures->gain_factor = std::min(out.figures->gain_factor, expected.gain_factor);
    out.figures->read_noise_factor = std::clamp(out.figures->read_noise_factor, 1.0, expected.read_noise_factor);
    offset_dn2 = fitted->offset_dn2.value;
  }
  frame.noise = profile_of(out.figures->gain_dn_per_e, offset_dn2, raw, black, NoiseProfile::Source::picture);
  frame.warnings.push_back("noise model from " + origin_text(out) + "; --noise or --profile makes it exact");
  return out;
}

Result<OptionalOrigin> use_given(const calib::NoiseFigures& given, const BlackPoint& black, RawFrame& frame) {
  frame.noise =
      profile_of(given.gain_dn_per_e, offset_dn2_of(given, frame.raw), frame.raw, black, NoiseProfile::Source::profile);
  if (!isp::electrons_at_white(frame.raw, *frame.noise)) {
    return fail(ErrorCode::invalid_argument, fmt::format("--noise: {:g} DN/e- is not possible for a range of {:g} DN",
                                                         given.gain_dn_per_e, isp::mean_range_dn(frame.raw, black)));
  }
  return NoiseOrigin{NoiseOrigin::Source::given, {}, given, {}, false};
}

}  // namespace

std::optional<calib::NoiseFigures> noise_figures_of(const std::string& text) {
  const auto figures = numbers_of(text, 2);
  if (!figures || figures->size() != 2) return std::nullopt;
  const double gain = figures->front(), read = figures->back();
  if (!(gain >= 1e-6 && gain <= 1e6 && read >= 0 && read <= 1e5)) return std::nullopt;
  return calib::NoiseFigures{.gain_dn_per_e = gain, .read_noise_e = read};
}

Result<OptionalOrigin> find_noise(const isp::DevelopOptions& options, const std::optional<calib::NoiseFigures>& given,
                                  RawFrame& frame, Executor& executor) {
  using Mode = isp::DenoiseChoice::Mode;
  const bool is_stated = frame.noise && isp::electrons_at_white(frame.raw, *frame.noise);
  if (!given && is_stated) {
    const bool is_profile = frame.noise->source == NoiseProfile::Source::profile;
    return NoiseOrigin{is_profile ? NoiseOrigin::Source::profile : NoiseOrigin::Source::file, {}, {}, {}, false};
  }
  if (!given && (options.denoise.mode == Mode::off || frame.raw.layout != SensorLayout::bayer)) return std::nullopt;
  const auto black =
      options.dark_frame ? isp::black_of(frame.raw, *options.dark_frame) : isp::choose_black(frame.raw, options.black);
  if (!black) return tl::make_unexpected(black.error());
  if (given) return use_given(*given, *black, frame);
  const auto noise = calib::fit_picture_noise(frame.raw, black->pedestal_dn, {}, executor);
  if (noise) {
    frame.noise = profile_of(noise->gain_dn_per_e.value, noise->offset_dn2.value, frame.raw, *black,
                             NoiseProfile::Source::picture);
    frame.warnings.push_back(found_text(*noise));
    return NoiseOrigin{NoiseOrigin::Source::picture, {}, figures_of(*noise), {}, false};
  }
  if (!frame.raw.is_float()) return assume_noise(*black, noise.error().message, frame, executor);
  const std::string why =
      "neither a profile nor the file states usable noise, and it cannot be estimated from this "
      "picture: " +
      noise.error().message;
  if (options.denoise.mode == Mode::level || options.denoise.always) {
    return fail(noise.error().code, why + "; give it (--noise)");
  }
  frame.warnings.push_back(why + "; it is left as it is");
  return std::nullopt;
}

}  // namespace lowlux::cli
