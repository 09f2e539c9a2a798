#include "tests/reference/motion_ref.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace lowlux::reference {
namespace {

constexpr double noise2 = 16, never = std::numeric_limits<double>::infinity();

double limited(double x, double most) { return std::clamp(x, -most, most); }
double deviation(double share, double n) { return 2 * noise2 * (1 + share) / std::sqrt(n); }
double slope_noise(double share) { return 2 * noise2 * 16 * std::min(1.0, share); }

}  // namespace

double FrameMotion::Cells::cost(int left, int top, int columns, int rows, Displacement by, int step) const {
  const auto inside = [](int at, int by_cells, int size) { return at + by_cells >= 0 && at + by_cells < size; };
  double sum = 0, area = 0, lines = 0;
  int first_row = -1;
  for (int y = top; y < top + rows; ++y) {
    if (!inside(y, by.y, height)) continue;
    if (first_row < 0) first_row = y;
    double columns_inside = 0;
    for (int x = left; x < left + columns; ++x) {
      if (!inside(x, by.x, width)) continue;
      columns_inside += 1;
      if ((y - first_row) % step == 0) sum += std::pow(limited(frame.at(x, y) - mean.at(x + by.x, y + by.y), 64), 2);
    }
    area += columns_inside;
    if ((y - first_row) % step == 0) lines += columns_inside;
  }
  return area > 0 && 2 * area >= columns * rows ? sum / lines : never;
}

FrameMotion::Displacement FrameMotion::of_frame(const Cells& fine, const Cells& coarse) {
  const int reach_x = std::min(8, coarse.width / 2), reach_y = std::min(8, coarse.height / 2);
  Displacement best{};
  const auto of_coarse = [&](Displacement by) { return coarse.cost(0, 0, coarse.width, coarse.height, by, 1); };
  const double still = of_coarse({});
  double least = still;
  for (int y = -reach_y; y <= reach_y; ++y) {
    for (int x = -reach_x; x <= reach_x; ++x) {
      const double cost = of_coarse({x, y});
      if (cost < least || (cost == least && x * x + y * y < best.x * best.x + best.y * best.y)) {
        least = cost;
        best = {x, y};
      }
    }
  }
  if (least > still - 4 * deviation(1, static_cast<double>(coarse.width) * coarse.height)) best = {};
  best = {4 * best.x, 4 * best.y};
  const int step = fine.height >= 64 ? 4 : 1;
  const auto of_fine = [&](Displacement by) { return fine.cost(0, 0, fine.width, fine.height, by, step); };
  for (const int stride : {2, 1}) {
    Displacement next = best;
    for (int i = 0; i < 9; ++i) {
      const Displacement by{best.x + stride * (i % 3 - 1), best.y + stride * (i / 3 - 1)};
      if (of_fine(by) < of_fine(next)) next = by;
    }
    best = next;
  }
  const double cells = static_cast<double>(fine.width) * fine.height / step;
  return of_fine({}) - of_fine(best) > 4 * deviation(1, cells) ? best : Displacement{};
}

FrameMotion::Displacement FrameMotion::of_tile(const Cells& fine, int x, int y, Displacement of_frame,
                                               double share) const {
  const int columns = std::min(16, fine.width - 16 * x), rows = std::min(16, fine.height - 16 * y);
  if (columns <= 0 || rows <= 0) return {};
  const double margin = 2 * deviation(share, columns * rows);
  Displacement best{};
  double least = never;
  const auto attempt = [&](Displacement by, double less) {
    const double cost = fine.cost(16 * x, 16 * y, columns, rows, by, 1);
    if (!(cost < least - less)) return;
    least = cost;
    best = by;
  };
  attempt(of_frame, 0);
  attempt({}, margin);
  attempt(of_tile_.empty() ? Displacement{} : of_tile_.at(x, y), margin);
  for (int i = 0; i < 2 && least > noise2 * (1 + share); ++i) {
    const Displacement from = best;
    for (int k = 0; k < 9; ++k) attempt({from.x + k % 3 - 1, from.y + k / 3 - 1}, best == from ? margin : 0);
    if (best == from) break;
  }
  return best;
}

FrameMotion::Displacement FrameMotion::of_block(const Cells& fine, int x, int y, double share) const {
  const int columns = std::min(4, fine.width - 4 * x), rows = std::min(4, fine.height - 4 * y);
  const Displacement of_tile = of_tile_.at(x / 4, y / 4);
  if (columns <= 0 || rows <= 0) return of_tile;
  const auto cost = [&](Displacement by) { return fine.cost(4 * x, 4 * y, columns, rows, by, 1); };
  Displacement best = of_tile;
  double least = cost(of_tile) - 2 * deviation(std::min(1.0, share), columns * rows);
  for (int v = std::max(y / 4 - 1, 0); v <= std::min(y / 4 + 1, of_tile_.height() - 1); ++v) {
    for (int u = std::max(x / 4 - 1, 0); u <= std::min(x / 4 + 1, of_tile_.width() - 1); ++u) {
      if (of_tile_.at(u, v) == of_tile || !(cost(of_tile_.at(u, v)) < least)) continue;
      best = of_tile_.at(u, v);
      least = cost(best);
    }
  }
  return best;
}

FrameMotion::Slopes FrameMotion::slopes_of(const Cells& fine, int x, int y, Displacement by) {
  Slopes out;
  const int left = 4 * x + by.x, top = 4 * y + by.y;
  out.known = 4 * x + 4 <= fine.width && 4 * y + 4 <= fine.height && left >= 1 && top >= 1 && left + 4 < fine.width &&
              top + 4 < fine.height;
  for (int v = 0; out.known && v < 4; ++v) {
    for (int u = 0; u < 4; ++u) {
      const auto mean = [&](int dx, int dy) { return fine.mean.at(left + u + dx, top + v + dy); };
      const double gx = limited(mean(1, 0) - mean(-1, 0), 2047), gy = limited(mean(0, 1) - mean(0, -1), 2047);
      const double d = limited(fine.frame.at(4 * x + u, 4 * y + v) - mean(0, 0), 2047);
      out.xx += gx * gx, out.xy += gx * gy, out.yy += gy * gy, out.xd += gx * d, out.yd += gy * d;
    }
  }
  return out;
}

void FrameMotion::find(int width, int height, const std::function<double(int, int)>& frame_e,
                       const std::function<double(int, int)>& mean_e, double offset_e2, Plane<double>& share) {
  Cells fine{width / 2, height / 2, Plane<double>(width / 2, height / 2), Plane<double>(width / 2, height / 2)};
  const auto stabilised = [&](const std::function<double(int, int)>& e, int x, int y) {
    const double sum = e(2 * x, 2 * y) + e(2 * x + 1, 2 * y) + e(2 * x, 2 * y + 1) + e(2 * x + 1, 2 * y + 1);
    return std::nearbyint(std::min(8 * std::sqrt(std::max(sum + offset_e2, 0.0)), 8191.0));
  };
  for (int y = 0; y < fine.height; ++y) {
    for (int x = 0; x < fine.width; ++x) {
      fine.frame.at(x, y) = stabilised(frame_e, x, y);
      fine.mean.at(x, y) = stabilised(mean_e, x, y);
    }
  }
  Cells coarse{fine.width / 4, fine.height / 4, Plane<double>(fine.width / 4, fine.height / 4),
               Plane<double>(fine.width / 4, fine.height / 4)};
  for (int y = 0; y < coarse.height; ++y) {
    for (int x = 0; x < coarse.width; ++x) {
      double frame = 0, mean = 0;
      for (int i = 0; i < 16; ++i) {
        frame += fine.frame.at(4 * x + i % 4, 4 * y + i / 4);
        mean += fine.mean.at(4 * x + i % 4, 4 * y + i / 4);
      }
      coarse.frame.at(x, y) = std::floor(frame / 4);
      coarse.mean.at(x, y) = std::floor(mean / 4);
    }
  }
  const Displacement of_all = of_frame(fine, coarse);
  Plane<Displacement> tiles((width + 31) / 32, (height + 31) / 32);
  const auto each_block = [&](int tile_x, int tile_y, const auto& work) {
    for (int y = 4 * tile_y; y < std::min(4 * tile_y + 4, share.height()); ++y) {
      for (int x = 4 * tile_x; x < std::min(4 * tile_x + 4, share.width()); ++x) work(x, y);
    }
  };
  double displaced = 0, mismatch = 0;
  for (int y = 0; y < tiles.height(); ++y) {
    for (int x = 0; x < tiles.width(); ++x) {
      double sum = 0, count = 0;
      each_block(x, y, [&](int u, int v) { sum += std::min(1.0, share.at(u, v)), count += 1; });
      tiles.at(x, y) = of_tile(fine, x, y, of_all, sum / count);
      displaced += tiles.at(x, y) == Displacement{} ? 0 : 1;
    }
  }
  of_tile_ = std::move(tiles);
  of_block_ = Plane<Displacement>(share.width(), share.height());
  Plane<double> moved(share.width(), share.height());
  for (int y = 0; y < share.height(); ++y) {
    for (int x = 0; x < share.width(); ++x) {
      const Displacement by = of_block_.at(x, y) = of_block(fine, x, y, share.at(x, y));
      double sum = 0, count = 0;
      for (int v = 8 * y; v < std::min(8 * y + 8, height); ++v) {
        for (int u = 8 * x; u < std::min(8 * x + 8, width); ++u) {
          const int from_x = u + 2 * by.x, from_y = v + 2 * by.y;
          const bool inside = from_x >= 0 && from_y >= 0 && from_x < width && from_y < height;
          sum += inside ? share.at(from_x / 8, from_y / 8) : never;
          count += 1;
        }
      }
      moved.at(x, y) = std::min(sum / count, 1e6);
    }
  }
  struct Residual {
    double x, y;
  };
  Plane<Residual> residual(of_tile_.width(), of_tile_.height());
  for (int y = 0; y < residual.height(); ++y) {
    for (int x = 0; x < residual.width(); ++x) {
      double xx = noise2, xy = 0, yy = noise2, xd = 0, yd = 0;
      each_block(x, y, [&](int u, int v) {
        const Slopes of = slopes_of(fine, u, v, of_block_.at(u, v));
        if (!of.known || of_block_.at(u, v) != of_tile_.at(x, y)) return;
        const double noise = slope_noise(moved.at(u, v));
        xx += of.xx - noise, xy += of.xy, yy += of.yy - noise, xd += of.xd, yd += of.yd;
      });
      xx = std::max(xx, noise2), yy = std::max(yy, noise2);
      const double determinant = std::max(xx * yy - xy * xy, 0.05 * xx * yy);
      residual.at(x, y) = {limited(2 * (yy * xd - xy * yd) / determinant, 0.5),
                           limited(2 * (xx * yd - xy * xd) / determinant, 0.5)};
    }
  }
  for (int y = 0; y < share.height(); ++y) {
    for (int x = 0; x < share.width(); ++x) {
      share.at(x, y) = moved.at(x, y);
      const Displacement by = of_block_.at(x, y);
      const Slopes of = slopes_of(fine, x, y, by);
      if (!of.known) continue;
      Residual r = residual.at(x / 4, y / 4);
      for (int v = std::max(y / 4 - 1, 0); v <= std::min(y / 4 + 1, residual.height() - 1); ++v) {
        for (int u = std::max(x / 4 - 1, 0); u <= std::min(x / 4 + 1, residual.width() - 1); ++u) {
          if (by != of_tile_.at(x / 4, y / 4) && of_tile_.at(u, v) == by) r = residual.at(u, v);
        }
      }
      const double noise = slope_noise(moved.at(x, y));
      const double expected = (r.x * r.x * std::max(of.xx - noise, 0.0) + r.y * r.y * std::max(of.yy - noise, 0.0) +
                               2 * r.x * r.y * of.xy) /
                              4;
      const double seen = (r.x * of.xd + r.y * of.yd) / 2;
      const double added = 1.5 * std::clamp(seen, 0.0, std::max(expected, 0.0)) / (4 * 16 * noise2);
      share.at(x, y) = std::min(moved.at(x, y) + added, 1e6);
      mismatch += std::min(added, 1.0);
    }
  }
  found_ = displaced > static_cast<double>(of_tile_.size()) / 32 || mismatch > 0.01 * static_cast<double>(share.size());
}

}  // namespace lowlux::reference
