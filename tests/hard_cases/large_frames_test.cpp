#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "isp/raw/measure/frame_meter.h"
#include "isp/raw/measure/meter_rows.h"
#include "isp/raw/measure/thumbnail.h"
#include "tests/hard_cases/rendering.h"
#include "tests/hard_cases/simulated.h"

// Frames of extreme sizes. Rows that are all the same piece of memory make large ones of little.
namespace lowlux::hard_cases {
namespace {

constexpr std::string_view large_frames_group = "Other cases";

/// Codes of a row, the largest among them.
std::vector<std::uint16_t> row_of_codes(int width) {
  std::vector<std::uint16_t> dn(static_cast<std::size_t>(width));
  for (std::size_t x = 0; x < dn.size(); ++x)
    dn[x] = static_cast<std::uint16_t>(x % 5 == 0 ? 65535 : (x * 40503U) % 65536U);
  return dn;
}

RawDn sums_of(int width, int height) {
  RawDn raw;
  raw.active = raw.default_crop = {0, 0, width, height};
  raw.white_dn.fill(65535);
  return raw;
}

/// Relative error of the sums of a frame whose rows are all alike; sites of one row are summed exactly, in integers.
double error_of(const PerSite<std::uint64_t>& found, const std::vector<std::uint16_t>& dn, int height) {
  PerSite<std::uint64_t> expected{};
  for (std::size_t x = 0; x < dn.size(); ++x) {
    for (const std::size_t parity : {0U, 2U})
      expected[parity + x % 2] += static_cast<std::uint64_t>(dn[x]) * (height / 2);
  }
  double worst = 0;
  for (int site = 0; site < 4; ++site) {
    keep_worst(worst, std::abs(static_cast<double>(found[site]) / static_cast<double>(expected[site]) - 1));
  }
  return worst;
}

/// As FrameMeter sums: columns of the rows of a block, then blocks.
double error_by_columns(int width, int height, Denormals m) {
  const auto dn = row_of_codes(width);
  isp::ThumbnailSums sums(sums_of(width, height));
  in_mode(m, [&] {
    for (int y = 0; y < height; y += sums.block()) {
      const int rows = std::min(sums.block(), height - y);
      std::array<std::vector<std::uint32_t>, 2> column{std::vector<std::uint32_t>(dn.size()),
                                                       std::vector<std::uint32_t>(dn.size())};
      for (int parity = 0; parity < 2; ++parity) {
        isp::meter::sum_columns({dn.data(), 0, (rows + 1 - parity) / 2, width}, column[parity].data());
      }
      sums.add_columns({column[0].data(), column[1].data()}, y / sums.block(), rows);
    }
  });
  return error_of(sums.sums(), dn, height);
}

TEST(HardCaseExtreme, SumsOverAHundredMegapixels) {
  HardCase row({large_frames_group, "sums of 100 megapixels of codes up to 65535", "exact integers", "relative"});
  row.none(Path::reference, "is the reference itself").none(levels, "noise is reduced block by block");
  row.on_each_set(0, [](Denormals m) { return error_by_columns(10000, 10000, m); });
  row.on(Path::file, 0, [](Denormals m) {
    const auto dn = row_of_codes(10000);
    isp::ThumbnailSums sums(sums_of(10000, 10000));
    in_mode(m, [&] {
      for (int y = 0; y < 10000; ++y) sums.add_row(dn.data(), y);
    });
    return error_of(sums.sums(), dn, 10000);
  });
  row.none(Path::live, "the frame needs 200 MB: see 12 megapixels below");
}

/// A camera's memory whose rows are all the same one, metered.
double error_of_meter(Denormals m) {
  constexpr int width = 4000, height = 3000;
  const auto dn = row_of_codes(width);
  RawDn raw = sums_of(width, height);
  raw.dn = Plane<std::uint16_t>(width, height);
  PoolExecutor pool(2);
  test::ExecutorInMode executor(pool, m);
  isp::FrameMeter meter(raw, {.bits = 16}, 2);
  in_mode(m, [&] { meter.read(std::as_bytes(std::span(dn)), 0, raw, executor); });
  double worst = error_of(meter.thumbnail().sums(), dn, height);
  std::array<std::uint64_t, 3> expected{};
  for (std::size_t x = 0; x < dn.size(); ++x) {
    expected[x % 2] += static_cast<std::uint64_t>(dn[x]) * (height / 2);
    expected[1 + x % 2] += static_cast<std::uint64_t>(dn[x]) * (height / 2);
  }
  for (int c = 0; c < 3; ++c) {
    keep_worst(worst, std::abs(static_cast<double>(meter.statistics().sum[c]) / static_cast<double>(expected[c]) - 1));
  }
  return worst;
}

TEST(HardCaseDenoise10, SumsOfTwelveMegapixels) {
  HardCase row({"Noise reduction", "9.10 sums over 12 megapixels", "exact integers", "relative"});
  row.none(Path::reference, "is the reference itself").none(levels, "noise is reduced block by block");
  row.on_each_set(0, error_of_meter)
      .none(Path::file, "100 megapixels: see the last table")
      .on(Path::live, 0, error_of_meter);
}

TEST(HardCaseExtreme, FramesOfOneRowOrColumn) {
  HardCase row({large_frames_group, "1 x N and N x 1, N to 5000; 1 x 1",
                "plain double (sets), an image or an error (others)", "relative; sizes without either"});
  row.none(Path::reference, "is the reference itself")
      .none(levels, "needs at least 2 x 2 pixels: refused with a reason");
  row.on_each_set({4e-7, rounding}, [](Denormals m) {
    double worst = 0;
    for (const auto& [width, height] : {std::pair{1, 1}, {1, 7}, {7, 1}, {1, 5000}, {5000, 1}, {2, 1}, {1, 2}}) {
      keep_worst(worst, linear_error({.width = width, .height = height}, m));
    }
    return worst;
  });
  row.on(Path::file, 0, sizes_through_file);
  row.on(Path::live, 0, [](Denormals m) {
    double taken = 0;
    for (const auto& [width, height] : {std::pair{1, 1}, {1, 7}, {7, 1}, {1, 5000}, {5000, 1}}) {
      taken += live_takes({.width = width, .height = height}, {}, m) ? 1 : 0;
    }
    return taken;
  });
}

TEST(HardCaseSensor, MosaicsOfOnePixelAndOfOddSizes) {
  HardCase row({"Sensor and photons", "mosaics of 1 x 1, 1 x 5, 5 x 1, 5 x 7, 33 x 31",
                "closed form: mean of the greens there are", "standard errors"});
  row.none(Path::reference, "the reference processes one pixel").none(levels, "see 9.7: borders");
  const auto error = [](Denormals m) {
    const RawFrame one = simulated({.luminance_cd_m2 = 1, .width = 1, .height = 1}, m);
    if (one.raw.dn.size() != 1) return std::numeric_limits<double>::infinity();
    double worst = 0;
    for (const auto& [width, height] : {std::pair{1, 5}, {5, 1}, {5, 7}, {33, 31}}) {
      keep_worst(worst, error_of_green({.green_e = 300, .width = width, .height = height}, m));
    }
    return worst;
  };
  row.on_each_set(5, error).on(Path::file, 5, error).none(Path::live, "see the last table: 1 x N");
}

}  // namespace
}  // namespace lowlux::hard_cases
