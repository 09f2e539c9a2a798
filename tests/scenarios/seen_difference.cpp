#include "tests/scenarios/seen_difference.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <utility>
#include <vector>

#include "isp/model/colour/colorimetry.h"
#include "isp/model/colour/colour_difference.h"
#include "isp/pipeline/budget/visible_noise.h"
#include "isp/render/output_space.h"

namespace lowlux::isp {
namespace {

/// Sums of columns over the rows of a square, for one row of squares.
class ColumnSums {
 public:
  ColumnSums(const RgbView<const float>& picture, int top) : picture_(picture), top_(top) {
    for (auto& plane : sum_) plane.resize(static_cast<std::size_t>(picture[0].width));
    for (int y = top; y < top + visible_box_px; ++y) add(y, 1);
  }
  void move_to(int top) {
    for (; top_ < top; ++top_) {
      add(top_ + visible_box_px, 1);
      add(top_, -1);
    }
  }
  /// Lab of the squares of this row, left to right.
  void labs(const Matrix3& to_xyz, const Xyz& white, std::vector<Lab>& out) const {
    Vector3 box{};
    constexpr double pixels = visible_box_px * visible_box_px;
    for (int x = 0; x < picture_[0].width; ++x) {
      for (std::size_t c = 0; c < 3; ++c) {
        box[c] += sum_[c][static_cast<std::size_t>(x)];
        if (x >= visible_box_px) box[c] -= sum_[c][static_cast<std::size_t>(x) - visible_box_px];
      }
      if (x < visible_box_px - 1) continue;
      const Vector3 mean{box[0] / pixels, box[1] / pixels, box[2] / pixels};
      out[static_cast<std::size_t>(x) - (visible_box_px - 1)] = lab_of(xyz_of(to_xyz * mean), white);
    }
  }

 private:
  void add(int y, double sign) {
    for (std::size_t c = 0; c < 3; ++c) {
      const float* const row = picture_[c].row(y);
      for (std::size_t x = 0; x < sum_[c].size(); ++x) sum_[c][x] += sign * static_cast<double>(row[x]);
    }
  }

  const RgbView<const float>& picture_;
  int top_;
  std::array<std::vector<double>, 3> sum_;
};

struct Work {
  const RgbView<const float>& first;
  const RgbView<const float>& second;
  Plane<float>& difference;
  int row_step;
  int bands;
};

void compare_band(const Work& work, int band) {
  const int rows = work.difference.height(), from = rows * band / work.bands, to = rows * (band + 1) / work.bands;
  if (from == to) return;
  const Matrix3 to_xyz = *inverse(*xyz_to_output(OutputSpace::linear_srgb));
  const Xyz white = *xyz_of(output_white);
  ColumnSums a(work.first, work.row_step * from), b(work.second, work.row_step * from);
  std::vector<Lab> lab_a(static_cast<std::size_t>(work.difference.width())), lab_b(lab_a.size());
  for (int y = from; y < to; ++y) {
    a.move_to(work.row_step * y);
    b.move_to(work.row_step * y);
    a.labs(to_xyz, white, lab_a);
    b.labs(to_xyz, white, lab_b);
    float* const out = work.difference.row(y);
    for (std::size_t x = 0; x < lab_a.size(); ++x) out[x] = static_cast<float>(ciede2000(lab_a[x], lab_b[x]));
  }
}

SeenDifference statistics_of(std::vector<float> values) {
  SeenDifference out;
  for (const float d : values) out.mean += static_cast<double>(d) / static_cast<double>(values.size());
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(seen_fraction * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  out.percentile95 = static_cast<double>(*at);
  out.largest = static_cast<double>(*std::max_element(at, values.end()));
  return out;
}

Lab lab_of_part(const RgbView<const float>& light, const Rect& part, const Matrix3& to_xyz, const Xyz& white) {
  Vector3 mean{};
  for (std::size_t c = 0; c < 3; ++c) {
    for (int y = part.y; y < part.y + part.height; ++y) {
      for (int x = part.x; x < part.x + part.width; ++x) mean[c] += static_cast<double>(light[c].at(x, y));
    }
    mean[c] /= part.width * part.height;
  }
  return lab_of(xyz_of(to_xyz * mean), white);
}

}  // namespace

SeenDifference line_difference(const RgbView<const float>& first, const RgbView<const float>& second) {
  constexpr int length = 256;
  const Matrix3 to_xyz = *inverse(*xyz_to_output(OutputSpace::linear_srgb));
  const Xyz white = *xyz_of(output_white);
  const int width = first[0].width, height = first[0].height;
  std::vector<float> differences;
  const auto add = [&](const Rect& segment) {
    const Lab a = lab_of_part(first, segment, to_xyz, white), b = lab_of_part(second, segment, to_xyz, white);
    differences.push_back(static_cast<float>(ciede2000(a, b)));
  };
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x + length <= width; x += length) add({x, y, length, 1});
  }
  for (int x = 0; x < width; ++x) {
    for (int y = 0; y + length <= height; y += length) add({x, y, 1, length});
  }
  assert(!differences.empty());
  return statistics_of(std::move(differences));
}

PixelDifference::PixelDifference(const RgbView<const float>& first, const RgbView<const float>& second)
    : first_(first),
      second_(second),
      to_xyz_(*inverse(*xyz_to_output(OutputSpace::linear_srgb))),
      white_(*xyz_of(output_white)) {}

double PixelDifference::at(int x, int y) const {
  const Rect pixel{x, y, 1, 1};
  return ciede2000(lab_of_part(first_, pixel, to_xyz_, white_), lab_of_part(second_, pixel, to_xyz_, white_));
}

double PixelDifference::around(int x, int y) const {
  constexpr int reach = 8, core = 2;
  double largest = 0;
  for (int j = std::max(y - reach, 0); j <= std::min(y + reach, first_[0].height - 1); ++j) {
    for (int i = std::max(x - reach, 0); i <= std::min(x + reach, first_[0].width - 1); ++i) {
      if (std::max(std::abs(i - x), std::abs(j - y)) <= core) continue;
      largest = std::max(largest, at(i, j));
    }
  }
  return largest;
}

SeenDifference seen_difference(const RgbView<const float>& first, const RgbView<const float>& second,
                               Executor& executor, int row_step) {
  assert(first[0].width == second[0].width && first[0].height == second[0].height);
  assert(first[0].width >= visible_box_px && first[0].height >= visible_box_px);
  Plane<float> difference(first[0].width - visible_box_px + 1, (first[0].height - visible_box_px) / row_step + 1);
  const Work work{first, second, difference, row_step, executor.width()};
  for_each_index(executor, work.bands, [&](int band) { compare_band(work, band); });
  return statistics_of({difference.data(), difference.data() + difference.size()});
}

SceneLinear light_of_codes(const Encoded8& codes) {
  std::array<float, 256> light{};
  for (std::size_t i = 0; i < light.size(); ++i) {
    light[i] = static_cast<float>(decode_transfer(OutputSpace::srgb, static_cast<double>(i) / 255));
  }
  SceneLinear out(codes.width(), codes.height());
  for (int y = 0; y < codes.height(); ++y) {
    const std::uint8_t* const row = codes.codes.row(y);
    for (int x = 0; x < codes.width(); ++x) {
      for (int c = 0; c < 3; ++c) out.plane[c].at(x, y) = light[row[3 * x + c]];
    }
  }
  return out;
}

SeenDifference seen_difference(const Encoded8& first, const Encoded8& second, Executor& executor) {
  const SceneLinear a = light_of_codes(first), b = light_of_codes(second);
  return seen_difference(a.view(), b.view(), executor);
}

}  // namespace lowlux::isp
