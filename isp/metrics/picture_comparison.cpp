#include "isp/metrics/picture_comparison.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "isp/metrics/picture_metrics.h"
#include "isp/model/colour/colour_difference.h"
#include "isp/render/output_space.h"

namespace lowlux::isp {
namespace {

constexpr double c1 = 0.01 * 0.01, c2 = 0.03 * 0.03;  // of SSIM, for values in 0..1
constexpr double sigma_px = 1.5;                      // of SSIM's window

using Window = std::array<double, ssim_window_px>;

Window gaussian() {
  constexpr int middle = ssim_window_px / 2;
  Window w{};
  for (int i = 0; i < ssim_window_px; ++i) {
    const double z = (i - middle) / sigma_px;
    w[static_cast<std::size_t>(i)] = std::exp(-z * z / 2);
  }
  const double sum = std::accumulate(w.begin(), w.end(), 0.0);
  for (double& v : w) v /= sum;
  return w;
}

/// Holds weighted means over a window, or over one of its columns.
struct Moments {
  double a = 0, b = 0, aa = 0, bb = 0, ab = 0;

  void add(double weight, const Moments& m) {
    a += weight * m.a;
    b += weight * m.b;
    aa += weight * m.aa;
    bb += weight * m.bb;
    ab += weight * m.ab;
  }
};

double similarity(const Moments& m) {
  const double variance_a = m.aa - m.a * m.a, variance_b = m.bb - m.b * m.b, covariance = m.ab - m.a * m.b;
  return (2 * m.a * m.b + c1) * (2 * covariance + c2) / ((m.a * m.a + m.b * m.b + c1) * (variance_a + variance_b + c2));
}

struct Planes {
  PlaneView<const float> first;
  PlaneView<const float> second;
  Window weight;
};

/// Returns the sum over the windows whose upper row is y. `columns` has as many elements as the planes have columns.
double row_sum(const Planes& planes, int y, std::vector<Moments>& columns) {
  for (std::size_t x = 0; x < columns.size(); ++x) {
    columns[x] = {};
    for (int i = 0; i < ssim_window_px; ++i) {
      const auto a = static_cast<double>(planes.first.at(static_cast<int>(x), y + i));
      const auto b = static_cast<double>(planes.second.at(static_cast<int>(x), y + i));
      columns[x].add(planes.weight[static_cast<std::size_t>(i)], {a, b, a * a, b * b, a * b});
    }
  }
  double sum = 0;
  for (std::size_t x = 0; x + ssim_window_px <= columns.size(); ++x) {
    Moments whole;
    for (std::size_t i = 0; i < ssim_window_px; ++i) whole.add(planes.weight[i], columns[x + i]);
    sum += similarity(whole);
  }
  return sum;
}

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

bool is_finite(const Lab& c) { return std::isfinite(c.l) && std::isfinite(c.a) && std::isfinite(c.b); }

Vector3 pixel(const SceneLinear& picture, int x, int y) {
  return {static_cast<double>(picture.plane[0].at(x, y)), static_cast<double>(picture.plane[1].at(x, y)),
          static_cast<double>(picture.plane[2].at(x, y))};
}

Lab lab_at(const SceneLinear& xyz, int x, int y) {
  static const Xyz white = xyz_of(white_d65).value();  // cannot fail for a constant
  return lab_of(xyz_of(pixel(xyz, x, y)), white);
}

/// Holds one difference for each pixel, NaN where it is not finite.
struct Differences {
  explicit Differences(std::size_t pixels) : ab(pixels), of_94c(pixels), of_2000(pixels) {}
  std::vector<float> ab, of_94c, of_2000;
};

struct Comparing {
  const SceneLinear& reference;
  const SceneLinear& test;
  Differences differences;
  GamutBins reference_bins, test_bins;
};

constexpr int piece_px = 64;  // pixels of a row whose colours fit on the stack

void compare_piece(Comparing& work, int x0, int y) {
  std::array<Lab, piece_px> first, second;
  const auto count = static_cast<std::size_t>(std::min(piece_px, work.reference.width() - x0));
  const std::size_t at =
      static_cast<std::size_t>(y) * static_cast<std::size_t>(work.reference.width()) + static_cast<std::size_t>(x0);
  for (std::size_t i = 0; i < count; ++i) {
    const int x = x0 + static_cast<int>(i);
    const Lab a = first[i] = lab_at(work.reference, x, y), b = second[i] = lab_at(work.test, x, y);
    const bool counts = is_finite(a) && is_finite(b);
    work.differences.ab[at + i] = static_cast<float>(counts ? delta_e_ab(a, b) : nan);
    work.differences.of_94c[at + i] = static_cast<float>(counts ? delta_e_94c(a, b) : nan);
    work.differences.of_2000[at + i] = static_cast<float>(counts ? ciede2000(a, b) : nan);
  }
  work.reference_bins.add(std::span(first).first(count));
  work.test_bins.add(std::span(second).first(count));
}

DifferenceSummary summary_of_finite(std::vector<float>& differences) {
  const auto end = std::remove_if(differences.begin(), differences.end(), [](float d) { return !std::isfinite(d); });
  return summary_of({differences.begin(), end});
}

/// Holds the codes that a display shows of an image.
struct DisplayCodes {
  SceneLinear srgb;  // code values, 0..1
  std::uint64_t outside = 0;
};

DisplayCodes display_codes(const SceneLinear& xyz, Executor& executor) {
  static const Matrix3 to_rgb = inverse(rgb_to_xyz(primaries_rec709).value()).value();  // cannot fail for constants
  DisplayCodes out{.srgb = SceneLinear(xyz.width(), xyz.height())};
  std::vector<std::uint64_t> outside(static_cast<std::size_t>(executor.width()));
  for_each_band(executor, xyz.height(), [&](RowBand band, int index) {
    for (int y = band.first; y < band.last; ++y) {
      for (int x = 0; x < xyz.width(); ++x) {
        const Vector3 rgb = to_rgb * pixel(xyz, x, y);
        bool inside = true;
        for (std::size_t c = 0; c < 3; ++c) {
          inside = inside && rgb[c] >= -display_tolerance && rgb[c] <= 1 + display_tolerance;  // false for NaN
          out.srgb.plane[c].at(x, y) = srgb_code(rgb[c]);
        }
        outside[static_cast<std::size_t>(index)] += inside ? 0 : 1;
      }
    }
  });
  out.outside = std::accumulate(outside.begin(), outside.end(), std::uint64_t{0});
  return out;
}

Plane<float> luma_of(const SceneLinear& codes) {
  static const Vector3 weight = luminance_weights(OutputSpace::linear_srgb).value();  // cannot fail for constants
  Plane<float> out(codes.width(), codes.height());
  for (int y = 0; y < codes.height(); ++y) {
    for (int x = 0; x < codes.width(); ++x) {
      const Vector3 c = pixel(codes, x, y);
      out.at(x, y) = static_cast<float>(weight[0] * c[0] + weight[1] * c[1] + weight[2] * c[2]);
    }
  }
  return out;
}

void compare_colours(const SceneLinear& reference, const SceneLinear& test, Executor& executor,
                     PictureComparison& out) {
  Comparing work{reference, test, Differences(out.pixels), {}, {}};
  for_each_band(executor, reference.height(), [&](RowBand band, int) {
    for (int y = band.first; y < band.last; ++y) {
      for (int x = 0; x < reference.width(); x += piece_px) compare_piece(work, x, y);
    }
  });
  out.not_finite =
      static_cast<std::uint64_t>(std::ranges::count_if(work.differences.ab, [](float d) { return !std::isfinite(d); }));
  out.delta_e_ab = summary_of_finite(work.differences.ab);
  out.delta_e_94c = summary_of_finite(work.differences.of_94c);
  out.ciede2000 = summary_of_finite(work.differences.of_2000);
  out.gamut = gamut_ratio(work.reference_bins, work.test_bins);
  out.reference_beyond = work.reference_bins.beyond();
  out.test_beyond = work.test_bins.beyond();
}

void compare_codes(const SceneLinear& reference, const SceneLinear& test, Executor& executor, PictureComparison& out) {
  const DisplayCodes first = display_codes(reference, executor), second = display_codes(test, executor);
  out.reference_outside = first.outside;
  out.test_outside = second.outside;
  out.psnr_db = codes_psnr_db(second.srgb, first.srgb, executor);
  const Plane<float> first_luma = luma_of(first.srgb), second_luma = luma_of(second.srgb);
  out.ssim = ssim(first_luma.view(), second_luma.view(), executor);
}

}  // namespace

std::optional<double> ssim(const PlaneView<const float>& first, const PlaneView<const float>& second,
                           Executor& executor) {
  assert(first.width == second.width && first.height == second.height);
  const int across = first.width - ssim_window_px + 1, down = first.height - ssim_window_px + 1;
  if (across < 1 || down < 1) return std::nullopt;
  const Planes planes{first, second, gaussian()};
  // The memory is allocated before the threads start, because they cannot report an allocation failure.
  std::vector<std::vector<Moments>> columns(static_cast<std::size_t>(executor.width()),
                                            std::vector<Moments>(static_cast<std::size_t>(first.width)));
  std::vector<double> rows(static_cast<std::size_t>(down));
  for_each_band(executor, down, [&](RowBand band, int index) {
    for (int y = band.first; y < band.last; ++y) {
      rows[static_cast<std::size_t>(y)] = row_sum(planes, y, columns[static_cast<std::size_t>(index)]);
    }
  });
  return std::accumulate(rows.begin(), rows.end(), 0.0) / (static_cast<double>(across) * down);
}

double mean_delta_e_94c(std::span<const Lab> reference, std::span<const Lab> test) {
  assert(reference.size() == test.size());
  double sum = 0;
  std::size_t counted = 0;
  for (std::size_t i = 0; i < reference.size(); ++i) {
    if (!is_finite(reference[i]) || !is_finite(test[i])) continue;
    sum += delta_e_94c(reference[i], test[i]);
    ++counted;
  }
  return counted == 0 ? nan : sum / static_cast<double>(counted);
}

DifferenceSummary summary_of(std::span<float> differences) {
  if (differences.empty()) return {nan, nan, nan, nan};
  const std::size_t n = differences.size();
  const double sum = std::accumulate(differences.begin(), differences.end(), 0.0);
  const auto at_rank = [&](std::size_t rank) {  // the rank-th smallest, counted from 1
    const auto place = differences.begin() + static_cast<std::ptrdiff_t>(rank - 1);
    std::nth_element(differences.begin(), place, differences.end());
    return static_cast<double>(*place);
  };
  return {.mean = sum / static_cast<double>(n),
          .median = at_rank((n + 1) / 2),
          .percentile_95 = at_rank(n - n / 20),
          .largest = at_rank(n)};
}

PictureComparison compare_pictures(const SceneLinear& reference_xyz, const SceneLinear& test_xyz, Executor& executor) {
  assert(reference_xyz.width() == test_xyz.width() && reference_xyz.height() == test_xyz.height());
  assert(reference_xyz.plane[0].size() > 0);
  PictureComparison out;
  out.pixels = reference_xyz.plane[0].size();
  compare_colours(reference_xyz, test_xyz, executor, out);
  compare_codes(reference_xyz, test_xyz, executor, out);
  return out;
}

}  // namespace lowlux::isp
