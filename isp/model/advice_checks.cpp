#include "isp/model/advice_checks.h"

#include <algorithm>
#include <cmath>

#include "isp/base/number_text.h"
#include "isp/model/noise_budget.h"

namespace lowlux::isp {
namespace {

constexpr double largest_luminance_cd_m2 = 1e12;
constexpr double least = 1e-12;  // of luminances, rates and times: their products stay within double

std::string text_of(double value) { return number_text(value, 3); }

tl::unexpected<Error> wrong(const std::string& what) { return fail(ErrorCode::invalid_argument, what); }

Result<void> check_gain(const GainSetting& gain) {
  if (auto good = check_sensor(gain.sensor); !good) return good;
  double most = 0;
  for (const double rate : gain.white_e_per_s) {
    if (!(rate >= 0) || !(rate <= 1e15)) {
      return fail(ErrorCode::invalid_argument,
                  "the electrons of a white must lie between 0 and 1e15 per second and cd/m2, found " + text_of(rate),
                  gain.name);
    }
    most = std::max(most, rate);
  }
  if (!(most >= least)) return fail(ErrorCode::invalid_argument, "no channel sees the light; give another", gain.name);
  return {};
}

Result<void> check_light(const AdviceRequest& r) {
  if (!(r.midtone_cd_m2 >= least) || !(r.midtone_cd_m2 <= largest_luminance_cd_m2)) {
    return wrong("the mid tone's luminance must lie between 1e-12 and 1e12 cd/m2, found " + text_of(r.midtone_cd_m2));
  }
  if (!(r.highlight_cd_m2 >= r.midtone_cd_m2) || !(r.highlight_cd_m2 <= largest_luminance_cd_m2)) {
    return wrong("the highlight must be at least as bright as the mid tone of " + text_of(r.midtone_cd_m2) +
                 " cd/m2 and at most 1e12 cd/m2, found " + text_of(r.highlight_cd_m2));
  }
  if (!(r.clipped_share >= 1e-9) || !(r.clipped_share <= 0.5)) {
    return wrong("the share allowed to clip must lie between 1e-9 and 0.5, found " + text_of(r.clipped_share));
  }
  return {};
}

const char* name_of(NoiseSource source) {
  static constexpr const char* names[] = {"photon noise", "dark current", "read noise", "quantisation"};
  return names[static_cast<int>(source)];
}

/// A gain setting beside the best one, if there is one: the next higher, or the next lower.
std::optional<std::size_t> neighbour(const AdviceRequest& r, std::size_t best, bool higher) {
  const auto k = [&](std::size_t i) { return r.gains[i].sensor.system_gain_dn_per_e; };
  std::optional<std::size_t> found;
  for (std::size_t i = 0; i < r.gains.size(); ++i) {
    if (higher ? k(i) <= k(best) : k(i) >= k(best)) continue;
    if (!found || (higher ? k(i) < k(*found) : k(i) > k(*found))) found = i;
  }
  return found;
}

std::string limit_text(const AdviceRequest& r, const ExposureAdvice& advice) {
  const GainAdvice& best = advice.gains[advice.best];
  const std::string time = text_of(best.at.exposure_s) + " s";
  switch (best.limit) {
    case ExposureLimit::motion:
      return "motion limits the exposure to " + time;
    case ExposureLimit::converter_range:
      return "the highlight reaches the converter's largest code at " + r.gains[advice.best].name + " after " + time;
    case ExposureLimit::full_well:
      break;
  }
  return "the highlight fills the pixels after " + time;
}

std::string higher_text(const AdviceRequest& r, const ExposureAdvice& advice, const std::vector<double>& losses_db) {
  const auto higher = neighbour(r, advice.best, true);
  if (!higher) return r.gains.size() > 1 ? "no higher gain reads with less noise" : "";
  const bool sooner = advice.gains[*higher].at.exposure_s < advice.gains[advice.best].at.exposure_s;
  const std::string& name = r.gains[*higher].name;
  const double lost_db = losses_db[*higher] - losses_db[advice.best];
  if (sooner) return name + " would clip the highlight after " + text_of(advice.gains[*higher].at.exposure_s) + " s";
  if (lost_db > equal_quality_db) return name + " would lose " + text_of(lost_db) + " dB";
  return "above " + r.gains[advice.best].name + " noise no longer falls by " + text_of(equal_quality_db) + " dB";
}

}  // namespace

Result<double> motion_limit_s(const Motion& motion) {
  if (!(motion.speed_px_per_s > 0) || !(motion.blur_px > 0) || !std::isfinite(motion.speed_px_per_s)) {
    return wrong("speed and blur must be above 0 px/s and 0 px, found " + text_of(motion.speed_px_per_s) + " and " +
                 text_of(motion.blur_px));
  }
  const double limit_s = motion.blur_px / motion.speed_px_per_s;
  if (!(limit_s > 0) || !(limit_s <= 1e6)) {
    return wrong("blur over speed must be an exposure of at most 1e6 s, found " + text_of(limit_s) +
                 " s; give the longest exposure instead");
  }
  return limit_s;
}

Result<void> check_request(const AdviceRequest& r) {
  if (r.gains.empty()) return wrong("there is no gain setting to choose from; give a sensor that has figures");
  for (const GainSetting& gain : r.gains) {
    if (auto good = check_gain(gain); !good) return good;
  }
  if (auto good = check_light(r); !good) return good;
  if (!(r.longest_exposure_s >= least)) {
    return wrong("the longest exposure must be at least 1e-12 s, found " + text_of(r.longest_exposure_s));
  }
  if (auto good = check_exposure({r.longest_exposure_s, r.temperature_c}); !good) return good;
  if (!(r.patch_pixels >= 1) || !(r.patch_pixels <= 1e12)) {
    return wrong("a patch has 1 to 1e12 pixels, found " + text_of(r.patch_pixels));
  }
  if (r.frames < 1 || r.frames > 1000000) return wrong("1 to 1000000 frames are averaged, found " + text_of(r.frames));
  if (r.curve_points < 2 || r.curve_points > 10000) {
    return wrong("a curve has 2 to 10000 points, found " + text_of(r.curve_points));
  }
  for (const Vector3& row : r.camera_to_xyz) {
    if (!std::ranges::all_of(row, [](double value) { return std::isfinite(value); })) {
      return wrong("the matrix to XYZ must be of finite numbers; give the colours of this camera");
    }
  }
  return {};
}

std::string advice_reason(const AdviceRequest& r, const ExposureAdvice& advice, const std::vector<double>& losses_db) {
  const GainAdvice& best = advice.gains[advice.best];
  std::string text = limit_text(r, advice);
  if (const auto lower = neighbour(r, advice.best, false)) {
    text += ", " + r.gains[*lower].name + " would lose " + text_of(losses_db[*lower] - losses_db[advice.best]) + " dB";
  }
  if (const std::string higher = higher_text(r, advice, losses_db); !higher.empty()) text += ", " + higher;
  return text + "; " + name_of(best.largest_noise) + " is " + text_of(100 * best.largest_noise_share) +
         " % of the variance";
}

}  // namespace lowlux::isp
