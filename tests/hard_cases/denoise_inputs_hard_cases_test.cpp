#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <string_view>

#include "denoise/check/noise_check.h"
#include "isp/base/executor.h"
#include "tests/hard_cases/mosaics.h"
#include "tests/support/numbers.h"

// What sections 9.5 and 9.8 of the denoising specification say of saturated sites, and of raws that were compressed.
namespace lowlux::hard_cases {
namespace {

using denoise_testing::flat;
using test::inf;

constexpr std::string_view denoise_inputs_group = "Noise reduction";

/// Lamps on grey that are saturated in green, in red and green, in green and blue, in all, and of another colour each.
/// No noise; every value is a code of files.
MosaicCase lamps() {
  MosaicCase c{.raw_e = Plane<float>(190, 98)};
  c.noise = {.variance_e2 = {4, 4, 4}, .saturation_e = {1000, 1000, 1000}};
  c.options.white_gain = {2, 1, 1.25};
  constexpr std::array<std::array<float, 3>, 5> fields_e{
      {{20, 40, 32}, {900, 1000, 400}, {1000, 1000, 800}, {300, 1000, 1000}, {1000, 1000, 1000}}};
  for (int y = 0; y < 98; ++y) {
    for (int x = 0; x < 190; ++x) {
      const bool lit = y >= 40 && y < 56 && x >= 20 && x < 180 && (x - 20) % 40 < 16;
      const auto k = static_cast<std::size_t>(colour_at(c.phase, x, y));
      c.raw_e.at(x, y) = fields_e[static_cast<std::size_t>(lit ? (x - 20) / 40 + 1 : 0)][k];
    }
  }
  return c;
}

/// Returns how far a cell is from what it must be: as measured where some of its values are saturated, else between
/// green and magenta. What differs in red less blue, and in green less green, are slopes of the luma.
double error_of_cell(const MosaicCase& c, PlaneView<const double> out, int x, int y) {
  const std::array<int, 4> at_x{x, x + 1, x, x + 1}, at_y{y, y, y + 1, y + 1};
  int saturated = 0;
  double change = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto raw_e = static_cast<double>(c.raw_e.at(at_x[i], at_y[i]));
    if (raw_e >= 1000) ++saturated;
    keep_worst(change, std::abs(out.at(at_x[i], at_y[i]) - raw_e));
  }
  if (saturated > 0 && saturated < 4) return change;
  return std::abs(2 * out.at(x, y) + 1.25 * out.at(x + 1, y + 1) - out.at(x + 1, y) - out.at(x, y + 1));
}

TEST(HardCaseDenoise5, SaturatedLampsGiveNoColourToWhatIsAround) {
  HardCase row({denoise_inputs_group, "9.5 lamps saturated in one, two, three colours, on grey",
                "closed form: cells saturated in part as measured, R + B = G1 + G2 in the others, balanced",
                "relative to white"});
  const MosaicCase c = lamps();
  // What removed noise takes from the mean is added by the variance of each colour. Four live codes of 1/16 e-, rounded
  // and balanced.
  const Bound by_colour{1e-6, "the added mean of removed noise differs by colour"};
  measure(row, c, {by_colour, float_sums, float_sums, 5.25 / 32 / 2000}, [&](PlaneView<const double> out) {
    double worst = 0;
    for (int y = 0; y < out.height; y += 2) {
      for (int x = 0; x < out.width; x += 2) keep_worst(worst, error_of_cell(c, out, x, y) / 2000);
    }
    return worst;
  });
}

using Block = std::array<std::array<double, 8>, 8>;

/// Orthonormal DCT-II of rows and columns, or its inverse.
Block transformed(const Block& in, bool back) {
  const auto basis = [](int frequency, int at) {
    return std::sqrt((frequency == 0 ? 1 : 2) / 8.0) * std::cos(std::numbers::pi * (at + 0.5) * frequency / 8);
  };
  const auto weight = [&](int to, int from) { return back ? basis(from, to) : basis(to, from); };
  Block rows{}, out{};
  for (int v = 0; v < 8; ++v) {
    for (int u = 0; u < 8; ++u) {
      for (int x = 0; x < 8; ++x) rows[v][u] += weight(u, x) * in[v][x];
    }
  }
  for (int v = 0; v < 8; ++v) {
    for (int u = 0; u < 8; ++u) {
      for (int y = 0; y < 8; ++y) out[v][u] += weight(v, y) * rows[y][u];
    }
  }
  return out;
}

/// What a codec leaves that drops coefficients of 8 x 8 sites of a colour below a threshold, but for their mean.
void compress(PlaneView<float> mosaic, double threshold) {
  for (int y0 = 0; y0 + 16 <= mosaic.height; y0 += (y0 & 1) == 0 ? 1 : 15) {
    for (int x0 = 0; x0 + 16 <= mosaic.width; x0 += (x0 & 1) == 0 ? 1 : 15) {
      Block sites{};
      for (int y = 0; y < 8; ++y) {
        for (int x = 0; x < 8; ++x) sites[y][x] = static_cast<double>(mosaic.at(x0 + 2 * x, y0 + 2 * y));
      }
      Block coefficients = transformed(sites, false);
      for (int i = 1; i < 64; ++i) {
        double& c = coefficients[i / 8][i % 8];
        if (std::abs(c) < threshold) c = 0;
      }
      sites = transformed(coefficients, true);
      for (int y = 0; y < 8; ++y) {
        for (int x = 0; x < 8; ++x) mosaic.at(x0 + 2 * x, y0 + 2 * y) = static_cast<float>(sites[y][x]);
      }
    }
  }
}

// Of a normal figure T deviations are dropped: 2 (T phi(T) + Q(T)) of its square is left, in coefficients as in sites.
// Blocks with few coefficients are flatter as well, and the flattest tenth is measured: a sixth less, or so.
TEST(HardCaseDenoise8, WhatWasCompressedWithLossIsFound) {
  HardCase row({denoise_inputs_group, "9.8 compressed: coefficients below 1.5 deviations dropped",
                "closed form: 0.52 of the variance; five standard errors, and how blocks are chosen", "relative"});
  MosaicCase c = case_of({.read_noise_e = 2}, flat(100, 100, 100), 512, 384, 72);
  constexpr double dropped = 1.5;
  compress(c.raw_e.view(), dropped * std::sqrt(104));
  const double left = dropped * std::exp(-dropped * dropped / 2) * std::sqrt(2 / std::numbers::pi) +
                      std::erfc(dropped / std::numbers::sqrt2);
  const double error = std::sqrt(2 / (48 * std::floor(0.1 * 32 * 24)));
  row.on(Path::reference, 1.0 / 6 + 5 * error, [&](Denormals m) {
    InlineExecutor executor;
    const auto check = in_mode(m, [&] { return denoise::check_noise({c.raw_e.view(), c.phase}, c.noise, executor); });
    return std::abs(check.measured_over_model[0].value_or(inf) / left - 1);
  });
  row.none(levels, "checked before").none(instruction_sets, scalar_code);
  row.on(Path::file, 0, [&](Denormals m) { return warns_of(c, m, "noise") ? 0.0 : 1.0; });
  row.none(Path::live, "streams are not checked against their model");
}

// Codes of sqrt(e + 4), whose noise has a deviation of 1/2 at any light: a twelfth of 1/16 is added to a quarter.
TEST(HardCaseDenoise8, CodesOfSquareRootsKeepTheirMean) {
  HardCase row({denoise_inputs_group, "9.8 packed: codes of square roots, half a deviation apart",
                "closed form: the mean stays; three standard errors, borders being counted twice",
                "standard errors of the mean"});
  MosaicCase c = case_of({.read_noise_e = 2}, flat(30, 100, 50), 256, 192, 73);
  for (std::size_t i = 0; i < c.raw_e.size(); ++i) {
    float& e = c.raw_e.data()[i];
    const double code = std::round(4 * std::sqrt(std::max(0.0, static_cast<double>(e) + 4)));
    e = static_cast<float>(code * code / 16 - 4);
  }
  constexpr Bound bound{3, any_draw};
  measure(row, c, {bound, bound, bound, bound}, change_of_means(c));
}

}  // namespace
}  // namespace lowlux::hard_cases
