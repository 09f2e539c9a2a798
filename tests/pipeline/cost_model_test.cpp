#include "isp/pipeline/budget/cost_model.h"

#include <gtest/gtest.h>

#include <cstddef>

namespace lowlux::isp {
namespace {

TEST(CostModel, IsLinearInTheSizeAndKeepsTheEndsSpeed) {
  CostModel model;
  const auto codes_s = [&](double megapixels) { return model.seconds(CostPart::codes, {megapixels, 1000}); };
  model.points[static_cast<std::size_t>(CostPart::codes)] = {{1, 0.01}, {100, 3}};  // 10 and 30 ms/MP
  EXPECT_DOUBLE_EQ(codes_s(1), 0.01);
  EXPECT_DOUBLE_EQ(codes_s(100), 3);
  EXPECT_NEAR(codes_s(50.5), 1.505, 1e-12);  // half way
  EXPECT_DOUBLE_EQ(codes_s(0.5), 0.005);
  EXPECT_DOUBLE_EQ(codes_s(200), 6);
  EXPECT_EQ(model.seconds(CostPart::look, {5, 5}), 0) << "what was not measured is free";
  EXPECT_DOUBLE_EQ(predicted_s(model, {100, 1000}, {{CostPart::codes, 0.5}, {CostPart::look}}), 1.5);
  model.pace = 2;
  EXPECT_DOUBLE_EQ(codes_s(0.5), 0.01);
  EXPECT_NEAR(codes_s(50.5), 3.01, 1e-12);
  EXPECT_DOUBLE_EQ(codes_s(200), 12);
}

// 64 cells are the unit of five levels: 672 x 448 pixels become 768 x 512.
TEST(CostModel, DenoisingCountsAppendedPixels) {
  EXPECT_DOUBLE_EQ(cost_size(672, 448).megapixels, 0.301056);
  EXPECT_DOUBLE_EQ(cost_size(672, 448).denoised_megapixels, 0.393216);
  EXPECT_DOUBLE_EQ(cost_size(1728, 1152).denoised_megapixels, 4e-6 * 896 * 576);
  EXPECT_DOUBLE_EQ(cost_size(1, 1).denoised_megapixels, 4e-6 * 8 * 8);
  CostModel model;
  model.points[static_cast<std::size_t>(CostPart::high_1)] = {{1, 0.01}};
  EXPECT_DOUBLE_EQ(model.seconds(CostPart::high_1, {1, 1.5}), 0.015);
}

// 6240 x 4160 pixels go in pieces: cores of 2048 px, 256 px around each where there is as much.
TEST(CostModel, TilesCountTheirMargins) {
  RawDn raw;
  raw.active = {0, 0, 4000, 3000};
  raw.default_crop = {8, 8, 3984, 2984};
  const CostSize whole = cost_size(raw);
  EXPECT_DOUBLE_EQ(whole.megapixels, 12);
  EXPECT_DOUBLE_EQ(whole.denoised_megapixels, cost_size(4000, 3000).denoised_megapixels);
  raw.active = raw.default_crop = {0, 0, 6240, 4160};
  const CostSize pieces = cost_size(raw);
  EXPECT_DOUBLE_EQ(pieces.megapixels, 1e-6 * 6240 * 4160);
  EXPECT_GT(pieces.denoised_megapixels, 1.4 * cost_size(6240, 4160).denoised_megapixels);
  EXPECT_LT(pieces.denoised_megapixels, 1.7 * cost_size(6240, 4160).denoised_megapixels);
}

}  // namespace
}  // namespace lowlux::isp
