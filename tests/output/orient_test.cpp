#include "isp/output/picture/orient.h"

#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "tests/codec/pictures.h"

namespace lowlux::isp {
namespace {

constexpr int width = 3, height = 2;

struct Turn {
  Orientation orientation;
  std::vector<std::vector<int>> rows;  // of the numbers 1 2 3 / 4 5 6
};

/// By the meaning of EXIF 2.32 table 6, "the 0th row is the visual ..., the 0th column the visual ...".
const std::array<Turn, 8>& turns() {
  static const std::array<Turn, 8> table{{{Orientation::normal, {{1, 2, 3}, {4, 5, 6}}},
                                          {Orientation::mirror_horizontal, {{3, 2, 1}, {6, 5, 4}}},
                                          {Orientation::rotate_180, {{6, 5, 4}, {3, 2, 1}}},
                                          {Orientation::mirror_vertical, {{4, 5, 6}, {1, 2, 3}}},
                                          {Orientation::transpose, {{1, 4}, {2, 5}, {3, 6}}},
                                          {Orientation::rotate_90, {{4, 1}, {5, 2}, {6, 3}}},
                                          {Orientation::transverse, {{6, 3}, {5, 2}, {4, 1}}},
                                          {Orientation::rotate_270, {{3, 6}, {2, 5}, {1, 4}}}}};
  return table;
}

Picture upright(Picture picture, Orientation orientation, int threads = 2) {
  PoolExecutor executor(threads);
  return oriented(std::move(picture), orientation, executor);
}

template <class Code>
Picture numbered_codes() {
  Encoded<Code> picture{Plane<Code>(3 * width, height)};
  for (int i = 0; i < 3 * width * height; ++i) picture.codes.data()[i] = static_cast<Code>(10 * (1 + i / 3) + i % 3);
  return picture;
}

Picture numbered_linear() {
  SceneLinear picture(width, height);
  for (int c = 0; c < 3; ++c) {
    for (int i = 0; i < width * height; ++i) picture.plane[c].data()[i] = static_cast<float>(10 * (1 + i) + c);
  }
  return picture;
}

template <class Code>
int sample(const Encoded<Code>& picture, int x, int y, int c) {
  return picture.codes.at(3 * x + c, y);
}
int sample(const SceneLinear& picture, int x, int y, int c) { return static_cast<int>(picture.plane[c].at(x, y)); }

TEST(Oriented, FollowsTheTableForEverySampleType) {
  for (const Turn& turn : turns()) {
    for (const auto& make : {numbered_codes<std::uint8_t>, numbered_codes<std::uint16_t>, numbered_linear}) {
      const Picture turned = upright(make(), turn.orientation);
      std::visit(
          [&](const auto& image) {
            ASSERT_EQ(image.height(), static_cast<int>(turn.rows.size()));
            ASSERT_EQ(image.width(), static_cast<int>(turn.rows[0].size()));
            for (int y = 0; y < image.height(); ++y) {
              for (int x = 0; x < image.width(); ++x) {
                for (int c = 0; c < 3; ++c) {
                  EXPECT_EQ(sample(image, x, y, c), 10 * turn.rows[y][x] + c)
                      << "orientation " << static_cast<int>(turn.orientation) << " at " << x << ", " << y;
                }
              }
            }
          },
          turned);
    }
  }
}

TEST(Oriented, NormalKeepsTheMemoryItWasGiven) {
  Encoded8 picture = test::noisy_codes<std::uint8_t>(50, 40);
  const auto* before = picture.codes.data();
  const Picture same = upright(std::move(picture), Orientation::normal);
  EXPECT_EQ(std::get<Encoded8>(same).codes.data(), before);
}

/// Four quarter turns, two half turns, two mirrors and the two pairs of transposes lead back, across block borders.
TEST(Oriented, TurnsThatUndoEachOtherLeadBackToThePicture) {
  const std::vector<std::vector<Orientation>> loops{
      {Orientation::rotate_90, Orientation::rotate_90, Orientation::rotate_90, Orientation::rotate_90},
      {Orientation::rotate_90, Orientation::rotate_270},
      {Orientation::rotate_180, Orientation::rotate_180},
      {Orientation::mirror_horizontal, Orientation::mirror_horizontal},
      {Orientation::mirror_vertical, Orientation::rotate_180, Orientation::mirror_horizontal},
      {Orientation::transpose, Orientation::transpose},
      {Orientation::transverse, Orientation::transverse},
      {Orientation::transverse, Orientation::rotate_180, Orientation::transpose}};
  for (const auto& loop : loops) {
    Picture codes = test::noisy_codes<std::uint16_t>(201, 133);
    Picture linear = test::noisy_linear(133, 201);
    for (const Orientation step : loop) {
      codes = upright(std::move(codes), step);
      linear = upright(std::move(linear), step);
    }
    EXPECT_TRUE(test::same_bits(std::get<Encoded16>(codes), test::noisy_codes<std::uint16_t>(201, 133)));
    EXPECT_TRUE(test::same_bits(std::get<SceneLinear>(linear), test::noisy_linear(133, 201)));
  }
}

TEST(Oriented, IsTheSameForAnyNumberOfThreads) {
  for (const Turn& turn : turns()) {
    const Picture one = upright(test::noisy_codes<std::uint16_t>(201, 133), turn.orientation, 1);
    for (const int threads : {2, 3, 7}) {
      const Picture many = upright(test::noisy_codes<std::uint16_t>(201, 133), turn.orientation, threads);
      EXPECT_TRUE(test::same_bits(std::get<Encoded16>(one), std::get<Encoded16>(many)));
    }
  }
}

}  // namespace
}  // namespace lowlux::isp
