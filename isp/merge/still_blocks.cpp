#include "isp/merge/still_blocks.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace lowlux::merge {
namespace {

constexpr double variance_of_t = 3;
constexpr double limit = 5;  // standard deviations
constexpr std::uint8_t open = 0, moves = 1, still = 2;

/// Holds three mosaics of one scene.
struct Mosaics {
  PlaneView<const float> reference, aligned, unmoved;
};

struct Area {
  int x, y, width, height;
};

/// Calls `use` with the three values of each site of a parity where all have one.
template <class Use>
void for_each_site(const Mosaics& of, const Area& area, int parity, const Use& use) {
  for (int y = area.y + (parity >> 1); y < area.y + area.height; y += 2) {
    for (int x = area.x + (parity & 1); x < area.x + area.width; x += 2) {
      const float r = of.reference.at(x, y), a = of.aligned.at(x, y), u = of.unmoved.at(x, y);
      if (std::isfinite(r + a + u)) use(r, a, u);
    }
  }
}

/// Holds the sum of t over the sites of a square.
struct Found {
  double t = 0;       // factor of detail
  double t_mean = 0;  // factor of the means
  double sites = 0;
};

Found compare(const Mosaics& of, const Area& area, const MosaicNoise& noise) {
  Found out;
  for (int parity = 0; parity < 4; ++parity) {
    std::array<double, 3> mean{};
    double n = 0;
    for_each_site(of, area, parity, [&](float r, float a, float u) {
      mean[0] += r;
      mean[1] += a;
      mean[2] += u;
      ++n;
    });
    if (n < 2) continue;
    for (double& value : mean) value /= n;
    const double level = std::max((mean[0] + mean[1] + mean[2]) / 3, 0.0);
    double t = 0;
    for_each_site(of, area, parity, [&](float r, float a, float u) {
      const double reference = r - mean[0], aligned = a - mean[1] - reference, unmoved = u - mean[2] - reference;
      const double own = std::max((static_cast<double>(r) + a + u) / 3, level);
      t += (aligned * aligned - unmoved * unmoved) / (2 * noise.fraction * (own + noise.variance_e2[parity]));
    });
    out.t += t;
    const double aligned = mean[1] - mean[0], unmoved = mean[2] - mean[0];
    out.t_mean +=
        n * (aligned * aligned - unmoved * unmoved) / (2 * noise.fraction * (level + noise.variance_e2[parity]));
    out.sites += n - 1;
  }
  return out;
}

double median(std::vector<float> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  if (values.size() % 2 == 1) return *middle;
  return (static_cast<double>(*middle) + *std::max_element(values.begin(), middle)) / 2;
}

}  // namespace

StillBlocks::StillBlocks(int width, int height)
    : width_(width),
      height_(height),
      columns_((width + side_px - 1) / side_px),
      rows_((height + side_px - 1) / side_px),
      squares_(static_cast<std::size_t>(columns_) * rows_) {}

void StillBlocks::add(PlaneView<const float> reference, PlaneView<const float> aligned, PlaneView<const float> unmoved,
                      const MosaicNoise& noise, Executor& executor) {
  assert(reference.width == width_ && reference.height == height_);
  ++frames_;
  for_each_index(executor, rows_, [&](int row) {
    for (int column = 0; column < columns_; ++column) {
      const int x = side_px * column, y = side_px * row;
      const Found found = compare({reference, aligned, unmoved},
                                  {x, y, std::min(side_px, width_ - x), std::min(side_px, height_ - y)}, noise);
      Sums& sums = squares_[static_cast<std::size_t>(row) * columns_ + column];
      sums.t.push_back(static_cast<float>(found.t));
      sums.with_mean.push_back(static_cast<float>(found.t + found.t_mean));
      sums.sites += (static_cast<float>(found.sites) - sums.sites) / static_cast<float>(frames_);
    }
  });
}

std::vector<StillBlocks::Sums> StillBlocks::halved(const std::vector<Sums>& of, int columns, int rows) {
  const int half_columns = (columns + 1) / 2, half_rows = (rows + 1) / 2;
  std::vector<Sums> out(static_cast<std::size_t>(half_columns) * half_rows);
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      const Sums& from = of[static_cast<std::size_t>(y) * columns + x];
      Sums& to = out[static_cast<std::size_t>(y / 2) * half_columns + x / 2];
      to.t.resize(from.t.size());
      for (std::size_t i = 0; i < from.t.size(); ++i) to.t[i] += from.t[i];
      to.sites += from.sites;
    }
  }
  return out;
}

void StillBlocks::decide(const std::vector<Sums>& level, int scale, Plane<std::uint8_t>& decided) const {
  // The variance of a median of normal values is at most pi / 2 times that of their mean.
  const double z = limit * std::sqrt(variance_of_t * (frames_ > 2 ? std::numbers::pi / 2 : 1.0) / frames_);
  const int columns = ((columns_ - 1) >> scale) + 1;
  for (int y = 0; y < rows_; ++y) {
    for (int x = 0; x < columns_; ++x) {
      if (decided.at(x, y) != open) continue;
      const Sums& sums = level[static_cast<std::size_t>(y >> scale) * columns + (x >> scale)];
      const double t = median(scale == 0 ? sums.with_mean : sums.t);
      if (std::fabs(t) > z * std::sqrt(static_cast<double>(sums.sites))) decided.at(x, y) = t > 0 ? still : moves;
    }
  }
}

Plane<std::uint8_t> StillBlocks::blocks() const {
  Plane<std::uint8_t> out((width_ + block_px - 1) / block_px, (height_ + block_px - 1) / block_px);
  std::fill_n(out.data(), out.size(), std::uint8_t{0});
  if (frames_ == 0) return out;
  Plane<std::uint8_t> decided(columns_, rows_);
  std::fill_n(decided.data(), decided.size(), open);
  std::vector<Sums> level = squares_;
  decide(level, 0, decided);
  for (int scale = 1; level.size() > 1; ++scale) {
    level = halved(level, ((columns_ - 1) >> (scale - 1)) + 1, ((rows_ - 1) >> (scale - 1)) + 1);
    decide(level, scale, decided);
  }
  for (int y = 0; y < out.height(); ++y) {
    for (int x = 0; x < out.width(); ++x) out.at(x, y) = decided.at(x / 2, y / 2) == still ? 1 : 0;
  }
  return out;
}

}  // namespace lowlux::merge
