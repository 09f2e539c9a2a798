#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "isp/model/spectrum/cie_data.h"
#include "isp/model/vision/detection.h"
#include "isp/model/vision/retina.h"
#include "isp/model/vision/seeing.h"
#include "isp/reproduce/reproduce.h"

namespace lowlux::isp {
namespace {

/// Holds a curve of Table V of Hecht, Shlaer & Pirenne, J. Gen. Physiol. 25 (1942) 819-840: flashes of 1 ms at 510 nm
/// in a field of 10 minutes of arc, 20 degrees from the fovea of a dark-adapted eye.
struct Observer {
  const char* name;
  int flashes;                    // at each intensity
  std::array<double, 6> photons;  // at the cornea
  std::array<double, 6> seen_pct;
};
constexpr std::array observers{
    Observer{"SH", 35, {46.9, 73.1, 113.8, 177.4, 276.1, 421.7}, {0, 9.4, 33.3, 73.5, 100, 100}},
    Observer{"SH", 40, {37.1, 58.5, 92.9, 148.6, 239.3, 386.4}, {0, 7.5, 40, 80, 97.5, 100}},
    Observer{"SS", 50, {24.1, 37.6, 58.6, 91.0, 141.9, 221.3}, {0, 4, 18, 54, 94, 100}},
    Observer{"SS", 50, {23.5, 37.1, 58.5, 92.9, 148.6, 239.3}, {0, 0, 12, 44, 94, 100}},
    Observer{"MHP", 50, {37.6, 58.6, 91.0, 141.9, 221.3, 342.8}, {6, 6, 24, 66, 88, 100}},
};

constexpr int min_published_threshold = 5, max_published_threshold = 8;
constexpr double min_published_photons = 54, max_published_photons = 148, published_frequency = 0.6;

double log_times(double share, double probability) {
  return share > 0 ? share * std::log(std::max(probability, std::numeric_limits<double>::min())) : 0;
}

// Returns -2 log of the likelihood over that of the observed frequencies: chi-squared of 5 degrees of freedom at the
// best alpha, if the curve is the observer's.
double deviance(const Observer& o, int threshold, double per_photon) {
  double sum = 0;
  for (std::size_t i = 0; i < o.photons.size(); ++i) {
    const double seen = o.seen_pct[i] / 100, p = *frequency_of_seeing({o.photons[i], per_photon, 0}, threshold);
    sum += log_times(seen, seen) + log_times(1 - seen, 1 - seen) - log_times(seen, p) - log_times(1 - seen, 1 - p);
  }
  return 2 * o.flashes * sum;
}

/// Holds the best isomerisations per photon for a threshold, by maximum likelihood.
struct Fit {
  int threshold;
  double per_photon;
  double deviance;
};

// Searches alpha by golden section: the deviance has one minimum, because curves of one K differ by a shift alone.
Fit fit(const Observer& o, int threshold) {
  constexpr double ratio = 1 / std::numbers::phi;
  double low = std::log(1e-3), high = 0;
  for (int i = 0; i < 60; ++i) {
    const double a = high - ratio * (high - low), b = low + ratio * (high - low);
    if (deviance(o, threshold, std::exp(a)) < deviance(o, threshold, std::exp(b))) {
      high = b;
    } else {
      low = a;
    }
  }
  const double per_photon = std::exp(0.5 * (low + high));
  return {threshold, per_photon, deviance(o, threshold, per_photon)};
}

Fit best_fit(const Observer& o, int from, int to) {
  Fit best = fit(o, from);
  for (int k = from + 1; k <= to; ++k) {
    if (const Fit next = fit(o, k); next.deviance < best.deviance) best = next;
  }
  return best;
}

Finding thresholds_of_observers() {
  constexpr double chi2_5_95 = 11.07;  // 95 % of chi-squared of 5 degrees of freedom
  constexpr int highest = 20;
  std::vector<int> best;
  std::vector<std::string> deviances;
  bool fits = true;
  for (const Observer& o : observers) {
    const Fit published = best_fit(o, min_published_threshold, max_published_threshold);
    fits = fits && published.deviance < chi2_5_95;
    best.push_back(best_fit(o, 1, highest).threshold);
    deviances.push_back(fmt::format("{:.1f}", published.deviance));
  }
  return {
      "retina/observers",
      "the slopes of observers' curves are those of thresholds of 5 to 8 isomerisations (Hecht, Shlaer & Pirenne 1942)",
      "5 to 8",
      fmt::format("{} fit best", fmt::join(best, ", ")),
      fits,
      fmt::format("Eq. 2.7 without dark light, alpha by maximum likelihood, for SH, SH, SS, SS, MHP; with 5 to 8 the "
                  "deviances are {}, and agree below 11.07, 95 % of chi-squared of 5 degrees of freedom",
                  fmt::join(deviances, ", "))};
}

/// Holds how rods at 20 degrees respond to a flash of their best summation, by the model alone.
struct ModelEye {
  double per_photon;  // alpha at 510 nm
  DetectionLimit rods;
};

Result<ModelEye> model_eye() {
  constexpr double flash_nm = 510;
  const auto seeing = seeing_model(pupil_area_mm2(adapted_pupil_mm(0)));
  if (!seeing) return tl::make_unexpected(seeing.error());
  const ReceptorFigures& rod = figures_of(Receptor::rod);
  const double covered = rod.aperture_um2 * rod.density_per_deg2 / retina_um2_per_deg2;
  return ModelEye{covered * isomerisations_per_corneal_photon(Receptor::rod, flash_nm), seeing->rods};
}

Result<Finding> threshold_of_model() {
  const auto eye = model_eye();
  if (!eye) return tl::make_unexpected(eye.error());
  const auto needed = isomerisations_seen_with(published_frequency, eye->rods.threshold);
  if (!needed) return tl::make_unexpected(needed.error());
  const double photons = (*needed - eye->rods.patch.dark_counts) / eye->per_photon;
  const bool inside = photons >= 0.9 * min_published_photons && photons <= 1.1 * max_published_photons;
  Finding out{
      "retina/threshold",
      "a flash at 510 nm is seen in 60 % of the cases with 54 to 148 photons at the cornea (Hecht, Shlaer & Pirenne "
      "1942)",
      "54 to 148",
      fmt::format("{:.0f}", photons),
      photons >= 0.5 * min_published_photons && photons <= 2 * max_published_photons,
      fmt::format("no figure is fitted: alpha {:.3f} (Eq. 2.5), {:.2f} dark isomerisations in Ricco's area and "
                  "0.1 s, threshold {} for {:.2g} % false alarms, whose rate is chosen; the direction holds within a "
                  "factor of two",
                  eye->per_photon, eye->rods.patch.dark_counts, eye->rods.threshold, 100 * eye->rods.false_alarm_rate)};
  out.direction_only = !inside;
  return out;
}

// Their correction for reflection at the cornea, media and retina takes 54 to 148 photons to 5 to 14.
Result<Finding> absorbed_by_rods() {
  const auto eye = model_eye();
  if (!eye) return tl::make_unexpected(eye.error());
  const RetinalPath& path = figures_of(Receptor::rod).path;
  const double absorbed = eye->per_photon / path.isomerisation_efficiency;
  const double pigment = 1 - std::pow(10.0, -path.optical_density);
  return Finding{
      "retina/absorbed",
      "rods absorb 9.3 to 9.5 % of the photons at the cornea, 5 to 14 of 54 to 148 (Hecht, Shlaer & Pirenne 1942)",
      "9.3 to 9.5 %",
      fmt::format("{:.0f} %", 100 * absorbed),
      figures_agree({{9.4, 100 * absorbed}}),
      fmt::format("the paper assumes that the retina absorbs 20 %; the pigment of the rods, of density {:.2f}, absorbs "
                  "{:.0f} % of the light that enters them",
                  path.optical_density, 100 * pigment)};
}

Finding rods_per_troland() {
  constexpr double least = 4.31, most = 8.6;
  const double rate = rod_isomerisations_per_td_s();
  return {
      "retina/rods",
      "a scotopic troland isomerises 4.31 (Makous 2004) to 8.6 (Kraft, Schneeweis & Schnapf 1993) pigment molecules "
      "of a rod in a second (Eq. 2.3, 3.3)",
      "4.31 to 8.6",
      fmt::format("{:.2f}", rate),
      rate >= least && rate <= most,
      fmt::format("{:.3g} photons per degree^2 at the cornea at 507 nm, CIE 203 media, Rodieck's rod; a cone {:.1f} "
                  "per photopic troland",
                  photons_per_scotopic_td(507), cone_isomerisations_per_td_s())};
}

// Every spectrum isomerises rods by its scotopic luminance alone: Eq. 3.3 over wavelength against one factor.
Result<Finding> absorption_by_rods() {
  double worst = 0;
  int lights = 0;
  for (const std::string_view name : light_names()) {
    const Spectrum light = *light_named(name);
    const auto integral = isomerisations_per_s(Receptor::rod, light, 1);
    if (!integral) return tl::make_unexpected(integral.error());
    worst = std::max(worst, std::fabs(*integral / receptor_rates(luminance_of(light), 1).rods - 1));
    ++lights;
  }
  return Finding{"retina/absorption",
                 "isomerisations of rods by Eq. 3.3 over wavelength are those of the scotopic luminance",
                 "0",
                 fmt::format("{:.1e} apart at most", worst),
                 worst < 1e-9,
                 fmt::format("relative, over {} lights", lights),
                 Finding::Kind::check};
}

Result<Plot> observed_curves() {
  Plot plot{"retina", "Frequency of seeing flashes", "photons at the cornea N", "P(see)", AxisScale::logarithmic};
  for (const Observer& o : observers) {
    Series series{fmt::format("{}, {} flashes each", o.name, o.flashes), {}, {}, Mark::points};
    for (std::size_t i = 0; i < o.photons.size(); ++i) {
      series.x.push_back(o.photons[i]);
      series.y.push_back(o.seen_pct[i] / 100);
    }
    plot.series.push_back(std::move(series));
  }
  const auto eye = model_eye();
  if (!eye) return tl::make_unexpected(eye.error());
  const Fit fitted = best_fit(observers[2], min_published_threshold, max_published_threshold);
  Series model{"model with dark light, nothing fitted", {}, {}, Mark::line};
  Series best{fmt::format("K = {} without dark light, fitted to SS", fitted.threshold), {}, {}, Mark::line};
  for (int i = 0; i <= 60; ++i) {
    const double photons = std::pow(10.0, 1 + i / 30.0);
    model.x.push_back(photons);
    model.y.push_back(
        *frequency_of_seeing({photons, eye->per_photon, eye->rods.patch.dark_counts}, eye->rods.threshold));
    best.x.push_back(photons);
    best.y.push_back(*frequency_of_seeing({photons, fitted.per_photon, 0}, fitted.threshold));
  }
  plot.series.push_back(std::move(model));
  plot.series.push_back(std::move(best));
  plot.caption = "Frequencies of Table V of Hecht, Shlaer & Pirenne (1942), and Eq. 2.7.";
  return plot;
}

}  // namespace

Result<Outcome> run_retina(const RunOptions& /*options*/) {
  Outcome out;
  out.findings.push_back(thresholds_of_observers());
  const auto threshold = threshold_of_model();
  if (!threshold) return tl::make_unexpected(threshold.error());
  out.findings.push_back(*threshold);
  const auto absorbed = absorbed_by_rods();
  if (!absorbed) return tl::make_unexpected(absorbed.error());
  out.findings.push_back(*absorbed);
  out.findings.push_back(rods_per_troland());
  const auto absorption = absorption_by_rods();
  if (!absorption) return tl::make_unexpected(absorption.error());
  out.findings.push_back(*absorption);
  auto plot = observed_curves();
  if (!plot) return tl::make_unexpected(plot.error());
  out.plots.push_back(*std::move(plot));
  return out;
}

}  // namespace lowlux::isp
