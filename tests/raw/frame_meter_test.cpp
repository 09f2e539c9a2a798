#include "isp/raw/measure/frame_meter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <random>
#include <vector>

#include "isp/base/packed/raw_format.h"
#include "isp/raw/black_point.h"
#include "tests/support/guarded_memory.h"

namespace lowlux::isp::frame_meter_test {
namespace {

struct Sensor {
  RawFormat format;
  int width;
  int height;
  Rect active;
  std::vector<Rect> masked{};
};

RawFrame frame_of(const Sensor& sensor) {
  RawFrame frame;
  RawDn& raw = frame.raw;
  raw.dn = Plane<std::uint16_t>(sensor.width, sensor.height);
  raw.layout = sensor.format.layout;
  raw.active = sensor.active;
  if (raw.layout == SensorLayout::bayer) raw.phase = phase_of_crop(sensor.format.phase, raw.active.x, raw.active.y);
  raw.masked = sensor.masked;
  raw.white_dn.fill(0.9 * largest_code(sensor.format));
  return frame;
}

/// 16-bit codes of every size, zeros and codes above white among them.
std::vector<std::uint16_t> codes_of(const Sensor& sensor, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> code(-200, largest_code(sensor.format));
  std::vector<std::uint16_t> out(static_cast<std::size_t>(sensor.width) * static_cast<std::size_t>(sensor.height));
  for (std::uint16_t& dn : out) dn = static_cast<std::uint16_t>(std::max(0, code(random)));
  return out;
}

std::size_t stride_of(const Sensor& sensor) { return row_bytes(sensor.format, sensor.width); }

/// Bytes of little-endian 16-bit codes.
std::span<const std::byte> bytes_of(const std::vector<std::uint16_t>& codes) { return std::as_bytes(std::span(codes)); }

/// What the header says, by plain loops over the plane.
struct Expected {
  FrameStatistics statistics;
  PerSite<double> masked_sum{}, masked_count{};
};

Expected expected_of(const RawDn& raw, const RawFormat& format) {
  Expected out;
  FrameStatistics& s = out.statistics;
  const auto dn_at = [&](int x, int y) { return raw.dn.at(raw.active.x + x, raw.active.y + y); };
  for (int y = 0; y < raw.active.height; ++y) {
    for (int x = 0; x < raw.active.width; ++x) {
      for (int c = 0; c < 3; ++c) {
        if (raw.layout == SensorLayout::bayer && static_cast<int>(colour_at(raw.phase, x, y)) != c) continue;
        s.sum[c] += dn_at(x, y);
        ++s.count[c];
      }
      ++s.pixels;
      s.clipped += dn_at(x, y) >= raw.white_dn[1] ? 1 : 0;
      s.zero += dn_at(x, y) == 0 ? 1 : 0;
      if (x % 2 == 0 || y % 4 != 1) continue;  // every second row of cells
      int luma = 0;
      for (int site = 0; site < 4; ++site) {
        const int u = x - 1 + (site & 1), v = y - 1 + (site >> 1);
        constexpr std::array weight{77, 75, 29};
        const bool bayer = raw.layout == SensorLayout::bayer;
        luma += (bayer ? weight[static_cast<std::size_t>(colour_at(raw.phase, u, v))] : 64) * dn_at(u, v);
      }
      const double share = std::floor(luma / 256.0) / std::exp2(format.bits);
      ++s.luma[static_cast<std::size_t>(std::min(1023.0, std::floor(share * 1024)))];
    }
  }
  for (const Rect& r : raw.masked) {
    for (int y = r.y; y < r.y + r.height; ++y) {
      for (int x = r.x; x < r.x + r.width; ++x) {
        // Sites of the active area's cells, which go on beyond it.
        const int site = 2 * std::abs((y - raw.active.y) % 2) + std::abs((x - raw.active.x) % 2);
        out.masked_sum[site] += raw.dn.at(x, y);
        out.masked_count[site] += 1;
      }
    }
  }
  return out;
}

bool same_bits(const CameraRgb& a, const CameraRgb& b) {
  for (int c = 0; c < 3; ++c) {
    if (a.plane[c].size() != b.plane[c].size()) return false;
    if (std::memcmp(a.plane[c].data(), b.plane[c].data(), a.plane[c].size() * sizeof(float)) != 0) return false;
  }
  return true;
}

void expect_equal(const FrameStatistics& found, const FrameStatistics& expected) {
  EXPECT_EQ(found.sum, expected.sum);
  EXPECT_EQ(found.count, expected.count);
  EXPECT_EQ(found.pixels, expected.pixels);
  EXPECT_EQ(found.clipped, expected.clipped);
  EXPECT_EQ(found.zero, expected.zero);
  EXPECT_EQ(found.luma, expected.luma);
}

std::vector<Sensor> sensors() {
  std::vector<Sensor> out;
  for (const BayerPhase phase : {BayerPhase::rggb, BayerPhase::grbg, BayerPhase::gbrg, BayerPhase::bggr}) {
    out.push_back({{.bits = 10, .phase = phase}, 81, 67, {0, 0, 81, 67}});
    out.push_back({{.bits = 12, .phase = phase},
                   400,
                   301,
                   {17, 21, 373, 251},
                   {{0, 0, 400, 7}, {1, 30, 11, 200}, {391, 290, 9, 11}}});
  }
  out.push_back({{.bits = 8, .layout = SensorLayout::monochrome}, 131, 64, {3, 2, 128, 61}, {{0, 0, 2, 64}}});
  out.push_back({{.bits = 16}, 1100, 40, {0, 0, 1099, 39}});
  out.push_back({{.bits = 14}, 2, 2, {0, 0, 2, 2}});
  return out;
}

TEST(FrameMeter, AgreesWithPlainLoopsAndThumbnailsForEveryNumberOfThreads) {
  unsigned seed = 0;
  for (const Sensor& sensor : sensors()) {
    Sensor words = sensor;
    words.format.packing = RawPacking::little16;
    words.format.bits = std::max(words.format.bits, 10);  // of 8 bits there are bytes alone
    const std::vector<std::uint16_t> codes = codes_of(words, ++seed);
    for (const int threads : {1, 2, 3, 7}) {
      PoolExecutor executor(threads);
      RawFrame frame = frame_of(words);
      FrameMeter meter(frame.raw, words.format, threads);
      meter.read(bytes_of(codes), stride_of(words), frame.raw, executor);
      // The second frame finds nothing of the first.
      meter.read(bytes_of(codes), stride_of(words), frame.raw, executor);
      EXPECT_TRUE(std::equal(codes.begin(), codes.end(), frame.raw.dn.data()));
      const Expected expected = expected_of(frame.raw, words.format);
      expect_equal(meter.statistics(), expected.statistics);
      const auto masked = meter.masked_dn();
      ASSERT_EQ(masked.has_value(), expected.masked_count[0] > 0 && expected.masked_count[3] > 0);
      for (int site = 0; masked && site < 4; ++site) {
        EXPECT_DOUBLE_EQ((*masked)[site], expected.masked_sum[site] / expected.masked_count[site]);
      }
      Thumbnail found;
      BlackPoint black;
      black.pedestal_dn = {10, 11, 12, 13};
      meter.thumbnail().make(frame, black, found);
      const Thumbnail alone = make_thumbnail(frame, black, executor);
      EXPECT_TRUE(same_bits(found.mean, alone.mean));
      EXPECT_EQ(found.black_noise_std,
                0);  // sums of columns tell no noise; a live frame has it from its facts or its tiles
    }
  }
}

TEST(FrameMeter, TilesAreThoseOfOneThread) {
  const Sensor sensor{{.bits = 12}, 640, 400, {2, 2, 630, 390}};
  std::vector<std::uint16_t> codes = codes_of(sensor, 9);
  for (std::size_t i = 0; i < codes.size(); ++i) {
    const auto x = static_cast<int>(i) % sensor.width;  // levels whose noise grows with them
    codes[i] = static_cast<std::uint16_t>(100 + 4 * (x / 2) + codes[i] % (10 + x / 8));
  }
  std::vector<NoiseLine> lines;
  for (const int threads : {1, 2, 3, 7}) {
    PoolExecutor executor(threads);
    RawFrame frame = frame_of(sensor);
    FrameMeter meter(frame.raw, sensor.format, threads);
    meter.read(bytes_of(codes), stride_of(sensor), frame.raw, executor);
    const auto line = meter.tiles().line({}, 4095);
    ASSERT_TRUE(line);
    lines.push_back(*line);
    EXPECT_EQ(lines.back().gain_dn, lines.front().gain_dn);
    EXPECT_EQ(lines.back().offset_dn2, lines.front().offset_dn2);
    EXPECT_EQ(meter.masked_dn(), std::nullopt);
  }
}

// Packed rows, the last one right before memory nobody may touch: with padding between rows there is none after it.
TEST(FrameMeter, ReadsNothingBeyondTheLastRow) {
  for (const RawPacking packing : {RawPacking::csi2, RawPacking::little16}) {
    const Sensor sensor{{.bits = 10, .packing = packing}, 122, 35, {1, 1, 120, 33}};
    const std::size_t row = row_bytes(sensor.format, sensor.width), stride = row + 48;
    const std::size_t size = stride * static_cast<std::size_t>(sensor.height - 1) + row;
    const test::GuardedMemory memory(size);
    std::mt19937 random(5);
    for (const std::span<std::byte> bytes : {memory.first(size), memory.last(size)}) {
      for (std::byte& b : bytes) b = static_cast<std::byte>(random());
      RawFrame frame = frame_of(sensor);
      PoolExecutor executor(3);
      FrameMeter meter(frame.raw, sensor.format, 3);
      meter.read(bytes, stride, frame.raw, executor);
      std::vector<std::uint16_t> codes(static_cast<std::size_t>(sensor.width));
      for (int y = 0; y < sensor.height; ++y) {
        unpack_row(sensor.format, bytes.data() + stride * static_cast<std::size_t>(y), sensor.width, codes.data());
        ASSERT_TRUE(std::equal(codes.begin(), codes.end(), frame.raw.dn.row(y)));
      }
      expect_equal(meter.statistics(), expected_of(frame.raw, sensor.format).statistics);
    }
  }
}

}  // namespace
}  // namespace lowlux::isp::frame_meter_test
