#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "isp/base/cfa.h"
#include "isp/base/frame.h"

namespace lowlux {

/// How the samples of one row lie in a camera's buffer; capture/camera/README.md draws each.
enum class RawPacking : std::uint8_t {
  byte,           // one byte for each sample: 8 bits
  little16,       // 16 bits for each, little endian, the value in the low bits
  big16,          // the same, big endian
  csi2,           // MIPI CSI-2: the high 8 bits of each sample of a group, then the low bits of all of them
  ipu3,           // Intel IPU3: 25 samples of 10 bits from bit 0 on, little endian, in 32 bytes
  bits_msb_first  // an endless run of bits, most significant first (V4L2 Y10B)
};

/// Samples of a raw stream. Bayer or monochrome; for monochrome the phase is rggb.
struct RawFormat {
  int bits = 16;  // of a sample: 8, 10, 12, 14 or 16
  RawPacking packing = RawPacking::little16;
  SensorLayout layout = SensorLayout::bayer;
  BayerPhase phase = BayerPhase::rggb;
  friend bool operator==(const RawFormat&, const RawFormat&) = default;
};

/// A format by all its names. V4L2 and DRM (libcamera) use different four-character codes; a DRM code means little
/// without its modifier.
struct RawFormatNames {
  RawFormat format;
  std::uint32_t v4l2_fourcc = 0;  // 0: V4L2 has none
  std::uint32_t drm_fourcc = 0;   // 0: libcamera has none
  std::uint64_t drm_modifier = 0;
  std::string_view libcamera;  // "SRGGB10_CSI2P"; empty: none
};

/// Four characters as both APIs pack them.
constexpr std::uint32_t fourcc(char a, char b, char c, char d) {
  return static_cast<std::uint32_t>(static_cast<unsigned char>(a)) |
         static_cast<std::uint32_t>(static_cast<unsigned char>(b)) << 8 |
         static_cast<std::uint32_t>(static_cast<unsigned char>(c)) << 16 |
         static_cast<std::uint32_t>(static_cast<unsigned char>(d)) << 24;
}

/// All formats lowlux unpacks.
std::span<const RawFormatNames> raw_formats();

/// By the code of one API; nullopt for all else: processed pictures, formats that lose (A-law, DPCM), compressed ones.
std::optional<RawFormat> raw_format_of_v4l2(std::uint32_t code);
std::optional<RawFormat> raw_format_of_drm(std::uint32_t code, std::uint64_t modifier);
/// The names of a format; null where it is none of raw_formats().
const RawFormatNames* names_of(const RawFormat& format);

/// A V4L2 code as v4l2-ctl writes it: no blanks at its end, "Y16-BE" for big endian, "?" for what cannot be printed.
std::string v4l2_text(std::uint32_t code);
/// libcamera's name of a format, else that of V4L2; empty where it is none of raw_formats().
std::string text_of(const RawFormat& format);

/// Place of a site of the 2x2 cell in figures of R, Gr, Gb and B, as cameras state their black levels. Gr lies in the
/// row of red.
constexpr std::size_t black_channel_of(int site, BayerPhase phase) {
  const bool red_column_site = (site & 1) == red_column(phase);
  if ((site >> 1) == red_row(phase)) return red_column_site ? 0 : 1;
  return red_column_site ? 2 : 3;
}

/// Pixels and bytes of the smallest whole group of samples; a buffer's rows hold whole groups.
struct RawGroup {
  int pixels = 1;
  int bytes = 1;
};
RawGroup group_of(const RawFormat& format);

/// Bytes that a row of `width` samples takes, the last group whole; without what a stride adds. 0 below 1.
std::size_t row_bytes(const RawFormat& format, int width);

/// Largest code: 2^bits - 1.
constexpr int largest_code(const RawFormat& format) { return (1 << format.bits) - 1; }

/// One row of a camera's buffer as 16-bit codes. Reads row_bytes(format, width) bytes at `in`, each once and in rising
/// order, none beyond; writes `width` codes at `out`, none beyond. Codes above 2^bits - 1 in 16-bit samples are kept.
/// No alignment is asked of `in`. Nothing is allocated. The format is one of raw_formats(); of a width below 1 nothing
/// is touched.
void unpack_row(const RawFormat& format, const std::byte* in, int width, std::uint16_t* out);

/// The vector instruction set unpack_row uses on this machine, as Highway names it.
const char* unpack_target();

}  // namespace lowlux
