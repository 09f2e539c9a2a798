#include "isp/raw/measure/exposure_meter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <random>
#include <vector>

namespace lowlux::isp {
namespace {

constexpr int width = 96, height = 64;

struct Frame {
  std::vector<std::uint16_t> dn = std::vector<std::uint16_t>(width * height);

  void meter(ExposureMeter& meter) const {
    meter.clear();
    for (int y = 0; y < height; ++y) meter.add_row(dn.data() + y * width, width, y);
  }
  /// Returns the code that `above` of a site's pixels exceed, by sorting.
  double exceeded(int site, std::size_t above) const {
    std::vector<std::uint16_t> of_site;
    for (int y = site >> 1; y < height; y += 2) {
      for (int x = site & 1; x < width; x += 2) of_site.push_back(dn[static_cast<std::size_t>(y * width + x)]);
    }
    std::ranges::sort(of_site, std::greater());
    return of_site[above];
  }
};

RawFormat format_of(int bits, SensorLayout layout = SensorLayout::bayer) {
  return {bits, RawPacking::little16, layout, BayerPhase::grbg};
}

TEST(ExposureMeter, FindsMedianAndHighlightOfTheChannelsThatHaveMost) {
  const unsigned seed = 11;
  std::printf("seed %u\n", seed);
  std::mt19937 random(seed);
  for (const int bits : {8, 10, 12, 14, 16}) {
    const double largest = (1 << bits) - 1, code = bits > 12 ? 1 << (bits - 12) : 1;
    Frame frame;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        // Site 1 has the largest mean, site 2 the brightest highlights.
        const double mean[] = {0.2, 0.3, 0.1, 0.15};
        const int site = site_of(x, y);
        std::exponential_distribution<double> light(site == 2 ? 5 : 20);
        const double v = largest * std::min(0.9, mean[site] + (site == 2 && x > 80 ? 0.3 : 0.02) * light(random));
        frame.dn[static_cast<std::size_t>(y * width + x)] = static_cast<std::uint16_t>(v);
      }
    }
    ExposureMeter meter(format_of(bits));
    frame.meter(meter);
    const PerSite<double> black{0.05 * largest, 0.06 * largest, 0.07 * largest, 0.08 * largest};
    const MeteredCodes codes = meter.codes({black}, largest, 0.01);
    const int pixels = width * height / 4;
    EXPECT_NEAR(codes.midtone_dn, frame.exceeded(1, pixels / 2) - black[1], code) << bits;
    double highlight = 0, highest = 0;
    for (int site = 0; site < 4; ++site) {
      highlight = std::max(highlight, frame.exceeded(site, pixels / 100) - black[site]);
      highest = std::max<double>(highest, frame.exceeded(site, pixels / 100));
    }
    EXPECT_NEAR(codes.highlight_dn, highlight, code) << bits;
    EXPECT_EQ(codes.clipped_fraction, 0);
    EXPECT_NEAR(codes.range_dn, largest - black[3], 1e-9);
    const MeteredCodes of_bound = meter.codes({black, true}, largest, 0.01);
    EXPECT_EQ(of_bound.midtone_dn, codes.midtone_dn);
    EXPECT_NEAR(of_bound.highlight_dn, highest, code) << bits;
    EXPECT_EQ(of_bound.range_dn, largest);
    for (int site = 0; site < 4; ++site) {
      EXPECT_NEAR(meter.darkest_dn()[site], frame.exceeded(site, pixels * 99 / 100), code) << bits;
    }
  }
}

TEST(ExposureMeter, CountsWhatClipsInTheChannelWithMost) {
  Frame frame;
  std::ranges::fill(frame.dn, std::uint16_t{500});
  for (int y = 1; y < height; y += 2) {
    for (int x = 0; x < 24; x += 2) frame.dn[static_cast<std::size_t>(y * width + x)] = 1023;  // a quarter of site 2
  }
  ExposureMeter meter(format_of(10));
  frame.meter(meter);
  EXPECT_NEAR(meter.codes({}, 1023, 0.01).clipped_fraction, 0.25, 1e-12);
}

TEST(ExposureMeter, LearnsThatASensorSaturatesBelowItsLargestCode) {
  Frame frame;
  std::mt19937 random(5);
  std::normal_distribution<double> noise(700, 150);
  for (std::uint16_t& dn : frame.dn) dn = static_cast<std::uint16_t>(std::clamp(noise(random), 0.0, 960.0));
  ExposureMeter meter(format_of(10));
  frame.meter(meter);
  const MeteredCodes codes = meter.codes({}, 1023, 0.01);
  EXPECT_EQ(codes.range_dn, 960);
  EXPECT_GT(codes.clipped_fraction, 0.02);  // 4.2 % of the pixels in the mean
  for (std::uint16_t& dn : frame.dn) dn = static_cast<std::uint16_t>(std::max(noise(random) - 400, 0.0));
  frame.meter(meter);
  EXPECT_EQ(meter.codes({}, 1023, 0.01).range_dn, 960);  // remembered
  ExposureMeter another(format_of(10));
  frame.meter(another);
  EXPECT_EQ(another.codes({}, 1023, 0.01).range_dn, 1023);  // nothing saturates
}

TEST(ExposureMeter, NeedsAtMost128PairsOfRows) {
  for (const int rows : {2, 3, 64, 255, 256, 257, 1080, 2464, 6000}) {
    int count = 0;
    for (int y = 0; y < rows; ++y) {
      count += is_metered_row(y, rows) ? 1 : 0;
      EXPECT_EQ(is_metered_row(y, rows), is_metered_row(y - y % 2, rows));  // whole cells
    }
    EXPECT_LE(count, 257) << rows;
    EXPECT_GE(count, std::min(rows, 128)) << rows;
  }
}

TEST(ExposureMeter, TakesMonochromeFramesAsOneChannel) {
  Frame frame;
  for (std::size_t i = 0; i < frame.dn.size(); ++i) frame.dn[i] = static_cast<std::uint16_t>(i % 1000);
  ExposureMeter meter(format_of(12, SensorLayout::monochrome));
  frame.meter(meter);
  const MeteredCodes codes = meter.codes({{16, 0, 0, 0}}, 4095, 0.01);
  EXPECT_NEAR(codes.midtone_dn, 500 - 16, 35);  // 6144 pixels: six ramps of 1000 and the start of a seventh
  EXPECT_NEAR(codes.highlight_dn, 990 - 16, 2);
}

}  // namespace
}  // namespace lowlux::isp
