#include "calib/picture/picture_noise.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "calib/picture/flat_samples.h"
#include "calib/picture/noise_line.h"
#include "calib/picture/noise_samples.h"

namespace lowlux::calib {
namespace {

constexpr std::size_t min_samples = 100;
constexpr double first_fraction = 0.05;  // of each group: the samples of least detail, as a start
constexpr int max_rounds = 30;
constexpr double settled = 1e-3;              // relative change of the gain
constexpr double expected_contrast = 0.015;   // of PRNU, grain and texture as fine as pixels, in flat samples
constexpr double max_clipped_fraction = 0.9;  // of the pixels
constexpr double largest_gain_error = 0.15;   // relative: beyond, the levels were too similar
constexpr double largest_chi_square = 5;
constexpr double min_prior_ratio = 0.7;  // of the variance of the quietest samples to the line's: below, it is scaled
constexpr double least_prior_ratio = 1e-3;

double white_of(const RawDn& raw, int site) {
  if (raw.layout == SensorLayout::monochrome) return raw.white_dn[0];
  return raw.white_dn[static_cast<int>(colour_at(raw.phase, site & 1, site >> 1))];
}

/// Range of codes of a site's pixels, and the numbers of pixels at its ends.
struct SiteRange {
  ClipRange clip;
  double clipped = 0;
  double pixels = 0;
};

SiteRange range_of(const RawDn& raw, double black_dn, int site) {
  int smallest = 65535;
  std::int64_t at_smallest = 0, at_white = 0, pixels = 0;
  const double white_dn = white_of(raw, site);
  for (int y = site >> 1; y < raw.active.height; y += 2) {
    const std::uint16_t* row = raw.dn.row(raw.active.y + y) + raw.active.x;
    for (int x = site & 1; x < raw.active.width; x += 2) {
      const int code = row[x];
      if (code < smallest) at_smallest = 0;
      smallest = std::min(smallest, code);
      at_smallest += code == smallest ? 1 : 0;
      at_white += code >= white_dn ? 1 : 0;
      ++pixels;
    }
  }
  const std::int64_t clipped = smallest >= white_dn ? pixels : at_smallest + at_white;
  return {{smallest - black_dn, white_dn - black_dn}, static_cast<double>(clipped), static_cast<double>(pixels)};
}

/// Gives both greens, which are one lattice of samples, the range that holds both.
void join_greens(const RawDn& raw, PerSite<ClipRange>& clip) {
  if (raw.layout != SensorLayout::bayer) return;
  const int upper = colour_at(raw.phase, 0, 0) == CfaColour::green ? 0 : 1, lower = 3 - upper;
  const ClipRange both{std::min(clip[upper].low_dn, clip[lower].low_dn),
                       std::max(clip[upper].high_dn, clip[lower].high_dn)};
  clip[upper] = clip[lower] = both;
}

Result<void> check(const RawDn& raw, const PerSite<double>& black_dn, const PictureNoiseOptions& options) {
  if (raw.layout == SensorLayout::linear_rgb) {
    return fail(ErrorCode::unsupported, "demosaicing spread the noise of each pixel over its neighbours");
  }
  if (raw.is_float()) {
    return fail(ErrorCode::unsupported,
                "the samples are floating-point numbers, as those of merged exposures, whose variance is not linear in "
                "the signal: use a raw file with the codes of the sensor");
  }
  if (options.max_samples < 1 || options.max_samples > 10'000'000) {
    return fail(ErrorCode::invalid_argument,
                fmt::format("most_samples is {}: it must be 1 to 10000000", options.max_samples), "most_samples");
  }
  for (int site = 0; site < 4; ++site) {
    if (black_dn[site] >= 0 && black_dn[site] < white_of(raw, site) && std::isfinite(white_of(raw, site))) continue;
    return fail(ErrorCode::invalid_argument,
                fmt::format("black {:g} DN of site {} is not from 0 to below white ({:g} DN): give the black level",
                            black_dn[site], site, white_of(raw, site)),
                "black");
  }
  return {};
}

struct Fit {
  NoiseLine line;
  FlatPoints flat;
  bool converged = false;
};

/// Iterates: the samples of least detail give a first line; that line determines which samples are flat, and those give
/// the next.
std::optional<Fit> settle(const NoiseSamples& samples, const PerSite<ClipRange>& clip) {
  const auto first = fit_noise_line(quietest_points(samples, clip, first_fraction).points);
  if (!first) return std::nullopt;
  Fit out{*first, {}, false};
  for (int i = 0; i < max_rounds && !out.converged; ++i) {
    out.flat = flat_points(samples, out.line, clip, {});
    const auto next = fit_noise_line(out.flat.points, expected_contrast);
    if (!next) return std::nullopt;
    const double gain = out.line.gain_dn_per_e.value;
    out.converged = std::abs(next->gain_dn_per_e.value - gain) < settled * std::abs(gain);
    out.line = *next;
    if (!(next->gain_dn_per_e.value > 0)) break;  // not a possible noise: check_fit reports it
  }
  return out;
}

/// Iterates as above, with a prior: it is the line where no sample is flat.
Fit settle(const NoiseSamples& samples, const PerSite<ClipRange>& clip, const NoisePrior& prior) {
  Fit out;
  out.line = fit_noise_line(quietest_points(samples, clip, first_fraction).points, 0, prior);
  for (int i = 0; i < max_rounds && !out.converged; ++i) {
    out.flat = flat_points(samples, out.line, clip, {});
    const NoiseLine next = fit_noise_line(out.flat.points, expected_contrast, prior);
    const double gain = out.line.gain_dn_per_e.value;
    out.converged = std::abs(next.gain_dn_per_e.value - gain) < settled * gain;
    out.line = next;
  }
  return out;
}

NoiseLine multiplied(NoiseLine line, double factor) {
  for (Estimate* const figure : {&line.gain_dn_per_e, &line.offset_dn2}) {
    figure->value *= factor;
    figure->standard_error *= factor;
  }
  line.covariance *= factor * factor;
  return line;
}

Result<void> check_straight(const NoiseLine& line) {
  if (line.reduced_chi_square <= largest_chi_square) return {};
  return fail(ErrorCode::insufficient,
              fmt::format("the noise does not grow linearly with brightness, as that of unprocessed raws does (reduced "
                          "chi-square {:.1f}, at most 5)",
                          line.reduced_chi_square));
}

Result<void> check_fit(const NoiseLine& line) {
  const Estimate& gain = line.gain_dn_per_e;
  if (!(gain.value > 0) || !(gain.standard_error < largest_gain_error * gain.value)) {
    return fail(ErrorCode::insufficient,
                "the smooth areas of the image are too similar in brightness to separate gain from read noise");
  }
  const Estimate& offset = line.offset_dn2;
  if (offset.value + 3 * offset.standard_error < 0) {
    return fail(
        ErrorCode::insufficient,
        fmt::format(
            "the estimated variance without light is negative ({:.3g} +- {:.2g} DN^2): the black level may be wrong",
            offset.value, offset.standard_error));
  }
  return check_straight(line);
}

/// The samples of a frame, and what is known of their pixels.
struct Evidence {
  NoiseSamples samples;
  PerSite<ClipRange> clip;
  RawTraces traces;
};

/// Returns the range of codes of each site, or the error of a frame that is clipped nearly everywhere.
Result<PerSite<ClipRange>> clip_ranges(const RawDn& raw, const PerSite<double>& black_dn, Executor& executor) {
  PerSite<SiteRange> of_site;
  for_each_index(executor, 4, [&](int site) { of_site[site] = range_of(raw, black_dn[site], site); });
  PerSite<ClipRange> clip;
  double clipped = 0, pixels = 0;
  for (int site = 0; site < 4; ++site) {
    const SiteRange& range = of_site[site];
    clip[site] = range.clip;
    clipped += range.clipped;
    pixels += range.pixels;
  }
  join_greens(raw, clip);
  if (clipped > max_clipped_fraction * pixels) {
    return fail(ErrorCode::insufficient,
                fmt::format("{:.0f} % of the pixels are clipped: change the exposure", 100 * clipped / pixels));
  }
  return clip;
}

Result<Evidence> make_evidence(const RawDn& raw, const PerSite<double>& black_dn, const PictureNoiseOptions& options,
                               Executor& executor) {
  if (const auto good = check(raw, black_dn, options); !good) return tl::make_unexpected(good.error());
  const SamplePlan plan{black_dn, options.max_samples};
  NoiseSamples blocks = block_samples(raw, plan, executor);
  if (blocks.sample.size() < min_samples) {
    return fail(ErrorCode::insufficient,
                fmt::format("{} x {} pixels give {} blocks of 16 x 16, and 100 are needed: give a larger image",
                            raw.active.width, raw.active.height, blocks.sample.size()));
  }
  const auto clip = clip_ranges(raw, black_dn, executor);
  if (!clip) return tl::make_unexpected(clip.error());
  sort_by_surroundings(blocks);
  Evidence out{.samples = {}, .clip = *clip, .traces = code_traces(raw, executor)};
  add_filter_trace(blocks, out.traces);
  out.samples = std::move(blocks);
  if (options.method == PictureNoiseMethod::foi) {
    out.samples = detail_samples(raw, plan, executor);
    sort_by_surroundings(out.samples);
  }
  return out;
}

/// Returns the factor that makes a line no more than the noise of the quietest samples; 1 where it is not far above it.
/// Clipping makes the variance as read no linear function of the line's, hence the rounds.
double prior_ratio_of(const Evidence& evidence, const NoiseLine& line) {
  double out = 1;
  for (int i = 0; i < max_rounds; ++i) {
    const double ratio = quiet_ratio(evidence.samples, multiplied(line, out), evidence.clip, first_fraction);
    if (ratio > (i == 0 ? min_prior_ratio : 1 - settled)) break;
    out *= ratio;
    if (out < least_prior_ratio) return least_prior_ratio;
  }
  return out;
}

void judge(PictureNoise& out) {
  const RawTraces& t = out.traces;
  const double step = t.code_step_dn;
  const double darkest = out.gain_dn_per_e.value * std::max(out.darkest_dn, 0.0) + out.offset_dn2.value;
  out.darkest_noise_steps = std::sqrt(std::max(darkest / (step * step) - 1.0 / 12, 0.0));
  out.under_dithered = out.darkest_noise_steps < 0.5;
  if (out.under_dithered) {
    out.reasons.push_back(
        fmt::format("the noise of the darkest areas is only {:.2f} code steps of {} DN: rounding hides part of it",
                    out.darkest_noise_steps, t.code_step_dn));
  }
  if (t.code_step_dn > 1) out.reasons.push_back(fmt::format("only every {}th code occurs", t.code_step_dn));
  if (t.companded) {
    out.reasons.push_back(
        fmt::format("the raw was compressed with loss: its codes are {} to {} DN apart, depending on brightness",
                    t.code_step_dn, t.largest_step_dn));
  }
  if (t.block_grid) {
    out.reasons.push_back(fmt::format(
        "the raw was compressed with loss in blocks of 8 x 8, whose edges are {:.0f} % stronger than other detail",
        100 * t.grid_excess));
  }
  if (t.denoised) {
    out.reasons.push_back(
        fmt::format("the raw was denoised before, or has texture everywhere: its finest detail has {:.2f} times the "
                    "variance of the "
                    "next coarser one, noise alone has 1",
                    t.fine_to_coarse));
  }
  if (!out.converged) out.reasons.emplace_back("the fit did not converge");
}

PictureNoise described(const Fit& fit, const Evidence& evidence) {
  const auto [darkest, brightest] =
      std::minmax_element(fit.flat.points.begin(), fit.flat.points.end(),
                          [](const NoisePoint& a, const NoisePoint& b) { return a.mean_dn < b.mean_dn; });
  const bool is_measured = darkest != fit.flat.points.end();
  PictureNoise out{.gain_dn_per_e = fit.line.gain_dn_per_e,
                   .offset_dn2 = fit.line.offset_dn2,
                   .covariance = fit.line.covariance,
                   .reduced_chi_square = fit.line.reduced_chi_square,
                   .degrees_of_freedom = fit.line.degrees_of_freedom,
                   .darkest_dn = is_measured ? darkest->mean_dn : 0,
                   .brightest_dn = is_measured ? brightest->mean_dn : 0,
                   .flat_fraction = fit.flat.samples / static_cast<double>(evidence.samples.sample.size()),
                   .converged = fit.converged,
                   .traces = evidence.traces,
                   .contrast_squared = fit.line.contrast_squared};
  judge(out);
  return out;
}

/// Returns the chi square of the measured line about the profile's, for both differences together.
double chi_square_of(const PictureNoise& noise, double gain, double offset) {
  const double da = noise.gain_dn_per_e.value - gain, db = noise.offset_dn2.value - offset;
  const double aa = noise.gain_dn_per_e.standard_error * noise.gain_dn_per_e.standard_error;
  const double bb = noise.offset_dn2.standard_error * noise.offset_dn2.standard_error, ab = noise.covariance;
  return (bb * da * da - 2 * ab * da * db + aa * db * db) / (aa * bb - ab * ab);
}

}  // namespace

Result<PictureNoise> fit_picture_noise(const RawDn& raw, const PerSite<double>& black_dn,
                                       const PictureNoiseOptions& options, Executor& executor) {
  const auto made = make_evidence(raw, black_dn, options, executor);
  if (!made) return tl::make_unexpected(made.error());
  const auto fit = settle(made->samples, made->clip);
  if (!fit) {
    return fail(ErrorCode::insufficient,
                fmt::format("too few of the image's {} blocks are smooth", made->samples.sample.size()));
  }
  if (const auto good = check_fit(fit->line); !good) return tl::make_unexpected(good.error());
  return described(*fit, *made);
}

Result<PictureNoise> fit_picture_noise(const RawDn& raw, const PerSite<double>& black_dn, const NoisePrior& prior,
                                       const PictureNoiseOptions& options, Executor& executor) {
  const auto made = make_evidence(raw, black_dn, options, executor);
  if (!made) return tl::make_unexpected(made.error());
  Fit fit = settle(made->samples, made->clip, prior);
  if (!check_straight(fit.line)) fit = {.line = fit_noise_line({}, 0, prior), .flat = {}, .converged = true};
  const double ratio = prior_ratio_of(*made, fit.line);
  fit.line = multiplied(fit.line, ratio);
  PictureNoise out = described(fit, *made);
  out.prior_ratio = ratio;
  return out;
}

std::array<NoiseAgreement, 3> compare_with(const NoiseProfile& profile, const PictureNoise& noise, double range_dn) {
  std::array<NoiseAgreement, 3> out;
  for (int c = 0; c < 3; ++c) {
    NoiseAgreement& of = out[c];
    of.gain_dn_per_e = profile.scale[c] * range_dn;
    of.offset_dn2 = profile.offset[c] * range_dn * range_dn;
    if (of.gain_dn_per_e != 0) of.gain_ratio = noise.gain_dn_per_e.value / of.gain_dn_per_e;
    if (of.offset_dn2 != 0) of.offset_ratio = noise.offset_dn2.value / of.offset_dn2;
    of.chi_square = chi_square_of(noise, of.gain_dn_per_e, of.offset_dn2);
    const bool near = std::abs(of.gain_ratio - 1) < 0.1 && std::abs(of.offset_ratio - 1) < 0.1;
    of.agrees = of.chi_square < 11.8 || near;
  }
  return out;
}

}  // namespace lowlux::calib
