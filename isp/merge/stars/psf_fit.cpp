#include "isp/merge/stars/psf_fit.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "isp/merge/stars/background.h"
#include "isp/merge/stars/psf_equations.h"

namespace lowlux::merge {
namespace {

constexpr double log_sigma_prior_std = 0.35;  // of ln sigma

/// The sites of a fit, those without a value left out.
struct StarStamp {
  int x0 = 0;
  int y0 = 0;
  int width = 0;
  int height = 0;
  int count = 0;
  int missing = 0;
  struct Site {
    int column;
    int row;
    int colour;
    double signal_e;
    double variance_e2;  // without light
  };
  std::array<Site, max_psf_side * max_psf_side> sites;

  StarStamp(const FrameView& frame, double x, double y, int radius) {
    const int cx = static_cast<int>(std::lround(x)), cy = static_cast<int>(std::lround(y));
    x0 = std::max(cx - radius, 0);
    y0 = std::max(cy - radius, 0);
    width = std::min(cx + radius + 1, frame.signal_e.width) - x0;
    height = std::min(cy + radius + 1, frame.signal_e.height) - y0;
    for (int j = 0; j < height; ++j) {
      for (int i = 0; i < width; ++i) {
        const auto value = static_cast<double>(frame.signal_e.at(x0 + i, y0 + j));
        if (std::isnan(value)) {
          ++missing;
          continue;
        }
        const auto site = static_cast<std::size_t>(site_of(x0 + i, y0 + j));
        sites[static_cast<std::size_t>(count++)] = {i, j, static_cast<int>(colour_at(frame.phase, x0 + i, y0 + j)),
                                                    value, std::max(frame.variance_e2[site], min_variance_e2)};
      }
    }
  }
};

struct PsfShape {
  double x;
  double y;
  double log_sigma;
};

/// One star while it is fitted.
class StarFit {
 public:
  StarFit(const FrameView& frame, const PsfStart& start)
      : start_(start),
        prior_(std::log(start.sigma_px)),
        stamp_(frame, start.x_px, start.y_px,
               std::min(static_cast<int>(std::ceil(3 * start.sigma_px)) + 1, max_psf_radius)),
        shape_{start.x_px, start.y_px, prior_} {
    psf_.fill(0);
    for (int s = 0; s < 4; ++s) {
      const auto colour = static_cast<std::size_t>(colour_at(frame.phase, s % 2, s / 2));
      linear_[colour].background = start.background_e[static_cast<std::size_t>(s)];
    }
    update_weights();
  }

  bool has_enough() const {
    const int all = stamp_.count + stamp_.missing;
    return stamp_.width > 0 && stamp_.height > 0 && stamp_.count >= 25 && 5 * stamp_.count >= 3 * all;
  }

  /// Returns whether the iteration converged.
  bool run() {
    linear_ = sum(shape_).linear;  // a first flux, with the weights of the background
    update_weights();
    State current = sum(shape_);
    for (int iteration = 0; iteration < 30; ++iteration) {
      linear_ = current.linear;
      const double before = update_weights();
      const std::optional<Matrix3> inverse_normal = lowlux::inverse(current.equations.normal);
      if (!inverse_normal) return false;
      covariance_ = *inverse_normal;
      Vector3 step = limited(covariance_ * current.equations.gradient);
      const bool small = is_small(step);
      for (int halving = 0;; ++halving) {
        const PsfShape trial{shape_.x + step[0], shape_.y + step[1], shape_.log_sigma + step[2]};
        current = sum(trial);
        if (current.objective <= before * (1 + 1e-9) || halving == 6) {
          shape_ = trial;
          break;
        }
        for (double& part : step) part /= 2;
      }
      if (!is_near()) return false;
      if (small) return true;
    }
    return false;
  }

  PsfFit result() {
    linear_ = sum(shape_).linear;
    PsfFit out{.x_px = shape_.x, .y_px = shape_.y, .sigma_px = std::exp(shape_.log_sigma), .covariance = covariance_};
    for (std::size_t c = 0; c < 3; ++c) {
      const ColourFit& linear = linear_[c];
      out.flux_e[c] = linear.flux;
      out.background_e[c] = linear.background;
      const Vector3 slope{linear.flux * linear.share[0], linear.flux * linear.share[1], linear.flux * linear.share[2]};
      out.flux_variance_e2[c] = linear.flux_variance + dot(slope, covariance_ * slope);
    }
    out.significance = significance();
    out.sites = stamp_.count;
    out.missing = stamp_.missing;
    measure_misfit(out);
    return out;
  }

 private:
  double model(const StarStamp::Site& site, double psf) const {
    const ColourFit& linear = linear_[static_cast<std::size_t>(site.colour)];
    return linear.background + linear.flux * psf;
  }

  /// Result of the linear part at one shape.
  struct State {
    std::array<ColourFit, 3> linear{};
    ShapeEquations equations;
    double objective = 0;  // weighted squares of the residuals and of the prior
  };

  /// Solves for the linear parameters at a shape, and leaves the PSF of each site in psf_.
  State sum(const PsfShape& shape) {
    const double sigma = std::exp(shape.log_sigma);
    const AxisProfile h(stamp_.x0, stamp_.width, shape.x, sigma), v(stamp_.y0, stamp_.height, shape.y, sigma);
    std::array<ColourSums, 3> sums{};
    for (int k = 0; k < stamp_.count; ++k) {
      const StarStamp::Site& site = stamp_.sites[static_cast<std::size_t>(k)];
      const auto i = static_cast<std::size_t>(site.column), j = static_cast<std::size_t>(site.row);
      const double psf = h.value[i] * v.value[j];
      const Vector3 derivative{h.by_place[i] * v.value[j], h.value[i] * v.by_place[j],
                               h.by_width[i] * v.value[j] + h.value[i] * v.by_width[j]};
      psf_[static_cast<std::size_t>(k)] = psf;
      sums[static_cast<std::size_t>(site.colour)].add(weight_[static_cast<std::size_t>(k)], psf, derivative,
                                                      site.signal_e);
    }
    State out;
    for (std::size_t c = 0; c < 3; ++c) {
      const ColourFit& linear = out.linear[c] = solve_colour(sums[c]);
      out.equations.add(sums[c], linear);
      out.objective += sums[c].yy - linear.background * sums[c].y - linear.flux * sums[c].ey;
    }
    const double from_prior = prior_ - shape.log_sigma, prior_weight = 1 / (log_sigma_prior_std * log_sigma_prior_std);
    out.equations.normal[2][2] += prior_weight;
    out.equations.gradient[2] += prior_weight * from_prior;
    out.objective += prior_weight * from_prior * from_prior;
    return out;
  }

  /// Takes weights from the model at the shape of the last sum. Returns the objective with them.
  double update_weights() {
    const double from_prior = (prior_ - shape_.log_sigma) / log_sigma_prior_std;
    double objective = from_prior * from_prior;
    for (int k = 0; k < stamp_.count; ++k) {
      const StarStamp::Site& site = stamp_.sites[static_cast<std::size_t>(k)];
      const double mean = model(site, psf_[static_cast<std::size_t>(k)]);
      const double weight = 1 / (std::max(mean, 0.0) + site.variance_e2);
      weight_[static_cast<std::size_t>(k)] = weight;
      objective += weight * (site.signal_e - mean) * (site.signal_e - mean);
    }
    return objective;
  }

  static Vector3 limited(const Vector3& step) {
    return {std::clamp(step[0], -0.5, 0.5), std::clamp(step[1], -0.5, 0.5), std::clamp(step[2], -0.3, 0.3)};
  }

  bool is_near() const {
    const double limit = 1.5 + start_.sigma_px / 2, sigma = std::exp(shape_.log_sigma);
    return std::hypot(shape_.x - start_.x_px, shape_.y - start_.y_px) <= limit && sigma > 0.15 &&
           sigma < max_psf_sigma_px;
  }

  bool is_small(const Vector3& step) const {
    double relative = 0;
    for (std::size_t a = 0; a < 3; ++a) relative += step[a] * step[a] / std::max(covariance_[a][a], 1e-12);
    return relative < 1e-4 || std::fabs(step[0]) + std::fabs(step[1]) + std::fabs(step[2]) < 1e-5;
  }

  /// Returns the square root of the sum of flux^2 / variance over the colours, the variance as without the star.
  double significance() const {
    std::array<std::array<double, 3>, 3> sums{};
    for (int k = 0; k < stamp_.count; ++k) {
      const StarStamp::Site& site = stamp_.sites[static_cast<std::size_t>(k)];
      const auto c = static_cast<std::size_t>(site.colour);
      const double psf = psf_[static_cast<std::size_t>(k)];
      const double weight = 1 / (std::max(linear_[c].background, 0.0) + site.variance_e2);
      for (std::size_t power = 0; power < 3; ++power)
        sums[c][power] += weight * (power == 0 ? 1 : power == 1 ? psf : psf * psf);
    }
    double out = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      if (!linear_[c].measured) continue;
      const double per_variance = sums[c][2] - sums[c][1] * sums[c][1] / sums[c][0];
      out += std::max(linear_[c].flux, 0.0) * linear_[c].flux * per_variance;
    }
    return std::sqrt(out);
  }

  /// Other PSFs than Gaussians differ by a fraction of the value, and in their wings by a fraction of the peak.
  void measure_misfit(PsfFit& out) const {
    const AxisProfile h(stamp_.x0, stamp_.width, out.x_px, out.sigma_px);
    const AxisProfile v(stamp_.y0, stamp_.height, out.y_px, out.sigma_px);
    const double peak = std::erf(0.5 / (std::numbers::sqrt2 * out.sigma_px));
    double spread = 0;
    for (int k = 0; k < stamp_.count; ++k) {
      const StarStamp::Site& site = stamp_.sites[static_cast<std::size_t>(k)];
      const double psf = h.value[static_cast<std::size_t>(site.column)] * v.value[static_cast<std::size_t>(site.row)];
      const double flux = linear_[static_cast<std::size_t>(site.colour)].flux, mean = model(site, psf);
      const double noise = std::max(mean, 0.0) + site.variance_e2;
      const double other = 0.2 * flux * psf, wing = 0.05 * flux * peak * peak;
      const double variance = noise + other * other + wing * wing;
      out.chi_square += (site.signal_e - mean) * (site.signal_e - mean) / variance;
      spread += 2 + 1 / noise;
    }
    out.chi_square_limit = stamp_.count + 6 * std::sqrt(spread);
  }

  PsfStart start_;
  double prior_;
  StarStamp stamp_;
  PsfShape shape_;
  std::array<ColourFit, 3> linear_{};
  Matrix3 covariance_{};
  std::array<double, max_psf_side * max_psf_side> psf_{};
  std::array<double, max_psf_side * max_psf_side> weight_{};
};

}  // namespace

std::optional<PsfFit> fit_psf(const FrameView& frame, const PsfStart& start) {
  StarFit fit(frame, start);
  if (!fit.has_enough() || !fit.run()) return std::nullopt;
  return fit.result();
}

}  // namespace lowlux::merge
