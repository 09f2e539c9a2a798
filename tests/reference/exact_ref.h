#pragma once

#include <array>
#include <span>

#include "isp/base/matrix3.h"
#include "isp/model/colour/colorimetry.h"

/// These formulas are computed in 50 decimal digits, each rounded once, to the nearest double. They are written from
/// their sources; nothing is shared with the library.
namespace lowlux::reference {

/// Returns a + b log10 L(m) - m of CIE 191:2010, not clamped.
/// @param m  0..1; luminances positive
double mes2_residual(double m, double photopic, double scotopic);
/// Returns the root of mes2_residual in 0..1 by bisection, where it is positive at 0 and negative at 1; else the end
/// the root is nearest to.
double mes2_root(double photopic, double scotopic);

/// Returns CIEDE2000 (Sharma, Wu & Dalal 2005), k_L = k_C = k_H = 1.
double ciede2000(const isp::Lab& first, const isp::Lab& second);
/// Returns CIELAB f of a ratio, the straight line below (6/29)^3 and for negative ratios.
double lab_f(double ratio);

/// Returns the inverse by Gauss-Jordan elimination with pivots.
Matrix3 inverse(const Matrix3& m);
/// Returns the condition number in the 1-norm.
double condition_number(const Matrix3& m);
Matrix3 product(const Matrix3& a, const Matrix3& b);

/// Returns P(k; mean) of a Poisson variable, from its definition.
double exact_poisson_probability(int k, double mean);
/// Returns the probability of at least k events of a Poisson variable.
double poisson_at_least(int k, double mean);
/// Returns 2^((t - t0) / doubling).
double doubled(double t, double t0, double doubling);

/// Returns A_S of Hunt's model (thesis Eq. 2.11 with B_S), s the signal relative to that of white.
double hunt_rod_signal(double l_as, double s);
/// Returns 400 x^0.42 / (x^0.42 + 27.13), odd, x = level * cone / 100.
double ciecam02_response(double level, double cone);
/// Holds the gains of L, M and S and the changes of M - L, S - L - M and L + M that rods cause in cones (Kirk & O'Brien
/// 2011, thesis Eq. 2.22 to 2.24 with the power 1/2), 1 + 0.33 (...) being 1e-6 at least; and the sum of magnitudes in
/// each change.
struct KirkChange {
  std::array<double, 3> gain, opponent, magnitude;
};
KirkChange kirk_change(const std::array<double, 3>& cones_td, double rods_td);
/// Returns B I^n / (I^n + sigma^n), n = 0.73, of rods (Pattanaik et al. 2000) adapted to G.
double pattanaik_rods(double g, double intensity);

/// Returns the largest component of moments - eta + (gamma / 2) theta for p = exp(<f, theta> - psi), integral 1: 0 at
/// the fit.
double entropy_gradient(std::span<const std::array<double, 3>> f, std::span<const double> weight,
                        const std::array<double, 3>& theta, const std::array<double, 3>& eta, double gamma);

/// Returns the integral of p log(p / q) by the trapezium rule; each no less than `floor` of its peak, then normalised
/// to 1.
double kullback_leibler(std::span<const double> nm, std::span<const double> p, std::span<const double> q, double floor);

}  // namespace lowlux::reference
