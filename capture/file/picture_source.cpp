#include "capture/file/picture_source.h"

#include <cmath>
#include <cstdint>
#include <new>
#include <optional>
#include <string_view>
#include <utility>
#include <variant>

#include "capture/dng/dng_info.h"
#include "capture/dng/dng_tags.h"
#include "capture/dng/source_tags.h"
#include "capture/file/file_bytes.h"
#include "capture/file/pass_on.h"
#include "capture/file/picture_colour.h"
#include "isp/base/text.h"
#include "isp/codec/exr.h"
#include "isp/codec/jpeg.h"
#include "isp/codec/pfm.h"
#include "isp/codec/png.h"
#include "isp/codec/ppm.h"
#include "isp/codec/tiff.h"
#include "isp/model/colour/colorimetry.h"

namespace lowlux::capture {
namespace {

constexpr std::uint64_t bytes_per_pixel = 16;  // four floats, the maximum for one pixel in a file
constexpr std::uint64_t bytes_of_metadata = std::uint64_t{64} << 20;
constexpr int curve_points = 1025;  // at which the curve of a profile for floats is compared with a straight line
constexpr float linear_tolerance = 1.0F / 65535;  // a 16-bit step, the precision of curves in profiles

using Decoder = Result<isp::DecodedPicture> (*)(std::span<const std::byte>, const isp::DecodeLimits&);

bool starts_with(std::span<const std::byte> bytes, std::string_view magic) {
  return std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()).starts_with(magic);
}

bool is_dng(const TiffDirectory& first) { return first.find(tag::dng_version) != nullptr; }

/// Returns whether the first image is a thumbnail, as stated in cameras' own raw files in TIFF's form (NEF, ARW).
bool is_thumbnail(const TiffDirectory& first) {
  const auto kind = first.whole(tag::new_subfile_type);
  return kind && *kind && (**kind & 1U) != 0;  // TIFF 6.0: a reduced version of another image of the file
}

Result<Decoder> tiff_decoder_of(std::span<const std::byte> bytes) {
  const auto tiff = TiffFile::open(bytes);
  if (!tiff) return isp::decode_tiff;
  const auto first = tiff->directory(tiff->first_directory());
  if (!first) return isp::decode_tiff;
  if (is_dng(*first)) {
    return fail(ErrorCode::unsupported, "this is a raw file (DNG), not an image: develop it first");
  }
  if (is_thumbnail(*first)) {
    return fail(ErrorCode::unsupported,
                "this file begins with a thumbnail, as raw files of cameras do (NEF, ARW): develop it first");
  }
  return isp::decode_tiff;
}

Result<Decoder> decoder_of(std::span<const std::byte> bytes) {
  using std::string_view_literals::operator""sv;
  if (bytes.empty()) return fail(ErrorCode::malformed, "the file is empty");
  if (starts_with(bytes, "\x89PNG\r\n\x1a\n"sv)) return isp::decode_png;
  if (starts_with(bytes, "\xFF\xD8\xFF"sv)) return isp::decode_jpeg;
  if (starts_with(bytes, "\x76\x2F\x31\x01"sv)) return isp::decode_exr;
  if (starts_with(bytes, "PF"sv) || starts_with(bytes, "Pf"sv)) return isp::decode_pfm;
  if (starts_with(bytes, "P5"sv) || starts_with(bytes, "P6"sv)) return isp::decode_ppm;
  for (const std::string_view magic : {"II\x2A\0"sv, "MM\0\x2A"sv, "II\x2B\0"sv, "MM\0\x2B"sv}) {
    if (starts_with(bytes, magic)) return tiff_decoder_of(bytes);
  }
  return fail(ErrorCode::unsupported,
              "lowlux does not read this format: convert it to PNG, JPEG, TIFF, OpenEXR, PFM or PPM");
}

/// Returns the orientation of the EXIF block, or of the format's own field if there is no block.
Orientation orientation_of(const isp::FileMetadata& metadata) {
  if (metadata.exif.empty()) return metadata.info.orientation;
  const auto tiff = TiffFile::open(metadata.exif);
  if (!tiff) return Orientation::normal;
  const auto directory = tiff->directory(tiff->first_directory());
  if (!directory) return Orientation::normal;
  const auto stated = directory->whole(tag::orientation);
  if (!stated || !*stated || **stated < 1 || **stated > 8) return Orientation::normal;
  return static_cast<Orientation>(**stated);
}

template <class Code>
Result<SceneLinear> light_of_display(const Encoded<Code>& picture, const isp::FileMetadata& metadata,
                                     Executor& executor) {
  constexpr int codes = 1 << (8 * sizeof(Code));
  auto colour = metadata.icc.empty() ? Result<DisplayColour>(srgb_colour(codes)) : icc_colour(metadata.icc, codes);
  if (!colour) return pass_on(colour);
  return light_of(picture, *colour, orientation_of(metadata), executor);
}

bool is_linear(const DisplayColour& colour) {
  for (const std::vector<float>& curve : colour.curve) {
    for (int i = 0; i < curve_points; ++i) {
      if (std::fabs(curve[i] - static_cast<float>(i) / (curve_points - 1)) > linear_tolerance) return false;
    }
  }
  return true;
}

Result<Matrix3> matrix_of_floats(const isp::FileMetadata& metadata) {
  if (metadata.chromaticities) return primaries_to_xyz(*metadata.chromaticities);
  if (metadata.icc.empty()) return *isp::rgb_to_xyz(isp::primaries_rec709);
  auto colour = icc_colour(metadata.icc, curve_points);
  if (!colour) return pass_on(colour);
  if (!is_linear(*colour)) {
    return fail(ErrorCode::unsupported,
                "the image has floats and an ICC profile with a curve: convert it to a linear profile");
  }
  return colour->to_xyz;
}

void read_luminance(const isp::FileMetadata& metadata, ScenePicture& scene) {
  if (!metadata.white_luminance_cd_m2) return;
  const double stated = *metadata.white_luminance_cd_m2;
  if (std::isfinite(stated) && stated > 0) {
    scene.absolute = true;
    scene.white_luminance_cd_m2 = stated;
  } else {
    scene.warnings.push_back("whiteLuminance says " + number_text(stated) + " cd/m2, which is not used");
  }
}

Result<SceneLinear> light_of_picture(const isp::DecodedPicture& decoded, Executor& executor, Negatives negatives,
                                     std::vector<std::string>& warnings) {
  const isp::FileMetadata& metadata = decoded.metadata;
  if (const auto* codes = std::get_if<Encoded8>(&decoded.picture)) return light_of_display(*codes, metadata, executor);
  if (const auto* codes = std::get_if<Encoded16>(&decoded.picture)) return light_of_display(*codes, metadata, executor);
  auto matrix = matrix_of_floats(metadata);
  if (!matrix) return pass_on(matrix);
  return light_of(std::get<SceneLinear>(decoded.picture), *matrix, orientation_of(metadata), executor, warnings,
                  negatives);
}

/// Reads what the file states of camera, exposure, author, lens and place: from its EXIF block, or as a TIFF.
void read_metadata(std::span<const std::byte> file, const isp::FileMetadata& metadata, ScenePicture& scene) {
  scene.info = metadata.info;
  const std::span<const std::byte> block = metadata.exif.empty() ? file : std::span(metadata.exif);
  const auto tiff = TiffFile::open(block);
  if (!tiff) return;
  auto main = tiff->directory(tiff->first_directory());
  if (!main) return;
  scene.source_tags = raw_source_tags(block, scene.warnings);
  std::optional<TiffDirectory> exif;
  if (const auto offset = main->whole(tag::exif_ifd); offset && *offset) {
    if (auto directory = tiff->directory(**offset)) exif = *std::move(directory);
  }
  scene.info = read_info({.main = *std::move(main), .exif = std::move(exif)});
}

Result<ScenePicture> read_bytes(std::span<const std::byte> bytes, Executor& executor, const isp::DecodeLimits& limits,
                                Negatives negatives) {
  auto decode = decoder_of(bytes);
  if (!decode) return pass_on(decode);
  auto decoded = (*decode)(bytes, limits);
  if (!decoded) return pass_on(decoded);
  ScenePicture scene;
  auto xyz = light_of_picture(*decoded, executor, negatives, scene.warnings);
  if (!xyz) return pass_on(xyz);
  scene.xyz = *std::move(xyz);
  read_luminance(decoded->metadata, scene);
  read_metadata(bytes, decoded->metadata, scene);
  return scene;
}

}  // namespace

Result<ScenePicture> read_picture(const std::string& path, Executor& executor, const isp::DecodeLimits& limits,
                                  Negatives negatives) try {
  const auto pixels = static_cast<std::uint64_t>(limits.max_pixels);
  auto bytes = read_file_bytes(path, bytes_per_pixel * pixels + bytes_of_metadata);
  if (!bytes) return pass_on(bytes);
  return read_picture(*bytes, path, executor, limits, negatives);
} catch (const std::bad_alloc&) {
  return fail(ErrorCode::too_large, "there is not enough memory for this file", path);
}

Result<ScenePicture> read_picture(std::span<const std::byte> bytes, const std::string& name, Executor& executor,
                                  const isp::DecodeLimits& limits, Negatives negatives) try {
  auto scene = read_bytes(bytes, executor, limits, negatives);
  if (!scene) scene.error().where = name;
  return scene;
} catch (const std::bad_alloc&) {
  return fail(ErrorCode::too_large, "there is not enough memory for this file", name);
}

}  // namespace lowlux::capture
