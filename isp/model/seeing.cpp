#include "isp/model/seeing.h"

#include <cmath>
#include <numbers>
#include <optional>
#include <string>

#include <boost/math/special_functions/gamma.hpp>

#include "isp/base/number_text.h"

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

}  // namespace lowlux::isp
