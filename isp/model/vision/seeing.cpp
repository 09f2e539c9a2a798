#include "isp/model/vision/seeing.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>

#include <boost/math/special_functions/gamma.hpp>

#include "isp/base/text.h"

namespace lowlux::isp {
namespace {

// Exceptions do not cross a header: arguments are checked here, and underflow to 0 is the right answer.
using Policy =
    boost::math::policies::policy<boost::math::policies::domain_error<boost::math::policies::ignore_error>,
                                  boost::math::policies::overflow_error<boost::math::policies::ignore_error>,
                                  boost::math::policies::evaluation_error<boost::math::policies::ignore_error>>;

tl::unexpected<Error> outside(const char* what, double found, const char* expected) {
  return fail(ErrorCode::invalid_argument,
              std::string(what) + " must be " + expected + ", found " + number_text(found));
}

std::optional<tl::unexpected<Error>> bad_threshold(int threshold) {
  if (threshold >= 1) return std::nullopt;
  return outside("the threshold of isomerisations", threshold, "at least 1");
}

}  // namespace

Result<double> isomerisations_per_photon(const RetinalPath& path) {
  for (const double fraction : {path.transmittance, path.guided, path.isomerisation_efficiency}) {
    if (!(fraction >= 0 && fraction <= 1)) return outside("a fraction of the eye's light", fraction, "from 0 to 1");
  }
  if (!(path.optical_density >= 0)) {
    return outside("the optical density of the photopigment", path.optical_density, "0 or more");
  }
  const double absorbed = -std::expm1(-path.optical_density * std::numbers::ln10);
  return path.transmittance * path.guided * absorbed * path.isomerisation_efficiency;
}

Result<double> frequency_of_seeing(const Flash& flash, int threshold) {
  for (const double figure : {flash.photons, flash.isomerisations_per_photon, flash.dark_isomerisations}) {
    if (!(figure >= 0) || !std::isfinite(figure)) return outside("a figure of a flash", figure, "0 or more and finite");
  }
  if (const auto wrong = bad_threshold(threshold)) return *wrong;
  const double mean = flash.photons * flash.isomerisations_per_photon + flash.dark_isomerisations;
  if (!std::isfinite(mean)) return outside("the isomerisations of a flash", mean, "finite");
  return boost::math::gamma_p(static_cast<double>(threshold), mean, Policy());
}

Result<double> isomerisations_seen_with(double probability, int threshold) {
  if (!(probability > 0 && probability < 1)) {
    return outside("a probability of seeing", probability, "strictly between 0 and 1");
  }
  if (const auto wrong = bad_threshold(threshold)) return *wrong;
  return boost::math::gamma_p_inv(static_cast<double>(threshold), probability, Policy());
}

double barten_sensitivity(double cycles_per_degree, double luminance_cd_m2, double field_deg) {
  if (!(luminance_cd_m2 > 0)) return 0;
  const double u2 = cycles_per_degree * cycles_per_degree;
  const double optics = std::exp(-0.0016 * u2 * std::pow(1 + 100 / luminance_cd_m2, 0.08));
  const double integration = 1 + 144 / (field_deg * field_deg) + 0.64 * u2;
  const double noise = 63 / std::pow(luminance_cd_m2, 0.83) + 1 / (1 - std::exp(-0.02 * u2));
  return 5200 * optics / std::sqrt(integration * noise);
}

double threshold_contrast(double luminance_cd_m2) {
  constexpr double cycles_per_degree = 2, field_deg = 10;
  constexpr double anchor_cd_m2 = 100, anchor = 0.0041, most = 0.999;
  static const double scale = anchor * barten_sensitivity(cycles_per_degree, anchor_cd_m2, field_deg);
  const double sensitivity = barten_sensitivity(cycles_per_degree, luminance_cd_m2, field_deg);
  return sensitivity * most > scale ? scale / sensitivity : most;
}

double threshold_log_contrast(double luminance_cd_m2) {
  const double m = threshold_contrast(luminance_cd_m2);
  return 0.5 * std::log10((1 + m) / (1 - m));
}

}  // namespace lowlux::isp
