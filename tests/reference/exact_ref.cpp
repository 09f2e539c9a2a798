#include "tests/reference/exact_ref.h"

#include <algorithm>
#include <boost/math/constants/constants.hpp>
#include <boost/multiprecision/cpp_bin_float.hpp>
#include <cstddef>
#include <utility>
#include <vector>

namespace lowlux::reference {
namespace {

using Exact = boost::multiprecision::number<boost::multiprecision::cpp_bin_float<50>, boost::multiprecision::et_off>;

double rounded(const Exact& x) { return x.convert_to<double>(); }

Exact mes2_h(const Exact& m, double photopic, double scotopic) {
  const Exact v0 = Exact(683) / 1699;
  const Exact light = (m * photopic + (1 - m) * scotopic * v0) / (m + (1 - m) * v0);
  return Exact("0.7670") + Exact("0.3334") * log10(light) - m;
}

Exact degrees(const Exact& angle) { return angle * boost::math::constants::pi<Exact>() / 180; }

/// Returns the hue angle in 0..360; 0 for grey.
Exact hue(const Exact& a, const Exact& b) {
  if (a == 0 && b == 0) return 0;
  const Exact h = atan2(b, a) / boost::math::constants::pi<Exact>() * 180;
  return h < 0 ? h + 360 : h;
}

using ExactMatrix = std::array<std::array<Exact, 3>, 3>;

ExactMatrix inverse_of(const Matrix3& m) {
  ExactMatrix a, out;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) a[i][j] = m[i][j], out[i][j] = i == j ? 1 : 0;
  }
  for (int k = 0; k < 3; ++k) {
    int pivot = k;
    for (int i = k + 1; i < 3; ++i) pivot = abs(a[i][k]) > abs(a[pivot][k]) ? i : pivot;
    std::swap(a[k], a[pivot]), std::swap(out[k], out[pivot]);
    const Exact by = a[k][k];
    for (int j = 0; j < 3; ++j) a[k][j] /= by, out[k][j] /= by;
    for (int i = 0; i < 3; ++i) {
      if (i == k) continue;
      const Exact times = a[i][k];
      for (int j = 0; j < 3; ++j) a[i][j] -= times * a[k][j], out[i][j] -= times * out[k][j];
    }
  }
  return out;
}

template <class Matrix>
Exact one_norm(const Matrix& m) {
  Exact largest = 0;
  for (int j = 0; j < 3; ++j) {
    Exact sum = 0;
    for (int i = 0; i < 3; ++i) sum += abs(Exact(m[i][j]));
    largest = std::max(largest, sum);
  }
  return largest;
}

Exact probability(int k, double mean) {
  Exact p = exp(-Exact(mean));
  for (int i = 1; i <= k; ++i) p *= Exact(mean) / i;
  return p;
}

}  // namespace

double mes2_residual(double m, double photopic, double scotopic) { return rounded(mes2_h(m, photopic, scotopic)); }

double mes2_root(double photopic, double scotopic) {
  if (mes2_h(0, photopic, scotopic) <= 0) return 0;
  if (mes2_h(1, photopic, scotopic) >= 0) return 1;
  Exact low = 0, high = 1;
  for (int i = 0; i < 100; ++i) {
    const Exact middle = (low + high) / 2;
    (mes2_h(middle, photopic, scotopic) > 0 ? low : high) = middle;
  }
  return rounded(low);
}

double ciede2000(const isp::Lab& first, const isp::Lab& second) {
  const Exact seven = pow(Exact(25), 7);
  const Exact c_mean = (sqrt(Exact(first.a) * first.a + Exact(first.b) * first.b) +
                        sqrt(Exact(second.a) * second.a + Exact(second.b) * second.b)) /
                       2;
  const Exact c7 = pow(c_mean, 7), g = (1 - sqrt(c7 / (c7 + seven))) / 2;
  const Exact a1 = (1 + g) * first.a, a2 = (1 + g) * second.a;
  const Exact c1 = sqrt(a1 * a1 + Exact(first.b) * first.b), c2 = sqrt(a2 * a2 + Exact(second.b) * second.b);
  const Exact h1 = hue(a1, first.b), h2 = hue(a2, second.b);
  Exact dh = h2 - h1, h_mean = h1 + h2;
  if (c1 * c2 == 0) {
    dh = 0;
  } else if (abs(h1 - h2) <= 180) {
    h_mean /= 2;
  } else {
    dh += dh > 180 ? -360 : 360;
    h_mean = (h_mean + (h_mean < 360 ? 360 : -360)) / 2;
  }
  const Exact d_l = Exact(second.l) - first.l, d_c = c2 - c1, d_h = 2 * sqrt(c1 * c2) * sin(degrees(dh / 2));
  const Exact l50 = pow((Exact(first.l) + second.l) / 2 - 50, 2), c = (c1 + c2) / 2;
  const Exact t = 1 - Exact("0.17") * cos(degrees(h_mean - 30)) + Exact("0.24") * cos(degrees(2 * h_mean)) +
                  Exact("0.32") * cos(degrees(3 * h_mean + 6)) - Exact("0.20") * cos(degrees(4 * h_mean - 63));
  const Exact turn = 30 * exp(-pow((h_mean - 275) / 25, 2)), cm7 = pow(c, 7);
  const Exact r_t = -2 * sqrt(cm7 / (cm7 + seven)) * sin(degrees(2 * turn));
  const Exact l = d_l / (1 + Exact("0.015") * l50 / sqrt(20 + l50)), k = d_c / (1 + Exact("0.045") * c),
              h = d_h / (1 + Exact("0.015") * c * t);
  return rounded(sqrt(l * l + k * k + h * h + r_t * k * h));
}

double lab_f(double ratio) {
  const Exact t = ratio, d = Exact(6) / 29;
  return rounded(t > d * d * d ? cbrt(t) : t / (3 * d * d) + Exact(4) / 29);
}

Matrix3 inverse(const Matrix3& m) {
  const ExactMatrix exact = inverse_of(m);
  Matrix3 out{};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) out[i][j] = rounded(exact[i][j]);
  }
  return out;
}

double condition_number(const Matrix3& m) { return rounded(one_norm(m) * one_norm(inverse_of(m))); }

Matrix3 product(const Matrix3& a, const Matrix3& b) {
  Matrix3 out{};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      out[i][j] = rounded(Exact(a[i][0]) * b[0][j] + Exact(a[i][1]) * b[1][j] + Exact(a[i][2]) * b[2][j]);
    }
  }
  return out;
}

double exact_poisson_probability(int k, double mean) { return rounded(probability(k, mean)); }

double poisson_at_least(int k, double mean) {
  Exact term = probability(k, mean), sum = 0;
  for (int i = k + 1; term > sum * Exact("1e-45"); ++i) {
    sum += term;
    term *= Exact(mean) / i;
  }
  return rounded(sum);
}

double doubled(double t, double t0, double doubling) { return rounded(pow(Exact(2), (Exact(t) - t0) / doubling)); }

double hunt_rod_signal(double l_as, double s) {
  const Exact u = 5 * Exact(l_as) / Exact("2.26"), j = Exact("1e-5") / (u + Exact("1e-5"));
  const Exact f_ls = 3800 * j * j * u + pow(1 - j * j, 4) * pow(u, Exact(1) / 6) / 5;
  const Exact b_s = 1 / (2 * (1 + Exact("0.3") * pow(u * s, Exact("0.3")))) + 1 / (2 * (1 + 5 * u));
  const Exact power = pow(f_ls * s, Exact("0.73"));
  return rounded(Exact("3.05") * b_s * 40 * power / (power + 2) + Exact("0.3"));
}

double ciecam02_response(double level, double cone) {
  const Exact x = Exact(level) * cone / 100, power = pow(abs(x), Exact("0.42"));
  const Exact response = 400 * power / (power + Exact("27.13"));
  return rounded(x < 0 ? Exact(-response) : response);
}

KirkChange kirk_change(const std::array<double, 3>& cones_td, double rods_td) {
  const std::array<Exact, 3> k{Exact("0.25"), Exact("0.25"), Exact("0.4")};
  const std::array<Exact, 3> peak{Exact("0.637"), Exact("0.392"), Exact("1.606")};
  std::array<Exact, 3> g, relative;
  for (int i = 0; i < 3; ++i) {
    const Exact base = 1 + Exact("0.33") * (Exact(cones_td[i]) + k[i] * rods_td);
    g[i] = 1 / sqrt(std::max(base, Exact("1e-6")));
    relative[i] = g[i] / peak[i];
  }
  const Exact red = Exact("0.939") * relative[0], green = Exact("1.111") * relative[1];
  const Exact blue = Exact("0.4") * relative[2], alpha = Exact("0.619");
  const Exact w = alpha * relative[0] + (1 - alpha) * relative[1], yellow = Exact("0.15") * w, q = rods_td;
  return {{rounded(g[0]), rounded(g[1]), rounded(g[2])},
          {rounded(15 * k[0] * (green - red) * q), rounded(15 * (blue - yellow) * q), rounded(5 * w * q)},
          {rounded(15 * k[0] * (green + red) * q), rounded(15 * (blue + yellow) * q), rounded(5 * w * q)}};
}

double pattanaik_rods(double g, double intensity) {
  const Exact j = 1 / (5e5 * Exact(g) + 1), rest = 1 - j * j;
  const Exact sigma = Exact("2.5874") * g /
                      (19000 * j * j * g + Exact("0.2615") * rest * rest * rest * rest * pow(Exact(g), Exact(1) / 6));
  const Exact n = Exact("0.73"), i = pow(Exact(intensity), n);
  return rounded(Exact("0.04") / (Exact("0.04") + g) * i / (i + pow(sigma, n)));
}

double entropy_gradient(std::span<const std::array<double, 3>> f, std::span<const double> weight,
                        const std::array<double, 3>& theta, const std::array<double, 3>& eta, double gamma) {
  Exact sum = 0;
  std::array<Exact, 3> moment{};
  for (std::size_t i = 0; i < f.size(); ++i) {
    const Exact p = weight[i] * exp(Exact(f[i][0]) * theta[0] + Exact(f[i][1]) * theta[1] + Exact(f[i][2]) * theta[2]);
    sum += p;
    for (int k = 0; k < 3; ++k) moment[k] += p * f[i][k];
  }
  Exact worst = 0;
  for (int k = 0; k < 3; ++k)
    worst = std::max<Exact>(worst, abs(moment[k] / sum - eta[k] + Exact(gamma) * theta[k] / 2));
  return rounded(worst);
}

double kullback_leibler(std::span<const double> nm, std::span<const double> p, std::span<const double> q,
                        double floor) {
  const std::size_t n = nm.size();
  std::vector<Exact> width(n);
  for (std::size_t i = 0; i < n; ++i) width[i] = (Exact(nm[std::min(i + 1, n - 1)]) - nm[i > 0 ? i - 1 : 0]) / 2;
  const auto held = [&](std::span<const double> s) {
    const Exact least = Exact(floor) * *std::max_element(s.begin(), s.end());
    std::vector<Exact> out(n);
    Exact sum = 0;
    for (std::size_t i = 0; i < n; ++i) sum += width[i] * (out[i] = std::max<Exact>(s[i], least));
    for (Exact& value : out) value /= sum;
    return out;
  };
  const std::vector<Exact> a = held(p), b = held(q);
  Exact sum = 0;
  for (std::size_t i = 0; i < n; ++i) sum += width[i] * a[i] * log(a[i] / b[i]);
  return rounded(sum);
}

}  // namespace lowlux::reference
