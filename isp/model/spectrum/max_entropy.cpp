#include "isp/model/spectrum/max_entropy.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace lowlux::isp {
namespace {

constexpr int max_newton_steps = 60;
constexpr double largest_gradient = 1e-10;  // limit for a converged fit, in units of the moments
constexpr double smallest_gamma = 1e-12;
constexpr double smallest_step = 1e-9;

template <std::size_t N>
class Dual {
 public:
  using Vector = Eigen::Matrix<double, static_cast<int>(N), 1>;
  using Matrix = Eigen::Matrix<double, static_cast<int>(N), static_cast<int>(N)>;

  Dual(const SpectralBasis<N>& basis, Vector eta, Matrix ridge)
      : basis_(basis), eta_(std::move(eta)), ridge_(std::move(ridge)), power_(basis.f.size()) {}

  /// Moves to theta; all members below are those at the new position.
  void move(const Vector& theta) {
    double largest = -INFINITY;
    for (std::size_t k = 0; k < basis_.f.size(); ++k) {
      power_[k] = function(k).dot(theta);
      largest = std::max(largest, power_[k]);
    }
    double sum = 0;
    moments.setZero();
    for (std::size_t k = 0; k < basis_.f.size(); ++k) {
      power_[k] = basis_.weight_nm[k] * std::exp(power_[k] - largest);
      sum += power_[k];
      moments += power_[k] * function(k);
    }
    moments /= sum;
    psi = largest + std::log(sum);
    total_ = sum;
    gradient = moments - eta_ + 2 * ridge_ * theta;
    value = psi - theta.dot(eta_) + theta.dot(ridge_ * theta);
  }

  /// Returns whether the fit has converged; false where any value is not a number.
  bool settled() const {
    return std::isfinite(value) && gradient.allFinite() &&
           gradient.template lpNorm<Eigen::Infinity>() <= largest_gradient;
  }

  Matrix hessian() const {
    Matrix h = 2 * ridge_ + 1e-14 * Matrix::Identity();
    for (std::size_t k = 0; k < basis_.f.size(); ++k) {
      const Vector centred = function(k) - moments;
      h += power_[k] / total_ * centred * centred.transpose();
    }
    return h;
  }

  Vector moments = Vector::Zero(), gradient = Vector::Zero();
  double psi = 0, value = 0;

 private:
  Eigen::Map<const Vector> function(std::size_t k) const { return Eigen::Map<const Vector>(basis_.f[k].data()); }

  const SpectralBasis<N>& basis_;
  Vector eta_;
  Matrix ridge_;  // (gamma / 4) A^-1
  std::vector<double> power_;
  double total_ = 1;
};

}  // namespace

template <std::size_t N>
std::optional<MaxEntropyFit<N>> fit_max_entropy(const SpectralBasis<N>& basis, const std::array<double, N>& eta,
                                                const std::array<std::array<double, N>, N>& inverse_a, double gamma,
                                                const std::array<double, N>& start) {
  using Vector = typename Dual<N>::Vector;
  using Matrix = typename Dual<N>::Matrix;
  const Vector target(eta.data());
  Matrix ridge;
  for (std::size_t i = 0; i < N; ++i) {
    for (std::size_t j = 0; j < N; ++j) ridge(static_cast<int>(i), static_cast<int>(j)) = gamma / 4 * inverse_a[i][j];
  }
  if (!target.allFinite() || !ridge.allFinite() || !(gamma >= smallest_gamma)) return std::nullopt;
  std::array<Dual<N>, 2> places{Dual<N>(basis, target, ridge), Dual<N>(basis, target, ridge)};
  Dual<N>*here = &places[0], *next = &places[1];
  Vector theta(start.data());
  here->move(theta);
  int iteration = 0;
  for (; !here->settled(); ++iteration) {
    if (iteration == max_newton_steps || !std::isfinite(here->value)) return std::nullopt;
    const Vector direction = here->hessian().llt().solve(-here->gradient);
    const double slope = here->gradient.dot(direction);
    const double rounding = 1e-14 * (1 + std::fabs(here->value));  // below the resolution of the comparison
    double step = 1;
    for (next->move(theta + direction); step > smallest_step; next->move(theta + step * direction)) {
      if (next->value <= here->value + 1e-4 * step * slope + rounding) break;
      step /= 2;
    }
    theta += step * direction;
    std::swap(here, next);
  }
  MaxEntropyFit<N> fit;
  std::copy_n(theta.data(), N, fit.theta.begin());
  std::copy_n(here->moments.data(), N, fit.moments.begin());
  fit.psi = here->psi;
  fit.entropy = here->psi - theta.dot(here->moments);
  fit.iterations = iteration;
  return fit;
}

template std::optional<MaxEntropyFit<2>> fit_max_entropy(const SpectralBasis<2>&, const std::array<double, 2>&,
                                                         const std::array<std::array<double, 2>, 2>&, double,
                                                         const std::array<double, 2>&);
template std::optional<MaxEntropyFit<3>> fit_max_entropy(const SpectralBasis<3>&, const std::array<double, 3>&,
                                                         const std::array<std::array<double, 3>, 3>&, double,
                                                         const std::array<double, 3>&);

}  // namespace lowlux::isp
