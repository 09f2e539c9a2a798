#include "isp/base/packed/raw_format.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <numeric>

#include "isp/base/packed/unpack_rows.h"

namespace lowlux {
namespace {

// Modifiers of DRM codes hold the vendor in the highest byte, its own number below (drm_fourcc.h as libcamera ships
// it).
constexpr std::uint64_t linear = 0;
constexpr std::uint64_t mipi = std::uint64_t{0x0b} << 56 | 1;          // MIPI_FORMAT_MOD_CSI2_PACKED
constexpr std::uint64_t ipu3_packed = std::uint64_t{0x01} << 56 | 13;  // IPU3_FORMAT_MOD_PACKED
constexpr std::uint32_t big_endian = 1U << 31;                         // V4L2 codes: v4l2_fourcc_be

/// Returns the code of four characters; 0 (no code) for "".
constexpr std::uint32_t code_of(std::string_view four) {
  return four.empty() ? 0 : fourcc(four[0], four[1], four[2], four[3]);
}

struct Codes {
  std::string_view v4l2;
  std::string_view drm;
};

constexpr RawFormatNames bayer(int bits, RawPacking packing, BayerPhase phase, Codes codes, std::uint64_t modifier,
                               std::string_view libcamera) {
  return {{bits, packing, SensorLayout::bayer, phase}, code_of(codes.v4l2), code_of(codes.drm), modifier, libcamera};
}

constexpr RawFormatNames mono(int bits, RawPacking packing, Codes codes, std::uint64_t modifier = linear,
                              std::string_view libcamera = {}) {
  return {{bits, packing, SensorLayout::monochrome, BayerPhase::rggb},
          code_of(codes.v4l2),
          code_of(codes.drm),
          modifier,
          libcamera};
}

constexpr RawFormatNames big_endian_y16() {
  RawFormatNames names = mono(16, RawPacking::big16, {"Y16 ", ""});
  names.v4l2_fourcc |= big_endian;
  return names;
}

using enum RawPacking;
using enum BayerPhase;

// V4L2 codes are from linux/videodev2.h (Y12P and Y14P in newer ones), DRM codes and names from libcamera's
// formats.yaml and drm_fourcc.h. The two agree up to 12 bits and differ above: RG16 is raw in V4L2 and RGB565 in DRM.
constexpr std::array formats{
    bayer(8, byte, bggr, {"BA81", "BA81"}, linear, "SBGGR8"),
    bayer(8, byte, gbrg, {"GBRG", "GBRG"}, linear, "SGBRG8"),
    bayer(8, byte, grbg, {"GRBG", "GRBG"}, linear, "SGRBG8"),
    bayer(8, byte, rggb, {"RGGB", "RGGB"}, linear, "SRGGB8"),
    bayer(10, little16, bggr, {"BG10", "BG10"}, linear, "SBGGR10"),
    bayer(10, little16, gbrg, {"GB10", "GB10"}, linear, "SGBRG10"),
    bayer(10, little16, grbg, {"BA10", "BA10"}, linear, "SGRBG10"),
    bayer(10, little16, rggb, {"RG10", "RG10"}, linear, "SRGGB10"),
    bayer(10, csi2, bggr, {"pBAA", "BG10"}, mipi, "SBGGR10_CSI2P"),
    bayer(10, csi2, gbrg, {"pGAA", "GB10"}, mipi, "SGBRG10_CSI2P"),
    bayer(10, csi2, grbg, {"pgAA", "BA10"}, mipi, "SGRBG10_CSI2P"),
    bayer(10, csi2, rggb, {"pRAA", "RG10"}, mipi, "SRGGB10_CSI2P"),
    bayer(12, little16, bggr, {"BG12", "BG12"}, linear, "SBGGR12"),
    bayer(12, little16, gbrg, {"GB12", "GB12"}, linear, "SGBRG12"),
    bayer(12, little16, grbg, {"BA12", "BA12"}, linear, "SGRBG12"),
    bayer(12, little16, rggb, {"RG12", "RG12"}, linear, "SRGGB12"),
    bayer(12, csi2, bggr, {"pBCC", "BG12"}, mipi, "SBGGR12_CSI2P"),
    bayer(12, csi2, gbrg, {"pGCC", "GB12"}, mipi, "SGBRG12_CSI2P"),
    bayer(12, csi2, grbg, {"pgCC", "BA12"}, mipi, "SGRBG12_CSI2P"),
    bayer(12, csi2, rggb, {"pRCC", "RG12"}, mipi, "SRGGB12_CSI2P"),
    bayer(14, little16, bggr, {"BG14", "BG14"}, linear, "SBGGR14"),
    bayer(14, little16, gbrg, {"GB14", "GB14"}, linear, "SGBRG14"),
    bayer(14, little16, grbg, {"GR14", "BA14"}, linear, "SGRBG14"),
    bayer(14, little16, rggb, {"RG14", "RG14"}, linear, "SRGGB14"),
    bayer(14, csi2, bggr, {"pBEE", "BG14"}, mipi, "SBGGR14_CSI2P"),
    bayer(14, csi2, gbrg, {"pGEE", "GB14"}, mipi, "SGBRG14_CSI2P"),
    bayer(14, csi2, grbg, {"pgEE", "BA14"}, mipi, "SGRBG14_CSI2P"),
    bayer(14, csi2, rggb, {"pREE", "RG14"}, mipi, "SRGGB14_CSI2P"),
    bayer(16, little16, bggr, {"BYR2", "BYR2"}, linear, "SBGGR16"),
    bayer(16, little16, gbrg, {"GB16", "GB16"}, linear, "SGBRG16"),
    bayer(16, little16, grbg, {"GR16", "GR16"}, linear, "SGRBG16"),
    bayer(16, little16, rggb, {"RG16", "RGB6"}, linear, "SRGGB16"),
    bayer(10, ipu3, bggr, {"ip3b", "BG10"}, ipu3_packed, "SBGGR10_IPU3"),
    bayer(10, ipu3, gbrg, {"ip3g", "GB10"}, ipu3_packed, "SGBRG10_IPU3"),
    bayer(10, ipu3, grbg, {"ip3G", "BA10"}, ipu3_packed, "SGRBG10_IPU3"),
    bayer(10, ipu3, rggb, {"ip3r", "RG10"}, ipu3_packed, "SRGGB10_IPU3"),
    mono(8, byte, {"GREY", "R8  "}, linear, "R8"),
    mono(10, little16, {"Y10 ", "R10 "}, linear, "R10"),
    mono(10, csi2, {"Y10P", "R10 "}, mipi, "R10_CSI2P"),
    mono(10, bits_msb_first, {"Y10B", ""}),
    mono(12, little16, {"Y12 ", "R12 "}, linear, "R12"),
    mono(12, csi2, {"Y12P", "R12 "}, mipi, "R12_CSI2P"),
    mono(14, little16, {"Y14 ", ""}),
    mono(14, csi2, {"Y14P", ""}),
    mono(16, little16, {"Y16 ", "R16 "}, linear, "R16"),
    big_endian_y16(),
};

template <class Wanted>
const RawFormatNames* first_where(Wanted wanted) {
  const auto* const found = std::find_if(formats.begin(), formats.end(), wanted);
  return found == formats.end() ? nullptr : found;
}

std::optional<RawFormat> format_of(const RawFormatNames* names) {
  return names == nullptr ? std::nullopt : std::optional(names->format);
}

}  // namespace

std::span<const RawFormatNames> raw_formats() { return formats; }

std::optional<RawFormat> raw_format_of_v4l2(std::uint32_t code) {
  return format_of(first_where([code](const RawFormatNames& names) { return names.v4l2_fourcc == code; }));
}

std::optional<RawFormat> raw_format_of_drm(std::uint32_t code, std::uint64_t modifier) {
  if (code == 0) return std::nullopt;  // stands for "none" in the table
  return format_of(first_where([code, modifier](const RawFormatNames& names) {
    return names.drm_fourcc == code && names.drm_modifier == modifier;
  }));
}

const RawFormatNames* names_of(const RawFormat& format) {
  return first_where([&format](const RawFormatNames& names) { return names.format == format; });
}

RawGroup group_of(const RawFormat& format) {
  assert(format.bits >= 8 && format.bits <= 16);
  switch (format.packing) {
    case RawPacking::byte:
      return {1, 1};
    case RawPacking::little16:
    case RawPacking::big16:
      return {1, 2};
    case RawPacking::ipu3:
      return {25, 32};
    case RawPacking::csi2:
    case RawPacking::bits_msb_first:
      break;
  }
  const int common = std::gcd(format.bits, 8);  // the smallest number of samples that fills complete bytes
  return {8 / common, format.bits / common};
}

std::size_t row_bytes(const RawFormat& format, int width) {
  if (width <= 0) return 0;
  const RawGroup group = group_of(format);
  const auto pixels = static_cast<std::size_t>(group.pixels);
  return (static_cast<std::size_t>(width) + pixels - 1) / pixels * static_cast<std::size_t>(group.bytes);
}

std::string v4l2_text(std::uint32_t code) {
  std::string text;
  for (int byte = 0; byte < 4; ++byte) {
    const auto c = static_cast<char>((code & ~big_endian) >> (8 * byte) & 0xFF);
    text += c >= ' ' && c <= '~' ? c : '?';
  }
  text.erase(text.find_last_not_of(' ') + 1);
  return (code & big_endian) != 0 ? text + "-BE" : text;
}

std::string text_of(const RawFormat& format) {
  const RawFormatNames* const names = names_of(format);
  if (names == nullptr) return "";
  return names->libcamera.empty() ? v4l2_text(names->v4l2_fourcc) : std::string(names->libcamera);
}

void unpack_row(const RawFormat& format, const std::byte* in, int width, std::uint16_t* out) {
  assert(names_of(format) != nullptr);
  if (width <= 0) return;
  const auto* const bytes = reinterpret_cast<const std::uint8_t*>(in);
  const auto count = static_cast<std::size_t>(width);
  switch (format.packing) {
    case RawPacking::byte:
      return unpack_rows::put_bytes(bytes, count, out);
    case RawPacking::little16:
      return unpack_rows::put_little16(bytes, count, out);
    case RawPacking::big16:
      return unpack_rows::put_big16(bytes, count, out);
    case RawPacking::ipu3:
      return unpack_rows::put_ipu3(bytes, count, out);
    case RawPacking::bits_msb_first:
      return unpack_rows::put_msb_first_10(bytes, count, out);
    case RawPacking::csi2:
      if (format.bits == 10) return unpack_rows::put_csi2_10(bytes, count, out);
      if (format.bits == 12) return unpack_rows::put_csi2_12(bytes, count, out);
      return unpack_rows::put_csi2_14(bytes, count, out);
  }
}

const char* unpack_target() { return unpack_rows::target_name(); }

}  // namespace lowlux
