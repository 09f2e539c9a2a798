#include "isp/merge/stars/point_grid.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

namespace lowlux::merge {

PointGrid::PointGrid(std::vector<Point> points, double cell_px) : points_(std::move(points)), cell_px_(cell_px) {
  double right = 0, bottom = 0;
  for (std::size_t k = 0; k < points_.size(); ++k) {
    left_ = k == 0 ? points_[k].x : std::min(left_, points_[k].x);
    top_ = k == 0 ? points_[k].y : std::min(top_, points_[k].y);
    right = k == 0 ? points_[k].x : std::max(right, points_[k].x);
    bottom = k == 0 ? points_[k].y : std::max(bottom, points_[k].y);
  }
  cell_px_ = std::max({cell_px, (right - left_) / 1000, (bottom - top_) / 1000});
  columns_ = static_cast<int>((right - left_) / cell_px_) + 1;
  rows_ = static_cast<int>((bottom - top_) / cell_px_) + 1;
  const auto cell_of = [&](const Point& p) {
    return static_cast<std::size_t>((p.y - top_) / cell_px_) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>((p.x - left_) / cell_px_);
  };
  first_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_) + 1, 0);
  for (const Point& p : points_) ++first_[cell_of(p) + 1];
  for (std::size_t k = 1; k < first_.size(); ++k) first_[k] += first_[k - 1];
  std::vector<int> next(first_.begin(), first_.end() - 1);
  order_.resize(points_.size());
  for (std::size_t k = 0; k < points_.size(); ++k)
    order_[static_cast<std::size_t>(next[cell_of(points_[k])]++)] = static_cast<int>(k);
}

template <class Visit>
void PointGrid::visit(const Point& place, double radius_px, const Visit& visit) const {
  const auto cell = [&](double at, int cells) {
    return static_cast<int>(std::clamp(std::floor(at / cell_px_), 0.0, cells - 1.0));
  };
  const int left = cell(place.x - radius_px - left_, columns_), right = cell(place.x + radius_px - left_, columns_);
  const int top = cell(place.y - radius_px - top_, rows_), bottom = cell(place.y + radius_px - top_, rows_);
  for (int row = top; row <= bottom; ++row) {
    const auto begin = static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_);
    const int last = first_[begin + static_cast<std::size_t>(right) + 1];
    for (int k = first_[begin + static_cast<std::size_t>(left)]; k < last; ++k) {
      const int index = order_[static_cast<std::size_t>(k)];
      const Point& p = points_[static_cast<std::size_t>(index)];
      const double square = (p.x - place.x) * (p.x - place.x) + (p.y - place.y) * (p.y - place.y);
      if (square <= radius_px * radius_px) visit(index, square);
    }
  }
}

int PointGrid::nearest(const Point& place, double radius_px) const {
  int best = -1;
  double least = 0;
  visit(place, radius_px, [&](int index, double square) {
    if (best >= 0 && (square > least || (square == least && index > best))) return;
    best = index;
    least = square;
  });
  return best;
}

int PointGrid::count(const Point& place, double radius_px) const {
  int found = 0;
  visit(place, radius_px, [&](int, double) { ++found; });
  return found;
}

}  // namespace lowlux::merge
