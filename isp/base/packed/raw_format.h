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

/// Lists how the samples of one row are packed in a camera's buffer; capture/camera/README.md draws each packing.
enum class RawPacking : std::uint8_t {
  byte,           // one byte for each sample: 8 bits
  little16,       // 16 bits for each sample, little endian, the value in the low bits
  big16,          // 16 bits for each sample, big endian, the value in the low bits
  csi2,           // MIPI CSI-2: the high 8 bits of each sample of a group, then the low bits of all of them
  ipu3,           // Intel IPU3: 25 samples of 10 bits from bit 0 on, little endian, in 32 bytes
  bits_msb_first  // a continuous run of bits, most significant first (V4L2 Y10B)
};

/// Describes the samples of a raw stream, Bayer or monochrome; for monochrome the phase is rggb.
struct RawFormat {
  int bits = 16;  // bits of a sample: 8, 10, 12, 14 or 16
  RawPacking packing = RawPacking::little16;
  SensorLayout layout = SensorLayout::bayer;
  BayerPhase phase = BayerPhase::rggb;
  friend bool operator==(const RawFormat&, const RawFormat&) = default;
};

/// Holds a format with all its names. V4L2 and DRM (libcamera) use different four-character codes; a DRM code is only
/// meaningful with its modifier.
struct RawFormatNames {
  RawFormat format;
  std::uint32_t v4l2_fourcc = 0;  // 0: V4L2 has none
  std::uint32_t drm_fourcc = 0;   // 0: libcamera has none
  std::uint64_t drm_modifier = 0;
  std::string_view libcamera;  // "SRGGB10_CSI2P"; empty: none
};

/// Packs four characters as both APIs do.
constexpr std::uint32_t fourcc(char a, char b, char c, char d) {
  return static_cast<std::uint32_t>(static_cast<unsigned char>(a)) |
         static_cast<std::uint32_t>(static_cast<unsigned char>(b)) << 8 |
         static_cast<std::uint32_t>(static_cast<unsigned char>(c)) << 16 |
         static_cast<std::uint32_t>(static_cast<unsigned char>(d)) << 24;
}

/// Returns all formats lowlux unpacks.
std::span<const RawFormatNames> raw_formats();

/// Both functions find a format by the code of one API; nullopt for all others: processed images, lossy formats (A-law,
/// DPCM), compressed ones.
std::optional<RawFormat> raw_format_of_v4l2(std::uint32_t code);
std::optional<RawFormat> raw_format_of_drm(std::uint32_t code, std::uint64_t modifier);
/// Returns the names of a format; null if it is not one of raw_formats().
const RawFormatNames* names_of(const RawFormat& format);

/// Returns a V4L2 code as v4l2-ctl writes it: no blanks at its end, "Y16-BE" for big endian, "?" for unprintable
/// characters.
std::string v4l2_text(std::uint32_t code);
/// Returns libcamera's name of a format, else that of V4L2; empty if it is not one of raw_formats().
std::string text_of(const RawFormat& format);

/// Returns the index of a site of the 2x2 cell in figures of R, Gr, Gb and B, as cameras state their black levels. Gr
/// lies in the row of red.
constexpr std::size_t black_channel_of(int site, BayerPhase phase) {
  const bool red_column_site = (site & 1) == red_column(phase);
  if ((site >> 1) == red_row(phase)) return red_column_site ? 0 : 1;
  return red_column_site ? 2 : 3;
}

/// Holds the pixels and bytes of the smallest complete group of samples; a buffer's rows hold complete groups.
struct RawGroup {
  int pixels = 1;
  int bytes = 1;
};
RawGroup group_of(const RawFormat& format);

/// Returns the bytes that a row of `width` samples takes, with the last group complete and without stride padding; 0
/// for a width below 1.
std::size_t row_bytes(const RawFormat& format, int width);

/// Returns the largest code: 2^bits - 1.
constexpr int largest_code(const RawFormat& format) { return (1 << format.bits) - 1; }

/// Unpacks one row of a camera's buffer to 16-bit codes. Reads row_bytes(format, width) bytes at `in`, each once and in
/// rising order, none beyond; writes `width` codes at `out`, none beyond. Codes above 2^bits - 1 in 16-bit samples are
/// kept. `in` needs no alignment. Nothing is allocated. The format is one of raw_formats(); for a width below 1 nothing
/// is read or written.
void unpack_row(const RawFormat& format, const std::byte* in, int width, std::uint16_t* out);

/// Returns the vector instruction set that unpack_row uses on this machine, by its Highway name.
const char* unpack_target();

}  // namespace lowlux
