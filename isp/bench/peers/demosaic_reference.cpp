#include "isp/bench/peers/demosaic_reference.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <utility>

namespace lowlux::isp {
namespace {

/// Weights [row][column] of the 5 x 5 sites around one.
using Filter = std::array<std::array<double, 5>, 5>;

/// Filters by the position of the wanted colour: in all four direct neighbours, left and right, or in the four corners.
struct Filters {
  Filter cross;
  Filter row;
  Filter corners;
};

constexpr Filters malvar{{{{0, 0, -0.125, 0, 0},
                           {0, 0, 0.25, 0, 0},
                           {-0.125, 0.25, 0.5, 0.25, -0.125},
                           {0, 0, 0.25, 0, 0},
                           {0, 0, -0.125, 0, 0}}},
                         {{{0, 0, 0.0625, 0, 0},
                           {0, -0.125, 0, -0.125, 0},
                           {-0.125, 0.5, 0.625, 0.5, -0.125},
                           {0, -0.125, 0, -0.125, 0},
                           {0, 0, 0.0625, 0, 0}}},
                         {{{0, 0, -0.1875, 0, 0},
                           {0, 0.25, 0, 0.25, 0},
                           {-0.1875, 0, 0.75, 0, -0.1875},
                           {0, 0.25, 0, 0.25, 0},
                           {0, 0, -0.1875, 0, 0}}}};

constexpr Filters bilinear{
    {{{0, 0, 0, 0, 0}, {0, 0, 0.25, 0, 0}, {0, 0.25, 0, 0.25, 0}, {0, 0, 0.25, 0, 0}, {0, 0, 0, 0, 0}}},
    {{{0, 0, 0, 0, 0}, {0, 0, 0, 0, 0}, {0, 0.5, 0, 0.5, 0}, {0, 0, 0, 0, 0}, {0, 0, 0, 0, 0}}},
    {{{0, 0, 0, 0, 0}, {0, 0.25, 0, 0.25, 0}, {0, 0, 0, 0, 0}, {0, 0.25, 0, 0.25, 0}, {0, 0, 0, 0, 0}}}};

constexpr Filter transposed(const Filter& filter) {
  Filter out{};
  for (std::size_t y = 0; y < 5; ++y) {
    for (std::size_t x = 0; x < 5; ++x) out[y][x] = filter[x][y];
  }
  return out;
}

int mirrored(int i, int count) {
  const int inside = std::abs(i);
  return inside < count ? inside : 2 * (count - 1) - inside;
}

double value_at(const SignedMosaic& in, int x, int y) {
  return static_cast<double>(in.value.at(x, y)) * in.gain[static_cast<std::size_t>(site_of(x, y))];
}

double filtered(const SignedMosaic& in, const Filter& filter, int x, int y) {
  double sum = 0;
  for (std::size_t row = 0; row < 5; ++row) {
    for (std::size_t column = 0; column < 5; ++column) {
      const double weight = filter[row][column];
      if (weight == 0) continue;
      const int at_x = x + static_cast<int>(column) - 2, at_y = y + static_cast<int>(row) - 2;
      sum += weight * value_at(in, mirrored(at_x, in.value.width), mirrored(at_y, in.value.height));
    }
  }
  return sum;
}

void demosaic(const SignedMosaic& in, const Filters& filters, DoublePlanes& out) {
  assert(in.value.width >= 3 && in.value.height >= 3);
  const Filter column = transposed(filters.row);
  for (int y = 0; y < in.value.height; ++y) {
    const CfaColour other_of_row =
        colour_at(in.phase, 0, y) == CfaColour::green ? colour_at(in.phase, 1, y) : colour_at(in.phase, 0, y);
    for (int x = 0; x < in.value.width; ++x) {
      const CfaColour own = colour_at(in.phase, x, y);
      for (const CfaColour wanted : {CfaColour::red, CfaColour::green, CfaColour::blue}) {
        double& to = out[static_cast<std::size_t>(wanted)].at(x, y);
        if (wanted == own) {
          to = value_at(in, x, y);
        } else if (wanted == CfaColour::green) {
          to = filtered(in, filters.cross, x, y);
        } else if (own == CfaColour::green) {
          to = filtered(in, wanted == other_of_row ? filters.row : column, x, y);
        } else {
          to = filtered(in, filters.corners, x, y);
        }
      }
    }
  }
}

/// Holds the two pixels that a pixel of the large image lies between, and the weight of the second.
struct Between {
  int first;
  int second;
  float share;
};

Between between(int at, int count) {
  const double place = std::clamp((at - 0.5) / 2, 0.0, count - 1.0);
  const int first = std::min(static_cast<int>(place), std::max(count - 2, 0));
  return {first, std::min(first + 1, count - 1), static_cast<float>(place - first)};
}

}  // namespace

void demosaic_malvar(const SignedMosaic& in, DoublePlanes& out) { demosaic(in, malvar, out); }

void demosaic_bilinear(const SignedMosaic& in, DoublePlanes& out) { demosaic(in, bilinear, out); }

SceneLinear enlarged_twice(const RgbView<const float>& half, int width, int height) {
  SceneLinear out(width, height);
  for (int y = 0; y < height; ++y) {
    const Between rows = between(y, half[0].height);
    for (int x = 0; x < width; ++x) {
      const Between columns = between(x, half[0].width);
      for (std::size_t c = 0; c < 3; ++c) {
        const auto along = [&](int row) {
          return std::lerp(half[c].at(columns.first, row), half[c].at(columns.second, row), columns.share);
        };
        out.plane[c].at(x, y) = std::lerp(along(rows.first), along(rows.second), rows.share);
      }
    }
  }
  return out;
}

}  // namespace lowlux::isp
