#include "isp/metrics/picture_metrics.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <optional>

#include "isp/model/colour/colour_difference.h"
#include "isp/render/output_space.h"

namespace lowlux::isp {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

const Matrix3& to_xyz() {
  static const Matrix3 matrix = rgb_to_xyz(primaries_rec709).value();  // cannot fail for constants
  return matrix;
}

double display_value(double v) { return v >= 0 ? std::min(v, 1.0) : 0.0; }

/// Sums the results of all rows, in the order of the rows regardless of the bands.
template <class Sums, class OfRow>
Sums sum_of_rows(int height, Executor& executor, const OfRow& of_row) {
  std::vector<Sums> rows(static_cast<std::size_t>(height));
  for_each_band(executor, height, [&](RowBand band, int) {
    for (int y = band.first; y < band.last; ++y) rows[static_cast<std::size_t>(y)] = of_row(y);
  });
  Sums total{};
  for (const Sums& row : rows) {
    for (std::size_t i = 0; i < total.size(); ++i) total[i] += row[i];
  }
  return total;
}

SceneLinear encoded_of(const RgbView<const float>& linear, Executor& executor) {
  SceneLinear out(linear[0].width, linear[0].height);
  for_each_band(executor, out.height(), [&](RowBand band, int) {
    for (std::size_t c = 0; c < 3; ++c) {
      for (int y = band.first; y < band.last; ++y) {
        const float* from = linear[c].row(y);
        std::transform(from, from + out.width(), out.plane[c].row(y),
                       [](float v) { return srgb_code(static_cast<double>(v)); });
      }
    }
  });
  return out;
}

Lab lab_at(const RgbView<const float>& display, int x, int y) {
  static const Xyz white = xyz_of(to_xyz() * Vector3{1, 1, 1});
  const auto value = [&](std::size_t c) { return display_value(static_cast<double>(display[c].at(x, y))); };
  const Vector3 rgb{value(0), value(1), value(2)};
  return lab_of(xyz_of(to_xyz() * rgb), white);
}

Lab lab_in(const SceneLinear& lab, int x, int y) {
  return {lab.plane[0].at(x, y), lab.plane[1].at(x, y), lab.plane[2].at(x, y)};
}

SceneLinear lab_picture(const RgbView<const float>& display, Executor& executor) {
  SceneLinear out(display[0].width, display[0].height);
  for_each_band(executor, out.height(), [&](RowBand band, int) {
    for (int y = band.first; y < band.last; ++y) {
      for (int x = 0; x < out.width(); ++x) {
        const Lab lab = lab_at(display, x, y);
        out.plane[0].at(x, y) = static_cast<float>(lab.l);
        out.plane[1].at(x, y) = static_cast<float>(lab.a);
        out.plane[2].at(x, y) = static_cast<float>(lab.b);
      }
    }
  });
  return out;
}

/// Holds the chroma vector r and W of the header.
struct Chroma {
  double u;
  double v;
  double w;
};

Chroma chroma_of(const Xyz& c) {
  static const UvPrime white = uv_prime_of(white_d65).value();  // cannot fail for a constant
  const double w = c.x + 15 * c.y + 3 * c.z;
  return {4 * c.x - white.u * w, 9 * c.y - white.v * w, w};
}

std::optional<UvPrime> uv_of(const Xyz& c) {
  const double w = c.x + 15 * c.y + 3 * c.z;
  if (!(w > 0) || !std::isfinite(w)) return std::nullopt;
  return UvPrime{4 * c.x / w, 9 * c.y / w};
}

double box_chroma_rmse(const SceneLinear& lab, const SceneLinear& truth) {
  double sum = 0;
  int boxes = 0;
  for (int y0 = 0; y0 + metric_patch_px <= lab.height(); y0 += metric_patch_px) {
    for (int x0 = 0; x0 + metric_patch_px <= lab.width(); x0 += metric_patch_px, ++boxes) {
      for (std::size_t c = 1; c < 3; ++c) {
        double difference = 0;
        for (int y = y0; y < y0 + metric_patch_px; ++y) {
          for (int x = x0; x < x0 + metric_patch_px; ++x) difference += lab.plane[c].at(x, y) - truth.plane[c].at(x, y);
        }
        sum += std::pow(difference / (metric_patch_px * metric_patch_px), 2);
      }
    }
  }
  return std::sqrt(sum / boxes);
}

}  // namespace

PictureTruth::PictureTruth(const RgbView<const float>& linear, Executor& executor)
    : encoded_(encoded_of(linear, executor)), lab_(lab_picture(linear, executor)), patches_(patch_means(linear)) {
  assert(width() >= metric_patch_px && height() >= metric_patch_px);
}

std::vector<Xyz> patch_means(const RgbView<const float>& linear) {
  std::vector<Xyz> out;
  const int across = linear[0].width / metric_patch_px, down = linear[0].height / metric_patch_px;
  out.reserve(static_cast<std::size_t>(across) * static_cast<std::size_t>(down));
  for (int py = 0; py < down; ++py) {
    for (int px = 0; px < across; ++px) {
      Vector3 sum{};
      for (std::size_t c = 0; c < 3; ++c) {
        const auto patch = linear[c].crop(px * metric_patch_px, py * metric_patch_px, metric_patch_px, metric_patch_px);
        for (int y = 0; y < patch.height; ++y) {
          for (int x = 0; x < patch.width; ++x) sum[c] += static_cast<double>(patch.at(x, y));
        }
        sum[c] /= metric_patch_px * metric_patch_px;
      }
      out.push_back(xyz_of(to_xyz() * sum));
    }
  }
  return out;
}

double saturation_ratio(const std::vector<Xyz>& patches, const std::vector<Xyz>& truth) {
  assert(patches.size() == truth.size());
  double chroma = 0, light = 0, true_chroma = 0, true_light = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const Chroma t = chroma_of(truth[i]);
    const double length = std::hypot(t.u, t.v);
    if (!(t.w > 0) || length < coloured_patch_uv * t.w) continue;
    const Chroma r = chroma_of(patches[i]);
    chroma += (r.u * t.u + r.v * t.v) / length;
    light += r.w;
    true_chroma += length;
    true_light += t.w;
  }
  if (!(true_chroma > 0) || !(light > 0)) return nan;
  return (chroma / light) / (true_chroma / true_light);
}

double median_uv_shift(const std::vector<Xyz>& patches, const std::vector<Xyz>& truth) {
  assert(patches.size() == truth.size());
  std::vector<double> shifts;
  shifts.reserve(truth.size());
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const auto expected = uv_of(truth[i]);
    if (!expected) continue;
    const auto got = uv_of(patches[i]);
    shifts.push_back(got ? std::hypot(got->u - expected->u, got->v - expected->v)
                         : std::numeric_limits<double>::infinity());
  }
  if (shifts.empty()) return nan;
  const auto middle = shifts.begin() + static_cast<std::ptrdiff_t>(shifts.size() / 2);
  std::nth_element(shifts.begin(), middle, shifts.end());
  return *middle;
}

float srgb_code(double display) {
  return static_cast<float>(encode_transfer(OutputSpace::srgb, display_value(display)));
}

double codes_psnr_db(const SceneLinear& codes, const SceneLinear& truth, Executor& executor) {
  assert(codes.width() == truth.width() && codes.height() == truth.height());
  const auto sum = sum_of_rows<std::array<double, 1>>(truth.height(), executor, [&](int y) {
    double row = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      for (int x = 0; x < truth.width(); ++x) {
        const double difference = codes.plane[c].at(x, y) - truth.plane[c].at(x, y);
        row += difference * difference;
      }
    }
    return std::array{row};
  });
  return -10 * std::log10(sum[0] / (3.0 * truth.width() * truth.height()));
}

double encoded_psnr_db(const RgbView<const float>& display, const PictureTruth& truth, Executor& executor) {
  return codes_psnr_db(encoded_of(display, executor), truth.encoded(), executor);
}

ColourDifference display_difference(const RgbView<const float>& display, const PictureTruth& truth,
                                    Executor& executor) {
  assert(display[0].width == truth.width() && display[0].height == truth.height());
  std::vector<ColourDifference> rows(static_cast<std::size_t>(truth.height()));
  for_each_band(executor, truth.height(), [&](RowBand band, int) {
    for (int y = band.first; y < band.last; ++y) {
      ColourDifference& row = rows[static_cast<std::size_t>(y)];
      for (int x = 0; x < truth.width(); ++x) {
        const double difference = ciede2000(lab_in(truth.lab(), x, y), lab_at(display, x, y));
        row.mean += difference;
        row.largest = std::max(row.largest, difference);
      }
    }
  });
  ColourDifference out;
  for (const ColourDifference& row : rows) {
    out.mean += row.mean / (1.0 * truth.width() * truth.height());
    out.largest = std::max(out.largest, row.largest);
  }
  return out;
}

ColourDifference difference_of(std::span<const Lab> got, std::span<const Lab> expected) {
  assert(got.size() == expected.size() && !got.empty());
  ColourDifference out;
  for (std::size_t i = 0; i < got.size(); ++i) {
    const double difference = ciede2000(expected[i], got[i]);
    out.mean += difference / static_cast<double>(got.size());
    out.largest = std::max(out.largest, difference);
  }
  return out;
}

PictureError picture_error(const RenderedPicture& picture, const PictureTruth& truth, Executor& executor) {
  assert(picture.display.width() == truth.width() && picture.display.height() == truth.height());
  const SceneLinear lab = lab_picture(picture.display.view(), executor);
  const auto sums = sum_of_rows<std::array<double, 2>>(truth.height(), executor, [&](int y) {
    std::array<double, 2> row{};  // CIEDE2000, squared chroma difference
    for (int x = 0; x < truth.width(); ++x) {
      const Lab got = lab_in(lab, x, y), expected = lab_in(truth.lab(), x, y);
      row[0] += ciede2000(expected, got);
      row[1] += (got.a - expected.a) * (got.a - expected.a) + (got.b - expected.b) * (got.b - expected.b);
    }
    return row;
  });
  const double pixels = 1.0 * truth.width() * truth.height();
  const std::vector<Xyz> patches = patch_means(picture.light.view());
  return {.psnr_db = encoded_psnr_db(picture.display.view(), truth, executor),
          .ciede2000 = sums[0] / pixels,
          .chroma_rmse = std::sqrt(sums[1] / pixels),
          .box_chroma_rmse = box_chroma_rmse(lab, truth.lab()),
          .uv_shift = median_uv_shift(patches, truth.patches()),
          .saturation_ratio = saturation_ratio(patches, truth.patches())};
}

}  // namespace lowlux::isp
