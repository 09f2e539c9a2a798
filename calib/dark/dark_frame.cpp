#include "calib/dark/dark_frame.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "calib/dark/dark_dose.h"
#include "calib/dark/dark_image.h"
#include "calib/dark/dark_pattern.h"
#include "calib/dark/light_in_darks.h"
#include "isp/model/sensor/masked_noise.h"

namespace lowlux::calib {
namespace {

using Groups = std::span<const DarkGroup>;

constexpr double near_white = 0.05;  // of the range
constexpr double level_cut = 5;      // standard deviations
constexpr double max_noise = 5;      // relative to the noise of a pixel's site
constexpr double max_unknown = 1.0 / 16;
constexpr double clipped_fraction = 1e-3;
constexpr double min_doubling_c = 2, max_doubling_c = 30;

/// Inputs and intermediate results, before pixels are processed.
struct Job {
  Groups groups;
  std::vector<PerSite<DarkSite>> sites;    // for each group; the noise is that of one exposure
  std::vector<PerSite<double>> levels_dn;  // for each group: mean_level, or the median where the gain is not known
  std::vector<double> per_file;            // for each group: exposures that a file is the mean of
  std::vector<double> frames;              // for each group: single exposures whose mean has the same noise
  std::vector<double> hot_gain_dn;         // for each group
  DarkWeights weights{};
  std::optional<PerSite<double>> pedestal_dn;
};

Result<void> check_request(const DarkRequest& r) {
  if (!(r.noise_fraction > 0 && r.noise_fraction <= 1)) {
    return fail(ErrorCode::invalid_argument,
                fmt::format("the fraction of variance that darks may add is {:g}, expected above 0 and at most 1",
                            r.noise_fraction));
  }
  if (r.doubling_c && !(*r.doubling_c >= min_doubling_c && *r.doubling_c <= max_doubling_c)) {
    return fail(ErrorCode::invalid_argument,
                fmt::format("dark current doubling over {:g} degrees, expected {:g} to {:g}", *r.doubling_c,
                            min_doubling_c, max_doubling_c));
  }
  for (const double count : r.exposures_per_file) {
    if (count >= 1 && count <= max_exposures) continue;
    return fail(ErrorCode::invalid_argument,
                fmt::format("a dark frame of {:g} exposures, expected 1 to {}", count, max_exposures));
  }
  return {};
}

Result<FrameSetting> check_frames(Groups groups, const RawDn& picture) {
  auto setting = setting_of(picture);
  if (!setting) return setting;
  if (groups.empty()) return fail(ErrorCode::insufficient, "there are no dark frames");
  if (!setting->exposure_s) {
    return fail(ErrorCode::insufficient, "the image does not state its exposure time, which is needed to match darks");
  }
  for (const DarkGroup& group : groups) {
    if (!group.setting.exposure_s) {
      return fail(ErrorCode::insufficient,
                  "a dark frame does not state its exposure time, which is needed to match it to the image");
    }
    auto same = check_same_camera(*setting, group.setting, "the dark frame");
    if (same) continue;
    same.error().message += "; the first frame is the image: take darks with the same camera, image size and ISO";
    return tl::make_unexpected(same.error());
  }
  return setting;
}

std::vector<DarkLevel> levels_of(const Job& job) {
  std::vector<DarkLevel> out;
  out.reserve(job.groups.size());
  for (std::size_t g = 0; g < job.groups.size(); ++g) {
    const DarkGroup& group = job.groups[g];
    DarkLevel level{{*group.setting.exposure_s, group.setting.temperature_c}, job.frames[g]};
    level.level_dn = mean_of_sites(job.levels_dn[g]);
    for (const DarkSite& site : job.sites[g]) {
      level.variance_dn2 += site.noise_dn2 / (4 * static_cast<double>(group.mean_dn.size()) * job.frames[g]);
    }
    out.push_back(level);
  }
  return out;
}

/// Returns the mean of a site's pixels without outliers, as masked pixels are measured where the gain is known: a dark
/// charge of less than an electron is in few pixels, and not in the median.
/// @param exposures  exposures of which each pixel is the mean
double mean_level_dn(const DarkGroup& group, int site, const SiteSpread& spread, double gain_dn_per_e,
                     double exposures) {
  const double cut = level_cut * std::max(spread.deviation, 0.5 / exposures);
  const double low = spread.median - cut;
  const double high = spread.median + cut + isp::max_hidden_charge_e * gain_dn_per_e / exposures;
  double sum = 0, n = 0;
  for (int y = site >> 1; y < group.mean_dn.height(); y += 2) {
    for (int x = site & 1; x < group.mean_dn.width(); x += 2) {
      const double dn = group.mean_dn.at(x, y);
      if (dn >= low && dn <= high) sum += dn, ++n;
    }
  }
  return n > 0 ? sum / n : spread.median;
}

/// Adds the statistics of a group whose files are means of `per_file` exposures each.
void measure_group(const DarkGroup& group, double per_file, const DarkRequest& request, Job& job) {
  PerSite<DarkSite> sites = sites_of(group);
  double gain_dn = per_file * hot_pixel_gain_dn(group, sites), frames = group.frames * per_file;
  if (group.frames == 1 && request.noise) {
    gain_dn = mean_of_sites(request.noise->gain_dn_per_e);
    if (per_file > 1) {
      const PerSite<double> exposure_dn2 = noise_of_one_exposure(*request.noise, sites, request.pedestal_dn);
      frames = 1 / (1 / per_file + (group.rounded ? rounding_dn2 / mean_of_sites(exposure_dn2) : 0));
      for (int site = 0; site < 4; ++site) sites[site].noise_dn2 = exposure_dn2[site];
    }
  } else {
    for (DarkSite& site : sites) site.noise_dn2 *= per_file;
  }
  PerSite<double> levels_dn{};
  for (int site = 0; site < 4; ++site) {
    levels_dn[site] = request.noise ? mean_level_dn(group, site, sites[site].spread, request.noise->gain_dn_per_e[site],
                                                    group.frames * per_file)
                                    : sites[site].spread.median;
  }
  job.sites.push_back(sites);
  job.levels_dn.push_back(levels_dn);
  job.per_file.push_back(per_file);
  job.frames.push_back(frames);
  job.hot_gain_dn.push_back(gain_dn);
}

Result<Job> weigh(Groups groups, const FrameSetting& picture, const DarkRequest& request) {
  Job job{.groups = groups, .pedestal_dn = request.pedestal_dn};
  for (std::size_t g = 0; g < groups.size(); ++g) {
    measure_group(groups[g], request.exposures_per_file.empty() ? 1 : request.exposures_per_file[g], request, job);
  }
  const DarkScaling known{
      .doubling_c = request.doubling_c,
      .pedestal_dn = request.pedestal_dn ? std::optional(mean_of_sites(*request.pedestal_dn)) : std::nullopt,
      .pedestal_from_picture = request.masked_dn.has_value()};
  auto weights = compute_dark_weights(levels_of(job), {*picture.exposure_s, picture.temperature_c}, known);
  if (!weights) return tl::make_unexpected(weights.error());
  job.weights = std::move(*weights);
  if (job.weights.of_pedestal != 0 && request.masked_dn) {
    job.pedestal_dn.emplace();
    for (int site = 0; site < 4; ++site) {
      double level = (*request.masked_dn)[site];
      for (std::size_t g = 0; g < groups.size(); ++g) {
        level -= job.weights.of_level[g] * job.levels_dn[g][site];
      }
      (*job.pedestal_dn)[site] = level / job.weights.of_pedestal;
    }
  }
  return job;
}

Plane<float> weighted_sum(const Job& job) {
  Plane<float> out(job.groups[0].mean_dn.width(), job.groups[0].mean_dn.height());
  for (int y = 0; y < out.height(); ++y) {
    for (int x = 0; x < out.width(); ++x) {
      double sum = job.weights.of_pedestal != 0 ? job.weights.of_pedestal * (*job.pedestal_dn)[site_of(x, y)] : 0;
      for (std::size_t g = 0; g < job.groups.size(); ++g) {
        if (job.weights.of_level[g] != 0) sum += job.weights.of_level[g] * job.groups[g].mean_dn.at(x, y);
      }
      out.at(x, y) = static_cast<float>(sum);
    }
  }
  return out;
}

/// Returns the temporal noise of a site. That of the image is linear in its charge, as the mean is, and at least that
/// of any group times the ratio of their charges, which is at least the group's weight.
DarkNoise noise_of(const Job& job, int site) {
  DarkNoise out{.rows_known = true};
  double interpolated = 0, least = 0;
  for (std::size_t g = 0; g < job.groups.size(); ++g) {
    const double w = job.weights.of_level[g], noise = job.sites[g][site].noise_dn2;
    if (w == 0) continue;
    interpolated += w * noise;
    least = std::max(least, std::min(1.0, job.weights.scale) * noise);
    const DarkGroup& group = job.groups[g];
    out.estimate_dn2 += w * w * noise / job.frames[g];
    out.rows_dn2 += w * w * std::max(0.0, group.row_variance_dn2[site]) / group.frames;
    out.rows_known = out.rows_known && group.frames > 1;
  }
  out.picture_dn2 = job.weights.of_pedestal == 0 && interpolated > 0 ? interpolated : least;
  return out;
}

/// Returns a pixel's noise in the image less its dark: measured, or the noise expected from its charge if that is more.
double pixel_noise(const Job& job, int x, int y) {
  double out = 0;
  for (std::size_t g = 0; g < job.groups.size(); ++g) {
    const double w = std::fabs(job.weights.of_level[g]);
    if (w == 0) continue;
    const DarkSite& site = job.sites[g][site_of(x, y)];
    const double charge = std::max(0.0, job.groups[g].mean_dn.at(x, y) - site.spread.median);
    const double expected = site.noise_dn2 + job.hot_gain_dn[g] * charge;
    const double measured = job.per_file[g] * job.groups[g].variance_dn2.at(x, y);
    out += (w + w * w / job.frames[g]) * std::max(measured, expected);
  }
  return out;
}

double site_noise(const Job& job, int site) {
  double out = 0;
  for (std::size_t g = 0; g < job.groups.size(); ++g) {
    const double w = std::fabs(job.weights.of_level[g]);
    out += (w + w * w / job.frames[g]) * job.sites[g][site].noise_dn2;
  }
  return out;
}

Result<PixelMask> unknown_pixels(const Job& job, const RawDn& picture, DarkFrame& out) {
  PixelMask mask(out.dn.width(), out.dn.height());
  PerSite<double> limit_dn2{};
  for (int site = 0; site < 4; ++site) limit_dn2[site] = max_noise * max_noise * site_noise(job, site);
  const double white = *std::ranges::min_element(picture.white_dn);
  const auto full = [&](int x, int y) {
    for (std::size_t g = 0; g < job.groups.size(); ++g) {
      const double level = job.sites[g][site_of(x, y)].spread.median;
      const double limit = white - near_white * std::max(0.0, white - level);
      if (job.weights.of_level[g] != 0 && job.groups[g].mean_dn.at(x, y) >= limit) return true;
    }
    return false;
  };
  for (int y = 0; y < mask.height(); ++y) {
    for (int x = 0; x < mask.width(); ++x) {
      const double limit = limit_dn2[site_of(x, y)];
      mask.at(x, y) = full(x, y) || (limit > 0 && pixel_noise(job, x, y) > limit) ? 1 : 0;
    }
  }
  const auto unknown = std::count(mask.data(), mask.data() + mask.size(), std::uint8_t{1});
  const double share = static_cast<double>(unknown) / static_cast<double>(mask.size());
  if (share > max_unknown) {
    return fail(ErrorCode::malformed,
                fmt::format("{:.3g} % of the pixels of the darks are saturated or too noisy to subtract, at most "
                            "{:.3g} % are allowed; are these dark frames? Take shorter or colder ones",
                            100 * share, 100 * max_unknown));
  }
  out.unknown.reserve(static_cast<std::size_t>(unknown));
  for (int y = 0; y < mask.height(); ++y) {
    for (int x = 0; x < mask.width(); ++x) {
      if (mask.at(x, y) != 0) out.unknown.push_back({x, y, 1, 1});
    }
  }
  return mask;
}

void describe(const Job& job, bool estimated, DarkFrame& out) {
  double frames = 0;
  for (std::size_t g = 0; g < job.groups.size(); ++g) {
    if (job.weights.of_level[g] == 0) continue;
    frames += job.groups[g].frames * job.per_file[g];
    out.files += job.groups[g].frames;
    out.estimated = out.estimated || (estimated && job.per_file[g] > 1);
    ++out.settings;
    const double zero = *std::ranges::max_element(job.groups[g].fraction_at_zero);
    if (zero > clipped_fraction) {
      out.warnings.push_back(
          fmt::format("{:.3g} % of the darks' samples are cut off at code 0: their mean is too high", 100 * zero));
    }
  }
  out.frames = static_cast<int>(std::lround(frames));
  if (out.frames == 1) {
    out.warnings.emplace_back(
        "with a single dark, only hot pixels and columns are corrected, because its pattern cannot be separated from "
        "its noise; for a master dark state the number of frames with --dark-frame-count");
  }
  out.scale = job.weights.scale;
  out.doubling_c = job.weights.doubling_c.value_or(0);
  out.warnings.insert(out.warnings.end(), job.weights.warnings.begin(), job.weights.warnings.end());
}

void settle_noise(const Job& job, double share, const PixelMask& unknown, DarkFrame& out) {
  for (int site = 0; site < 4; ++site) {
    const DarkNoise noise = noise_of(job, site);
    const KeptPattern kept = limit_noise(out.dn, site, noise, share, unknown);
    out.mean_dn[site] = kept.mean_dn;
    out.noise_std_dn[site] = std::sqrt(noise.picture_dn2);
    out.added_variance_dn2[site] = kept.added_dn2;
    out.noise_fraction += noise.picture_dn2 > 0 ? kept.added_dn2 / noise.picture_dn2 / 4 : 0;
    out.pattern_fraction = std::min(out.pattern_fraction, kept.pixel_fraction);
  }
  if (out.noise_fraction > share) {
    out.warnings.push_back(fmt::format(
        "hot pixels alone add {:.2g} times the variance of the image without light, {:.2g} is allowed: take more darks",
        out.noise_fraction, share));
  }
}

}  // namespace

Result<DarkFrame> make_dark_frame(Groups groups, const RawDn& picture, const DarkRequest& request) {
  if (auto good = check_request(request); !good) return tl::make_unexpected(good.error());
  auto setting = check_frames(groups, picture);
  if (!setting) return tl::make_unexpected(setting.error());
  if (request.is_bias) setting->exposure_s = groups[0].setting.exposure_s;
  const auto job = weigh(groups, *setting, request);
  if (!job) return tl::make_unexpected(job.error());
  DarkFrame out;
  describe(*job, request.estimated, out);
  out.dn = weighted_sum(*job);
  const auto unknown = unknown_pixels(*job, picture, out);
  if (!unknown) return tl::make_unexpected(unknown.error());
  for (std::size_t g = 0; g < groups.size(); ++g) {
    if (job->weights.of_level[g] == 0) continue;
    if (auto even = check_even_dark(groups[g], job->sites[g], job->pedestal_dn); !even) {
      return tl::make_unexpected(even.error());
    }
  }
  settle_noise(*job, request.noise_fraction, *unknown, out);
  if (job->weights.of_pedestal != 0) out.masked_dn = request.masked_dn;
  if (request.is_bias) {
    out.is_bias = true;
    out.holds_dark = false;
    out.masked_dn = out.mean_dn;
  }
  return out;
}

DarkFrame at_masked_level(const DarkFrame& dark, const PerSite<double>& masked_dn) {
  DarkFrame out{.dn = dark.dn.clone(),
                .unknown = dark.unknown,
                .mean_dn = dark.mean_dn,
                .noise_std_dn = dark.noise_std_dn,
                .added_variance_dn2 = dark.added_variance_dn2,
                .frames = dark.frames,
                .files = dark.files,
                .estimated = dark.estimated,
                .settings = dark.settings,
                .scale = dark.scale,
                .doubling_c = dark.doubling_c,
                .noise_fraction = dark.noise_fraction,
                .pattern_fraction = dark.pattern_fraction,
                .masked_dn = masked_dn,
                .is_bias = dark.is_bias,
                .warnings = dark.warnings};
  PerSite<double> change_dn{};
  for (int site = 0; site < 4; ++site) {
    change_dn[site] = masked_dn[site] - (*dark.masked_dn)[site];
    out.mean_dn[site] += change_dn[site];
  }
  for (int y = 0; y < out.dn.height(); ++y) {
    for (int x = 0; x < out.dn.width(); ++x) out.dn.at(x, y) += static_cast<float>(change_dn[site_of(x, y)]);
  }
  return out;
}

}  // namespace lowlux::calib
