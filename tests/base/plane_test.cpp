#include "isp/base/plane.h"

#include <gtest/gtest.h>

#include <utility>

namespace lowlux {
namespace {

TEST(Plane, MovedFromIsEmpty) {
  Plane<int> from(3, 2);
  from.at(2, 1) = 7;
  Plane<int> to(std::move(from));
  EXPECT_EQ(to.at(2, 1), 7);
  EXPECT_TRUE(from.empty());  // NOLINT(bugprone-use-after-move): what a move leaves is what is tested
  EXPECT_EQ(from.data(), nullptr);
  Plane<int> other(5, 5);
  other = std::move(to);
  EXPECT_EQ(other.width(), 3);
  EXPECT_EQ(other.height(), 2);
  EXPECT_EQ(other.at(2, 1), 7);
  EXPECT_EQ(to.size(), 0u);  // NOLINT(bugprone-use-after-move)
}

TEST(Plane, ClonesAreTheirOwn) {
  Plane<int> from(2, 1);
  from.at(0, 0) = 1;
  from.at(1, 0) = 2;
  Plane<int> copy = from.clone();
  copy.at(0, 0) = 5;
  EXPECT_EQ(from.at(0, 0), 1);
  EXPECT_EQ(copy.at(1, 0), 2);
  EXPECT_TRUE(Plane<int>().clone().empty());
}

TEST(PlaneView, CropsAreWindows) {
  Plane<int> plane(4, 3);
  for (int i = 0; i < 12; ++i) plane.data()[i] = i;
  const PlaneView<int> part = plane.view().crop(1, 1, 2, 2);
  EXPECT_EQ(part.at(0, 0), 5);
  EXPECT_EQ(part.at(1, 1), 10);
  EXPECT_EQ(plane.view().crop(4, 3, 0, 0).width, 0);
}

}  // namespace
}  // namespace lowlux
