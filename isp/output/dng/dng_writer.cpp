#include "isp/output/dng/dng_writer.h"

#include <tiffio.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <new>
#include <utility>
#include <vector>

#include "isp/base/text.h"
#include "isp/codec/lossless_jpeg.h"
#include "isp/codec/source_tags_output.h"
#include "isp/codec/tiff_file.h"
#include "isp/output/dng/dng_check.h"
#include "isp/output/dng/dng_tags.h"
#include "isp/output/picture/metadata.h"
#include "isp/output/stream_copy.h"

namespace lowlux::isp {
namespace {

constexpr std::size_t longest_description = 4000;
constexpr double max_baseline_exposure_ev = 100;
constexpr int photometric_linear_raw = 34892;  // DNG LinearRaw
constexpr int max_tile_side = 512;             // px

std::string unique_camera_model(const FrameInfo& info) {
  if (info.model.empty()) return info.make.empty() ? "Unknown" : info.make;
  if (info.make.empty() || info.model.starts_with(info.make)) return info.model;
  return info.make + " " + info.model;
}

/// Returns the number of rows in strips of about 1 MB.
int rows_per_strip(const RawDn& raw) {
  const std::size_t row_bytes = raw.sample_bytes() * raw.row_samples();
  return static_cast<int>(std::clamp<std::size_t>(tiff_strip_bytes / row_bytes, 1, raw.rows()));
}

/// Returns the width of tiles, a multiple of 16. LibRaw misreads tiles that are wider than the image, and takes two
/// tiles of two components each that are as wide as the image for one.
int tile_width(const RawDn& raw) {
  const int width = raw.row_samples() / samples_of(raw.layout);
  const int tile = std::clamp(width / 16 * 16, 16, max_tile_side);
  return raw.layout == SensorLayout::bayer && 2 * tile == width ? tile - 16 : tile;
}

void set_storage(TIFF* tiff, const RawDn& raw, DngCompression compression) {
  if (compression == DngCompression::none) {
    TIFFSetField(tiff, TIFFTAG_COMPRESSION, COMPRESSION_NONE);
    TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, rows_per_strip(raw));
    return;
  }
  TIFFSetField(tiff, TIFFTAG_COMPRESSION, raw.is_float() ? COMPRESSION_ADOBE_DEFLATE : COMPRESSION_JPEG);
  if (raw.is_float()) TIFFSetField(tiff, TIFFTAG_PREDICTOR, PREDICTOR_FLOATINGPOINT);
  TIFFSetField(tiff, TIFFTAG_TILEWIDTH, tile_width(raw));
  TIFFSetField(tiff, TIFFTAG_TILELENGTH, max_tile_side);
}

void set_image(TIFF* tiff, const RawDn& raw, DngCompression compression) {
  const int samples = samples_of(raw.layout);
  const bool mosaic = raw.layout == SensorLayout::bayer;
  TIFFSetField(tiff, TIFFTAG_SUBFILETYPE, 0);
  TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, raw.row_samples() / samples);
  TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, raw.rows());
  TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, static_cast<int>(8 * raw.sample_bytes()));
  if (raw.is_float()) TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_IEEEFP);
  TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, samples);
  TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, mosaic ? PHOTOMETRIC_CFA : photometric_linear_raw);
  TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
  set_storage(tiff, raw, compression);
  if (!mosaic) return;
  constexpr std::array<std::uint16_t, 2> cell{2, 2};
  constexpr std::array<std::uint8_t, 3> planes{0, 1, 2};  // R, G, B
  std::array<std::uint8_t, 4> colours{};
  for (int i = 0; i < 4; ++i) colours[i] = static_cast<std::uint8_t>(colour_at(raw.phase, i & 1, i >> 1));
  TIFFSetField(tiff, TIFFTAG_CFAREPEATPATTERNDIM, cell.data());
  TIFFSetField(tiff, TIFFTAG_CFAPATTERN, 4, colours.data());
  TIFFSetField(tiff, TIFFTAG_CFAPLANECOLOR, 3, planes.data());
  TIFFSetField(tiff, TIFFTAG_CFALAYOUT, 1);  // rectangular
}

double baseline_exposure_ev(const RawFrame& frame, const DngWriteOptions& options) {
  return options.baseline_exposure_ev + (frame.source_tags ? frame.source_tags->baseline_exposure_ev : 0);
}

/// Returns whether a tag belongs to the source's camera profile, which refers to its colour matrices. That of a
/// monochrome frame, which has none, stays.
bool is_of_profile(const SourceTag& tag) {
  constexpr std::array<std::uint16_t, 11> ids{50932, 50934, 50936, 50937, 50938, 50939,
                                              50940, 50981, 50982, 51107, 51108};
  return std::find(ids.begin(), ids.end(), tag.id) != ids.end();
}

Result<void> add_tags_of_source(std::FILE* file, const RawFrame& frame) {
  if (!frame.source_tags) return {};
  if (frame.colour.source == CameraColour::Source::file_tags || frame.raw.layout == SensorLayout::monochrome) {
    return add_source_tags(file, *frame.source_tags);
  }
  SourceTags tags = *frame.source_tags;
  std::erase_if(tags.main, is_of_profile);
  return add_source_tags(file, tags);
}

/// Returns the caption that the source has in its ImageDescription; empty if there is none or it is blank.
std::string caption_of(const RawFrame& frame) {
  if (!frame.source_tags) return {};
  std::string text = text_of(frame.source_tags->main, TIFFTAG_IMAGEDESCRIPTION);
  text.resize(text.find_last_not_of(' ') + 1);
  return text;
}

/// Returns the caption of the source, followed by the processing; empty where add_tags_of_source() is to write the
/// caption as it is.
std::string image_description(const RawFrame& frame, const DngWriteOptions& options) {
  const std::string caption = caption_of(frame), processing = printable_ascii(options.description, longest_description);
  if (caption.empty()) return processing;
  const bool is_there = caption.find(processing) != std::string::npos;  // the source was processed alike
  const bool fits = caption.size() + processing.size() < longest_description;
  return is_there || !fits ? std::string() : caption + "; " + processing;
}

/// Returns the bytes of a version of DNG: 1, 4, 0, 0 of 0x01040000.
std::array<std::uint8_t, 4> version_bytes(std::uint32_t version) {
  std::array<std::uint8_t, 4> bytes{};
  for (std::size_t i = 0; i < 4; ++i) bytes[i] = static_cast<std::uint8_t>(version >> (24 - 8 * i) & 255);
  return bytes;
}

void set_identity(TIFF* tiff, const RawFrame& frame, const FrameInfo& info, const DngWriteOptions& options) {
  // MaskedAreas came with 1.1; floating-point samples came with 1.4.
  const std::uint32_t needed =
      std::max({0x01010000U, frame.raw.is_float() ? 0x01040000U : 0U, opcodes_version(frame.corrections)});
  TIFFSetField(tiff, TIFFTAG_DNGVERSION, version_bytes(std::max(0x01040000U, needed)).data());
  TIFFSetField(tiff, TIFFTAG_DNGBACKWARDVERSION, version_bytes(needed).data());
  TIFFSetField(tiff, TIFFTAG_UNIQUECAMERAMODEL, unique_camera_model(info).c_str());
  set_tiff_info(tiff, info);
  // Blank tags mean unknown (EXIF 2.32, 4.6.5.4); RawSpeed, and with it darktable, requires them to be present.
  if (info.make.empty()) TIFFSetField(tiff, TIFFTAG_MAKE, "");
  if (info.model.empty()) TIFFSetField(tiff, TIFFTAG_MODEL, "");
  const std::string description = image_description(frame, options);
  if (!description.empty()) TIFFSetField(tiff, TIFFTAG_IMAGEDESCRIPTION, description.c_str());
}

template <class Sample>
bool write_strips(TIFF* tiff, const PlaneView<const Sample>& dn, int strip_rows) {
  std::uint32_t index = 0;
  for (int y = 0; y < dn.height; y += strip_rows, ++index) {
    const int rows = std::min(strip_rows, dn.height - y);
    const auto size = static_cast<tmsize_t>(sizeof(Sample) * dn.width * rows);
    // libtiff's interface is not const-correct; it only reads data that needs no change of byte order.
    auto* samples = const_cast<Sample*>(dn.row(y));
    if (TIFFWriteEncodedStrip(tiff, index, samples, size) != size) return false;
  }
  return true;
}

/// Copies the part of an image that a tile covers. What lies outside repeats the last pixels, which takes few bits.
template <class Sample>
void copy_tile(const PlaneView<const Sample>& dn, int x, int y, int components, const PlaneView<Sample>& tile) {
  const int width = std::min(tile.width, dn.width - x), height = std::min(tile.height, dn.height - y);
  for (int row = 0; row < height; ++row) {
    Sample* to = tile.row(row);
    std::copy_n(dn.row(y + row) + x, width, to);
    for (int i = width; i < tile.width; ++i) to[i] = to[std::max(i - components, 0)];
  }
  for (int row = height; row < tile.height; ++row) {
    const Sample* above = tile.row(row - 1);
    for (int i = 0; i < tile.width; ++i) tile.row(row)[i] = above[i % components];
  }
}

bool write_tile(TIFF* tiff, std::uint32_t index, PlaneView<float> tile, int /*components*/) {
  const tmsize_t size = TIFFTileSize(tiff);
  return TIFFWriteEncodedTile(tiff, index, tile.data, size) == size;
}

bool write_tile(TIFF* tiff, std::uint32_t index, const PlaneView<std::uint16_t>& tile, int components) {
  std::vector<std::byte> jpeg = encode_lossless_jpeg(tile, components);
  const auto size = static_cast<tmsize_t>(jpeg.size());
  return TIFFWriteRawTile(tiff, index, jpeg.data(), size) == size;
}

/// Writes compressed tiles. Rows of a mosaic are stored as two components of half the width, so that lossless JPEG
/// predicts samples from those of their own colour.
template <class Sample>
bool write_tiles(TIFF* tiff, const RawDn& raw, const PlaneView<const Sample>& dn) {
  const int samples = samples_of(raw.layout), components = raw.layout == SensorLayout::bayer ? 2 : samples;
  Plane<Sample> tile(tile_width(raw) * samples, max_tile_side);
  std::uint32_t index = 0;
  for (int y = 0; y < dn.height; y += tile.height()) {
    for (int x = 0; x < dn.width; x += tile.width(), ++index) {
      copy_tile(dn, x, y, components, tile.view());
      if (!write_tile(tiff, index, tile.view(), components)) return false;
    }
  }
  return true;
}

bool write_samples(TIFF* tiff, const RawDn& raw) {
  return with_samples(raw, [&](const auto& dn) {
    return TIFFIsTiled(tiff) != 0 ? write_tiles(tiff, raw, dn) : write_strips(tiff, dn, rows_per_strip(raw));
  });
}

/// Pads the file: dcraw and its descendants read 512 bytes where a description begins, and treat the end of the file as
/// an error.
Result<void> pad(std::FILE* file) {
  constexpr std::array<char, 512> zeros{};
  const bool padded = std::fseek(file, 0, SEEK_END) == 0 && std::fwrite(zeros.data(), zeros.size(), 1, file) == 1;
  if (!padded) return fail(ErrorCode::unwritable, "the file's end could not be written: is the disk full?");
  return {};
}

Result<void> encode(const RawFrame& frame, const DngWriteOptions& options, std::FILE* file) {
  FrameInfo info = written_info(frame.raw.info, options.software);
  info.orientation = frame.raw.info.orientation;
  TiffOutput output(file, false);
  TIFF* tiff = output.handle();
  if (tiff == nullptr) return output.finish(false);
  const std::uint64_t exif = write_tiff_exif(tiff, info);
  declare_dng_tags(tiff);
  set_image(tiff, frame.raw, options.compression);
  set_identity(tiff, frame, info, options);
  set_dng_levels(tiff, frame.raw);
  if (frame.raw.layout != SensorLayout::monochrome) set_dng_colour(tiff, frame.colour);
  TIFFSetField(tiff, TIFFTAG_BASELINEEXPOSURE, baseline_exposure_ev(frame, options));
  set_dng_noise_and_opcodes(tiff, frame);
  if (exif != 0) TIFFSetField(tiff, TIFFTAG_EXIFIFD, exif);
  const bool stored = write_samples(tiff, frame.raw);
  return output.finish(stored && TIFFWriteDirectory(tiff) != 0)
      .and_then([&] { return add_tags_of_source(file, frame); })
      .and_then([&] { return pad(file); });
}

Result<void> check_baseline_exposure(double ev) {
  if (std::fabs(ev) <= max_baseline_exposure_ev) return {};
  return fail(ErrorCode::invalid_argument,
              "a DNG cannot store this BaselineExposure: " + number_text(ev) + " EV, expected -100 to 100");
}

/// Returns an error if raw developers do not read frames of this size. LibRaw, and with it capture::read_raw for codes,
/// takes smaller ones for thumbnails, and refuses greater ones.
Result<void> check_sides(const RawDn& raw) {
  constexpr int min_side = 22, max_side = 64000, max_float_side = 65535;
  const int width = raw.row_samples() / samples_of(raw.layout), height = raw.rows();
  const int least = raw.is_float() ? 1 : min_side, most = raw.is_float() ? max_float_side : max_side;
  if (std::min(width, height) >= least && std::max(width, height) <= most) return {};
  return fail(ErrorCode::invalid_argument, "raw developers do not read a DNG of " + std::to_string(width) + " x " +
                                               std::to_string(height) + " pixels: expected " + std::to_string(least) +
                                               " to " + std::to_string(most) + " each way");
}

/// Returns the error of a frame or of options that no DNG can hold.
Result<void> check_all(const RawFrame& frame, const DngWriteOptions& options) {
  return check_dng_frame(frame)
      .and_then([&] { return check_sides(frame.raw); })
      .and_then([&] { return check_baseline_exposure(baseline_exposure_ev(frame, options)); })
      .and_then(
          [&] { return check_dng_size(static_cast<std::int64_t>(frame.raw.samples()), frame.raw.sample_bytes()); });
}

}  // namespace

Result<void> check_dng_size(std::int64_t samples, std::size_t sample_bytes) {
  const auto most = static_cast<std::int64_t>(tiff_classic_limit / sample_bytes);
  if (samples <= most) return {};
  return fail(ErrorCode::too_large, "a DNG holds " + std::to_string(most) + " samples of " +
                                        std::to_string(8 * sample_bytes) + " bits, the frame has " +
                                        std::to_string(samples) + ": crop it");
}

Result<void> write_dng(const RawFrame& frame, const std::string& path, const DngWriteOptions& options) {
  return prepare_dng(frame, path, options).and_then([](AtomicFile out) { return out.commit(); });
}

Result<AtomicFile> prepare_dng(const RawFrame& frame, const std::string& path, const DngWriteOptions& options) try {
  const auto located = [&](Error error) {
    if (error.where.empty()) error = Error{error.code, "cannot write " + path + ": " + error.message, path};
    return error;
  };
  return check_all(frame, options)
      .and_then([&] { return AtomicFile::create(path, options.overwrite, options.sync); })
      .and_then([&](AtomicFile out) { return encode(frame, options, out.file()).map([&] { return std::move(out); }); })
      .map_error(located);
} catch (const std::bad_alloc&) {
  return fail(ErrorCode::too_large, "cannot write " + path + ": there is not enough memory", path);
}

Result<void> write_dng(const RawFrame& frame, int descriptor, const DngWriteOptions& options) try {
  return check_all(frame, options).and_then([&] {
    return write_to_stream(descriptor, [&](std::FILE* file) { return encode(frame, options, file); });
  });
} catch (const std::bad_alloc&) {
  return fail(ErrorCode::too_large, "there is not enough memory");
}

}  // namespace lowlux::isp
