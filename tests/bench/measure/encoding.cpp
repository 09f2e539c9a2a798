// Prints what isp/codec/README.md quotes: time and size of a 12 MP picture in each format.

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <vector>

#include "isp/base/executor.h"
#include "isp/codec/exr.h"
#include "isp/codec/jpeg.h"
#include "isp/codec/png.h"
#include "isp/codec/tiff.h"
#include "tests/bench/measure/measure.h"

namespace lowlux::isp {
namespace {

constexpr int width = 4000, height = 3000;

/// Looks like a developed raw to a compressor: smooth areas, edges, and noise of about 5 codes out of 255 whose
/// neighbours are correlated, as demosaicing leaves it. Linear in 0..1.
SceneLinear developed_like() {
  SceneLinear picture(width, height);
  std::mt19937 random(1);
  const auto noise = [&] { return static_cast<float>(static_cast<double>(random()) / 4294967296.0 - 0.5); };
  for (int c = 0; c < 3; ++c) {
    auto& plane = picture.plane[c];
    for (int y = 0; y < height; ++y) {
      float left = noise();
      for (int x = 0; x < width; ++x) {
        const bool edge = (x / 300 + y / 300) % 2 == 0;
        const auto smooth = static_cast<float>(0.3 + 0.2 * std::sin(0.003 * x + c) * std::cos(0.002 * y) + 0.2 * edge);
        left = 0.5f * left + noise();
        const float above = y > 0 ? plane.at(x, y - 1) - smooth : 0;
        plane.at(x, y) = smooth + 0.03f * left + (std::fabs(above) < 0.1f ? 0.5f * above : 0);
      }
    }
  }
  return picture;
}

template <class Code>
Encoded<Code> codes_of(const SceneLinear& linear) {
  Encoded<Code> out{Plane<Code>(3 * width, height)};
  const float top = static_cast<Code>(-1);
  for (int y = 0; y < height; ++y) {
    for (int i = 0; i < 3 * width; ++i) {
      out.codes.at(i, y) = static_cast<Code>(top * std::clamp(linear.plane[i % 3].at(i / 3, y), 0.0f, 1.0f));
    }
  }
  return out;
}

void print_row(const char* name, double ms, std::size_t size, std::size_t raw) {
  std::printf("%-32s %6.0f ms CPU %6.1f MB %5.1f %%\n", name, ms, static_cast<double>(size) / 1e6,
              100.0 * static_cast<double>(size) / static_cast<double>(raw));
}

/// Fastest of three, to memory that is already there.
template <class Encode>
void time_format(const char* name, std::size_t raw, const Encode& encode) {
  std::vector<char> memory(raw + raw / 4 + 100'000);
  double best_ms = 1e9;
  std::size_t size = 0;
  for (int round = 0; round < 3; ++round) {
    std::FILE* file = fmemopen(memory.data(), memory.size(), "w+b");
    const double start_ms = test::cpu_ms();
    if (!encode(file)) std::abort();
    std::fflush(file);
    best_ms = std::min(best_ms, test::cpu_ms() - start_ms);
    std::fseek(file, 0, SEEK_END);
    size = static_cast<std::size_t>(std::ftell(file));
    std::fclose(file);
  }
  print_row(name, best_ms, size, raw);
}

std::vector<unsigned char> filtered(const Encoded8& picture, int filter) {
  std::vector<unsigned char> out;
  const int count = picture.codes.width();
  for (int y = 0; y < picture.height(); ++y) {
    out.push_back(static_cast<unsigned char>(filter));
    for (int i = 0; i < count; ++i) {
      const int left = i < 3 ? 0 : picture.codes.at(i - 3, y);
      const int above = y == 0 ? 0 : picture.codes.at(i, y - 1);
      const std::array<int, 4> guess{0, left, above, (left + above) / 2};
      out.push_back(static_cast<unsigned char>(picture.codes.at(i, y) - guess[filter]));
    }
  }
  return out;
}

void time_zlib(const Encoded8& picture, int filter, int level, int strategy, const char* name) {
  std::vector<unsigned char> in = filtered(picture, filter);
  std::vector<unsigned char> out(compressBound(in.size()));
  z_stream stream{};
  deflateInit2(&stream, level, Z_DEFLATED, 15, 9, strategy);
  stream.next_in = in.data();
  stream.avail_in = static_cast<uInt>(in.size());
  stream.next_out = out.data();
  stream.avail_out = static_cast<uInt>(out.size());
  const double start_ms = test::cpu_ms();
  deflate(&stream, Z_FINISH);
  print_row(name, test::cpu_ms() - start_ms, stream.total_out, picture.codes.size());
  deflateEnd(&stream);
}

}  // namespace
}  // namespace lowlux::isp

int lowlux::test::measure_encoding(Arguments& arguments) {
  using namespace isp;
  arguments.end();
  const SceneLinear linear = developed_like();
  const Encoded8 codes8 = codes_of<std::uint8_t>(linear);
  const Encoded16 codes16 = codes_of<std::uint16_t>(linear);
  const std::size_t raw = codes8.codes.size();
  InlineExecutor executor;
  time_format("PNG 8", raw, [&](std::FILE* f) { return encode_png(codes8, {}, executor, f); });
  time_format("PNG 16", 2 * raw, [&](std::FILE* f) { return encode_png(codes16, {}, executor, f); });
  time_format("JPEG 92, full chroma", raw, [&](std::FILE* f) { return encode_jpeg(codes8, {}, {}, f); });
  for (const bool packed : {false, true}) {
    const ExrOptions::Compression exr{packed};
    time_format(packed ? "OpenEXR half, PIZ" : "OpenEXR half", 2 * raw, [&](std::FILE* f) {
      return encode_exr(linear, {}, {ExrOptions::Depth::half, exr}, f);
    });
    time_format(packed ? "OpenEXR float, PIZ" : "OpenEXR float", 4 * raw, [&](std::FILE* f) {
      return encode_exr(linear, {}, {ExrOptions::Depth::full, exr}, f);
    });
  }
  const Picture deep = codes_of<std::uint16_t>(linear);
  const Picture floats = developed_like();
  for (const bool packed : {false, true}) {
    const TiffOptions options{TiffOptions::Compression{packed}};
    time_format(packed ? "TIFF 16, deflate" : "TIFF 16", 2 * raw,
                [&](std::FILE* f) { return encode_tiff(deep, {}, options, f); });
    time_format(packed ? "TIFF float, deflate" : "TIFF float", 4 * raw,
                [&](std::FILE* f) { return encode_tiff(floats, {}, options, f); });
  }
  time_zlib(codes8, 3, 1, Z_RLE, "zlib: Average, runs");
  time_zlib(codes8, 1, 1, Z_RLE, "zlib: Sub, runs");
  time_zlib(codes8, 2, 1, Z_RLE, "zlib: Up, runs");
  time_zlib(codes8, 3, 1, Z_FILTERED, "zlib: Average, level 1");
  time_zlib(codes8, 3, 3, Z_FILTERED, "zlib: Average, level 3");
  time_zlib(codes8, 3, 6, Z_FILTERED, "zlib: Average, level 6");
  time_zlib(codes8, 1, 6, Z_FILTERED, "zlib: Sub, level 6");
  return 0;
}
