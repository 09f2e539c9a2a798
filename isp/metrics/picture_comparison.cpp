#include "isp/metrics/picture_comparison.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <numeric>

#include "isp/metrics/picture_metrics.h"
#include "isp/metrics/ssim.h"
#include "isp/model/colour/colour_difference.h"
#include "isp/render/output_space.h"

namespace lowlux::isp {
namespace {

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

std::vector<Lab> lab_of_picture(const SceneLinear& xyz) {
  std::vector<Lab> out;
  out.reserve(xyz.plane[0].size());
  for (int y = 0; y < xyz.height(); ++y) {
    for (int x = 0; x < xyz.width(); ++x) out.push_back(lab_at(xyz, x, y));
  }
  return out;
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
