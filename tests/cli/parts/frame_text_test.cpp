#include "isp/cli/shared/report.h"

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

namespace lowlux {
namespace {

TEST(FrameText, ExposuresAndFNumbersAreAsPhotographersWriteThem) {
  const std::vector<std::pair<double, std::string>> times{{1.0 / 60, "1/60 s"}, {0.0005, "1/2000 s"}, {0.25, "1/4 s"},
                                                          {0.3, "0.3 s"},       {1.3, "1.3 s"},       {4.96743, "5 s"},
                                                          {30, "30 s"},         {125.04, "125 s"},    {0, "0 s"}};
  for (const auto& [time, text] : times) EXPECT_EQ(cli::exposure_text(time), text);
  const std::vector<std::pair<double, std::string>> stops{
      {5.59592, "f/5.6"}, {8, "f/8"}, {2.8, "f/2.8"}, {0.95, "f/0.95"}, {22.1, "f/22.1"}};
  for (const auto& [stop, text] : stops) EXPECT_EQ(cli::f_number_text(stop), text);
}

TEST(FrameText, NoiseThatDiffersFromPlaceToPlaceHasARange) {
  NoiseRatio ratio{.block_px = 8, .ratio = Plane<float>(3, 1)};
  ratio.ratio.at(0, 0) = 1;
  ratio.ratio.at(1, 0) = 0.125f;
  ratio.ratio.at(2, 0) = 0.25f;
  EXPECT_EQ(cli::ratio_text(ratio), "0.125 to 1 times this variance in blocks of 8 px, median 0.25");
}

}  // namespace
}  // namespace lowlux
