#include "isp/cli/noise/noise_source.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "calib/noise/darktable_noise.h"
#include "calib/noise/raspberry_tuning.h"
#include "calib/noise/sensor_class.h"
#include "calib/picture/picture_noise.h"
#include "capture/file/file_bytes.h"
#include "isp/base/sensor.h"
#include "isp/cli/shared/option_values.h"
#include "isp/pipeline/plan/plan_develop.h"
#include "isp/raw/black_point.h"
#include "isp/raw/subtract_dark_frame.h"
#include "isp/raw/to_linear.h"

namespace lowlux::cli {
namespace {

constexpr std::string_view table_name = "/darktable/noiseprofiles.json";

std::string setting_text(const calib::DarktableMatch& match) {
  std::string text = fmt::format("{} at ISO {:g}", match.camera, match.iso);
  if (match.is_beyond) return text + fmt::format(", extrapolated from ISO {:g}", match.low_iso);
  if (match.low_iso < match.high_iso) text += fmt::format(", between {:g} and {:g}", match.low_iso, match.high_iso);
  return text;
}

/// Returns the table's figures of a camera. Errors: the table cannot be read.
Result<std::optional<NoiseOrigin>> origin_in(const std::string& file, const RawDn& raw, double range_dn) {
  const auto bytes = capture::read_file_bytes(file, calib::max_darktable_bytes);
  if (!bytes) return tl::make_unexpected(bytes.error());
  const auto table = calib::parse_darktable_noise({reinterpret_cast<const char*>(bytes->data()), bytes->size()});
  if (!table) return tl::make_unexpected(table.error());
  const auto match = calib::find_darktable_noise(*table, raw.info.make, raw.info.model, *raw.info.iso, range_dn);
  if (!match) return std::nullopt;
  return NoiseOrigin{
      .source = NoiseOrigin::Source::darktable, .basis = setting_text(*match), .figures = match->figures};
}

std::optional<NoiseOrigin> darktable_origin(const RawDn& raw, double range_dn, std::vector<std::string>& warnings) {
  if (!raw.info.iso || raw.info.model.empty()) return std::nullopt;
  for (const std::string& file : darktable_files()) {
    std::error_code absent;
    if (!std::filesystem::is_regular_file(file, absent)) continue;
    auto found = origin_in(file, raw, range_dn);
    if (found) return *std::move(found);
    warnings.push_back(fmt::format("{}: darktable's noise table is not used: {}", file, found.error().message));
  }
  return std::nullopt;
}

using OptionalOrigin = std::optional<NoiseOrigin>;

/// Relative standard error of the noise variance at a level of the image, from which it is stated in a warning: beyond,
/// check_noise would call a model suspicious (denoise::largest_ratio).
constexpr double large_error = 0.5;

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
/// @param has_prior  whether the offset is that of a log-normal prior where the image does not show it
calib::NoiseFigures figures_of(const calib::PictureNoise& noise, bool has_prior) {
  const double gain = noise.gain_dn_per_e.value, read_dn2 = std::max(noise.offset_dn2.value - quantisation_dn2, 0.0);
  const double gain_error = noise.gain_dn_per_e.standard_error / gain;
  calib::NoiseFigures out{.gain_dn_per_e = gain,
                          .read_noise_e = std::sqrt(read_dn2) / gain,
                          .gain_factor = std::exp(gain_error),
                          .read_noise_factor = 1};
  // A measurement that is not above 0 by its error limits the read noise only: half of the limit, within a factor of 2.
  const double limit_dn2 = std::max(noise.offset_dn2.value - quantisation_dn2, 0.0) + noise.offset_dn2.standard_error;
  if (has_prior ? read_dn2 == 0 : read_dn2 < noise.offset_dn2.standard_error) {
    out.read_noise_e = std::sqrt(limit_dn2) / gain / 2;
    out.read_noise_factor = 2;
  } else if (read_dn2 > 0) {  // ln R = ln(offset) / 2 - ln K
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

/// Returns by how much the logarithm of a gain may be off in addition to its prior, because the image contradicts the
/// prior. The image determines one combination of gain and offset: its squared distance from the prior is 1 on average.
double contradiction_of(const calib::NoisePrior& prior, const calib::PictureNoise& fitted) {
  const double gain = std::log(fitted.gain_dn_per_e.value / prior.gain_dn_per_e) / prior.gain_log_std;
  const double offset = std::log(fitted.offset_dn2.value / prior.offset_dn2) / prior.offset_log_std;
  return prior.gain_log_std * std::sqrt(std::max(gain * gain + offset * offset - 1, 0.0));
}

/// Returns the uncertainty of a figure that an image states within `fitted`, and that was expected within `expected`.
/// An image makes figures more certain, unless it contradicts them: then it is not known which of both is wrong.
double adjusted_factor(double fitted, double expected, double contradiction) {
  return std::exp(std::hypot(std::log(std::clamp(fitted, 1.0, expected)), contradiction));
}

/// Returns the relative standard error of the variance of pixels `mean_dn` above black.
double variance_error(const calib::PictureNoise& noise, double mean_dn) {
  const double a = noise.gain_dn_per_e.standard_error * mean_dn, b = noise.offset_dn2.standard_error;
  const double error2 = a * a + b * b + 2 * mean_dn * noise.covariance;
  return std::sqrt(std::max(error2, 0.0)) / (noise.gain_dn_per_e.value * mean_dn + noise.offset_dn2.value);
}

/// Adds one warning if a measurement on the image may be wrong by enough to be visible.
void warn_of_uncertainty(const calib::PictureNoise& noise, std::vector<std::string>& warnings) {
  const double error = std::max(variance_error(noise, std::max(noise.darkest_dn, 0.0)),
                                variance_error(noise, std::max(noise.brightest_dn, 0.0)));
  std::string why;
  if (noise.traces.denoised) {
    why = "it was denoised before, or has texture everywhere";
  } else if (!noise.converged) {
    why = "the fit did not converge";
  } else if (error > large_error) {
    why = fmt::format("its variance within {:.0f} %", 100 * error);
  } else {
    return;
  }
  warnings.push_back(
      fmt::format("the noise measured on the image is uncertain ({}): if detail is lost or noise remains, state the "
                  "noise with --noise GAIN,READ or --profile",
                  why));
}

/// Returns the warning about noise that is assumed because it cannot be measured.
std::string assumed_text(const NoiseOrigin& origin, bool is_denoised) {
  if (origin.prior_ratio == 1) {
    return "the noise is estimated, not measured: " + origin_text(origin) +
           "; --noise GAIN,READ or --profile states it";
  }
  const std::string found =
      fmt::format("the image has {:.2g} times the noise variance expected ({})", origin.prior_ratio, origin.basis);
  if (!is_denoised) return found + ": noise reduction uses the measured noise; --noise GAIN,READ overrides it";
  return found +
         ", because it was denoised before: `develop` does not reduce it again unless --denoise names a level; --noise "
         "GAIN,READ states its size";
}

/// Sets the noise that is known of the sensor, adjusted to the image where it is of use.
NoiseOrigin assume_noise(const BlackPoint& black, std::string unmeasurable, RawFrame& frame, Executor& executor) {
  const RawDn& raw = frame.raw;
  NoiseOrigin out = known_noise(raw, isp::mean_range_dn(raw, black), frame.warnings);
  out.unmeasurable = std::move(unmeasurable);
  double offset_dn2 = offset_dn2_of(*out.figures, raw);
  bool is_denoised = false;
  const calib::NoisePrior prior = prior_of(*out.figures, raw);
  if (const auto fitted = calib::fit_picture_noise(raw, black.pedestal_dn, prior, {}, executor)) {
    const calib::NoiseFigures expected = std::exchange(*out.figures, figures_of(*fitted, true));
    out.prior_ratio = fitted->prior_ratio;
    is_denoised = fitted->prior_ratio < 1 && fitted->traces.denoised;
    out.doubts = fitted->reasons;
    out.is_adjusted = fitted->flat_fraction > 0 || out.prior_ratio < 1;
    const double contradiction = contradiction_of(prior, *fitted);
    const auto adjust = [&](double& factor, double before) { factor = adjusted_factor(factor, before, contradiction); };
    adjust(out.figures->gain_factor, expected.gain_factor);
    adjust(out.figures->read_noise_factor, expected.read_noise_factor);
    offset_dn2 = fitted->offset_dn2.value;
  }
  frame.noise = profile_of(out.figures->gain_dn_per_e, offset_dn2, raw, black, NoiseProfile::Source::picture);
  frame.noise->reduced = is_denoised;
  frame.warnings.push_back(assumed_text(out, is_denoised));
  return out;
}

Result<OptionalOrigin> use_given(const calib::NoiseFigures& given, const BlackPoint& black, RawFrame& frame) {
  frame.noise =
      profile_of(given.gain_dn_per_e, offset_dn2_of(given, frame.raw), frame.raw, black, NoiseProfile::Source::profile);
  if (!isp::electrons_at_white(frame.raw, *frame.noise)) {
    return fail(ErrorCode::invalid_argument, fmt::format("--noise: {:g} DN/e- is not plausible for a range of {:g} DN",
                                                         given.gain_dn_per_e, isp::mean_range_dn(frame.raw, black)));
  }
  return NoiseOrigin{.source = NoiseOrigin::Source::given, .figures = given};
}

/// Returns where noise comes from that a frame has when it is read; X-Trans mosaics are measured then.
NoiseOrigin::Source source_of(const NoiseProfile& noise) {
  switch (noise.source) {
    case NoiseProfile::Source::profile:
      return NoiseOrigin::Source::profile;
    case NoiseProfile::Source::picture:
      return NoiseOrigin::Source::picture;
    case NoiseProfile::Source::file:
      break;
  }
  return NoiseOrigin::Source::file;
}

}  // namespace

std::vector<std::string> darktable_files() {
  const char* const set = std::getenv("XDG_DATA_DIRS");
  std::string_view folders = set != nullptr && *set != '\0' ? set : "/usr/local/share:/usr/share";
  std::vector<std::string> out;
  while (!folders.empty()) {
    const std::string_view folder = folders.substr(0, folders.find(':'));
    folders.remove_prefix(std::min(folder.size() + 1, folders.size()));
    if (!folder.empty()) out.push_back(std::string(folder) + std::string(table_name));
  }
  out.push_back("/opt/darktable/share" + std::string(table_name));
  out.push_back("/var/lib/flatpak/app/org.darktable.Darktable/current/active/files/share" + std::string(table_name));
  return out;
}

NoiseOrigin known_noise(const RawDn& raw, double range_dn, std::vector<std::string>& warnings) {
  if (auto found = darktable_origin(raw, range_dn, warnings)) return *std::move(found);
  if (raw.info.iso) {
    if (auto found = calib::find_raspberry_noise(raw.info.make, raw.info.model, *raw.info.iso, range_dn)) {
      const std::string setting = fmt::format("{} at analogue gain {:g}", found->sensor, found->analogue_gain);
      return {.source = NoiseOrigin::Source::raspberry_pi, .basis = setting, .figures = found->figures};
    }
  }
  const calib::ClassNoise noise = calib::class_noise(raw, range_dn);
  return {
      .source = NoiseOrigin::Source::sensor_class, .basis = calib::text_of(noise, raw.info), .figures = noise.figures};
}

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
    isp::refer_noise_to_black(frame, options);
    return NoiseOrigin{.source = source_of(*frame.noise)};
  }
  if (!given && options.denoise.mode == Mode::off) return std::nullopt;
  const auto black =
      options.dark_frame ? isp::black_of(frame.raw, *options.dark_frame) : isp::choose_black(frame.raw, options.black);
  if (!black) return tl::make_unexpected(black.error());
  if (given) return use_given(*given, *black, frame);
  const auto noise = calib::fit_picture_noise(frame.raw, black->pedestal_dn, {}, executor);
  if (noise) {
    const calib::NoiseFigures figures = figures_of(*noise, false);
    const double offset_dn2 = std::max(noise->offset_dn2.value, offset_dn2_of(figures, frame.raw));
    frame.noise = profile_of(noise->gain_dn_per_e.value, offset_dn2, frame.raw, *black, NoiseProfile::Source::picture);
    NoiseOrigin out{.source = NoiseOrigin::Source::picture, .figures = figures, .doubts = noise->reasons};
    warn_of_uncertainty(*noise, frame.warnings);
    return out;
  }
  const bool has_class = !frame.raw.is_float() && frame.raw.layout != SensorLayout::linear_rgb;
  if (has_class) return assume_noise(*black, noise.error().message, frame, executor);
  const std::string why =
      "the noise is not stated by the file and cannot be measured on the image: " + noise.error().message;
  if (options.denoise.mode == Mode::level || options.denoise.always) {
    return fail(noise.error().code, why + "; state it with --noise GAIN,READ");
  }
  frame.warnings.push_back(why + "; it is not reduced. --noise GAIN,READ states it");
  return std::nullopt;
}

}  // namespace lowlux::cli
