#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "isp/adapter/lowlux_stage.h"
#include "isp/base/packed/raw_format.h"

/// Frames as cameras have them in memory, and stages to give them to.
namespace lowlux::stage_testing {

using Codes = std::vector<std::uint16_t>;

/// One row of codes as the format has them, the last group whole, whose spare samples are 0: the reverse of unpack_row.
inline std::vector<std::byte> packed_row(const RawFormat& format, const std::uint16_t* codes, int width) {
  std::vector<std::byte> out(row_bytes(format, width));
  const auto set_bit = [&](std::size_t bit) { out[bit / 8] |= std::byte{1} << (bit % 8); };
  const RawGroup group = group_of(format);
  for (int x = 0; x < width; ++x) {
    const std::size_t start = static_cast<std::size_t>(x / group.pixels) * group.bytes;
    const int place = x % group.pixels;
    for (int b = 0; b < format.bits; ++b) {
      if ((codes[x] >> b & 1) == 0) continue;
      const int low = format.bits - 8;
      switch (format.packing) {
        case RawPacking::byte:
          set_bit(8 * static_cast<std::size_t>(x) + b);
          break;
        case RawPacking::little16:
          set_bit(16 * static_cast<std::size_t>(x) + b);
          break;
        case RawPacking::big16:
          set_bit(16 * static_cast<std::size_t>(x) + (b ^ 8));
          break;
        case RawPacking::csi2:
          set_bit(b >= low ? 8 * (start + place) + (b - low) : 8 * (start + group.pixels) + place * low + b);
          break;
        case RawPacking::ipu3:
          set_bit(8 * start + place * format.bits + b);
          break;
        case RawPacking::bits_msb_first: {
          const std::size_t from_first = static_cast<std::size_t>(x) * format.bits + (format.bits - 1 - b);
          set_bit(from_first / 8 * 8 + (7 - from_first % 8));
          break;
        }
      }
    }
  }
  return out;
}

/// A whole frame; what lies between rows is filled with a pattern.
inline std::vector<std::byte> packed_frame(const RawFormat& format, const Codes& codes, int width, std::size_t stride) {
  const auto height = static_cast<int>(codes.size()) / width;
  std::vector<std::byte> out(stride * static_cast<std::size_t>(height), std::byte{0xA5});
  for (int y = 0; y < height; ++y) {
    const auto row = packed_row(format, codes.data() + static_cast<std::size_t>(y) * width, width);
    std::copy(row.begin(), row.end(), out.begin() + static_cast<std::ptrdiff_t>(stride) * y);
  }
  return out;
}

/// Noise from a counter, the same on every machine: about normal, variance 1 (the sum of four bytes of a hash).
inline double noise_at(std::uint32_t i) {
  i = (i ^ 61U) ^ (i >> 16);
  i *= 9;
  i ^= i >> 4;
  i *= 0x27d4eb2dU;
  i ^= i >> 15;
  const double sum = (i & 255U) + (i >> 8 & 255U) + (i >> 16 & 255U) + (i >> 24);
  return (sum - 510) / std::sqrt(4 * (256.0 * 256 - 1) / 12);
}

/// A scene of smooth light and an edge, with shot and read noise: black is a sixteenth of the range. The channels are
/// as unequal as those of cameras.
inline Codes scene(const RawFormat& format, int width, int height, std::uint32_t seed = 1) {
  Codes out(static_cast<std::size_t>(width) * height);
  const double largest = largest_code(format), black = (largest + 1) / 16, gain = largest / 2000;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const bool bayer = format.layout == SensorLayout::bayer;
      const int colour = bayer ? static_cast<int>(colour_at(format.phase, x & 1, y & 1)) : 1;
      const double share[] = {0.5, 1, 0.65};
      const double light = 20 + 400.0 * x / width + 100 * std::sin(0.2 * y) + (x > 2 * width / 3 ? 500 : 0);
      const double e = std::max(0.0, light * share[colour]);
      const std::size_t i = static_cast<std::size_t>(y) * width + x;
      const double noisy_e = e + std::sqrt(e + 9) * noise_at(static_cast<std::uint32_t>(i) + (seed << 20U));
      out[i] = static_cast<std::uint16_t>(std::min(largest, std::max(0.0, std::round(black + gain * noisy_e))));
    }
  }
  return out;
}

struct Release {
  void operator()(lowlux_stage* stage) const { lowlux_stage_release(stage); }
};
using StagePtr = std::unique_ptr<lowlux_stage, Release>;

/// As lowlux_stage_open(null) has them.
inline lowlux_stage_settings plain_settings(int threads = 1) {
  lowlux_stage_settings out{};
  out.size = sizeof out;
  out.threads = threads;
  out.most_denoise = LOWLUX_STAGE_LEVEL_DRAFT;
  out.tone = 1;
  return out;
}

inline lowlux_stage_params no_params() {
  lowlux_stage_params out{};
  out.size = sizeof out;
  return out;
}

/// What plain frames are developed by: all of it known, nothing denoised.
inline lowlux_stage_params fixed_params(const RawFormat& format) {
  auto out = no_params();
  out.valid = LOWLUX_STAGE_HAS_BLACK | LOWLUX_STAGE_HAS_COLOUR_GAINS | LOWLUX_STAGE_HAS_EXPOSURE_VALUE |
              LOWLUX_STAGE_HAS_DENOISE | LOWLUX_STAGE_HAS_NOISE;
  for (float& black : out.black_level) black = static_cast<float>(1 << format.bits) / 16;
  out.colour_gains[0] = 2;
  out.colour_gains[1] = 1.5;
  out.exposure_ev = 1;
  out.denoise = LOWLUX_STAGE_DENOISE_OFF;
  out.noise_gain = static_cast<float>(largest_code(format)) / 2000;
  out.noise_read = 3 * out.noise_gain;
  return out;
}

inline lowlux_stage_input input_of(const RawFormatNames& names, int width, int height) {
  lowlux_stage_input out{};
  out.size = sizeof out;
  out.api = names.v4l2_fourcc != 0 ? LOWLUX_STAGE_V4L2 : LOWLUX_STAGE_DRM;
  out.fourcc = names.v4l2_fourcc != 0 ? names.v4l2_fourcc : names.drm_fourcc;
  out.modifier = names.v4l2_fourcc != 0 ? 0 : names.drm_modifier;
  out.width = width;
  out.height = height;
  out.stride = row_bytes(names.format, width);
  return out;
}

inline const RawFormatNames& names_of_bayer(int bits, BayerPhase phase = BayerPhase::rggb,
                                            RawPacking packing = RawPacking::little16) {
  return *names_of({bits, bits == 8 ? RawPacking::byte : packing, SensorLayout::bayer, phase});
}

inline lowlux_stage_source source_of(const std::vector<std::byte>& bytes, std::size_t stride) {
  return {bytes.data(), bytes.size(), stride, -1};
}

/// A stage, its formats and memory for its pictures.
struct Rig {
  StagePtr stage;
  lowlux_stage_input in{};
  lowlux_stage_output out{};
  RawFormat format;
  std::vector<std::vector<std::uint8_t>> planes;
  lowlux_stage_picture picture{};
  lowlux_stage_result result{};
  lowlux_stage_statistics statistics{};
  int configured = LOWLUX_STAGE_NOT_CONFIGURED;

  Rig(const lowlux_stage_settings& settings, const RawFormatNames& names, lowlux_stage_input input,
      std::uint32_t fourcc, std::size_t more_stride = 0)
      : in(input), format(names.format) {
    lowlux_stage* opened = nullptr;
    if (lowlux_stage_open(&settings, &opened, nullptr, 0) != LOWLUX_STAGE_OK) return;
    stage.reset(opened);
    out.size = sizeof out;
    out.fourcc = fourcc;
    configured = lowlux_stage_configure(opened, &in, &out);
    if (configured < 0) return;
    picture.size = sizeof picture;
    picture.planes = out.planes;
    for (int i = 0; i < out.planes; ++i) {
      const std::size_t rows = fourcc == LOWLUX_STAGE_NV12 && i == 1 ? (out.height + 1) / 2 : out.height;
      const std::size_t stride = out.stride[i] + more_stride;
      planes.emplace_back(rows * stride, std::uint8_t{0xC3});
      picture.plane[i] = {planes.back().data(), planes.back().size(), stride};
    }
    result.size = sizeof result;
    statistics.size = sizeof statistics;
  }
  Rig(const lowlux_stage_settings& settings, const RawFormatNames& names, int width, int height, std::uint32_t fourcc)
      : Rig(settings, names, input_of(names, width, height), fourcc) {}

  int process(const std::vector<std::byte>& bytes, std::size_t stride, const lowlux_stage_params& params) {
    const auto source = source_of(bytes, stride);
    return lowlux_stage_process(stage.get(), &source, &picture, &params, &result, &statistics);
  }
  int process(const Codes& codes, const lowlux_stage_params& params) {
    const std::size_t stride = row_bytes(format, in.width);
    return process(packed_frame(format, codes, in.width, stride), stride, params);
  }
  const char* error() const { return lowlux_stage_last_error(stage.get()); }
  std::uint16_t wide(std::size_t i) const {
    return static_cast<std::uint16_t>(planes[0][2 * i] | planes[0][2 * i + 1] << 8);
  }
};

}  // namespace lowlux::stage_testing
