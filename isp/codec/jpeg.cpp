#include "isp/codec/jpeg.h"

// jpeglib.h needs FILE and size_t declared before it, and its error codes are in a separate header.
#include <jpeglib.h>

#include <jerror.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csetjmp>
#include <cstdlib>
#include <new>
#include <string_view>
#include <vector>

// libjpeg leaves a failed call by longjmp from error_exit. Every function below that calls setjmp has only trivial
// locals and calls nothing but libjpeg, so that no destructor is skipped; all memory is owned by their callers.

namespace lowlux::isp {
namespace {

constexpr std::string_view exif_prefix{"Exif\0\0", 6};
constexpr std::size_t max_segment = 65533;
constexpr int max_scans = 100;  // a progressive file of many tiny scans would take unbounded time

struct Failure {
  jpeg_error_mgr manager{};  // first member, so that libjpeg's pointer to it is also a pointer to Failure
  std::jmp_buf jump{};
  std::array<char, JMSG_LENGTH_MAX> message{};
};

[[noreturn]] void leave(j_common_ptr codec) {
  auto* failure = reinterpret_cast<Failure*>(codec->err);
  codec->err->format_message(codec, failure->message.data());
  std::longjmp(failure->jump, 1);
}

/// Fails on warnings (level -1), which mean damaged data, except stray bytes between segments, which cameras do write.
void judge_message(j_common_ptr codec, int level) {
  if (level < 0 && codec->err->msg_code != JWRN_EXTRANEOUS_DATA) leave(codec);
}

void print_nothing(j_common_ptr /*codec*/) {}

void count_scans(j_common_ptr codec) {
  if (codec->is_decompressor == 0) return;
  if (reinterpret_cast<j_decompress_ptr>(codec)->input_scan_number > max_scans) {
    codec->err->msg_code = JERR_BAD_PROGRESSION;
    leave(codec);
  }
}

jpeg_error_mgr* install(Failure& failure) {
  jpeg_std_error(&failure.manager);
  failure.manager.error_exit = leave;
  failure.manager.emit_message = judge_message;
  failure.manager.output_message = print_nothing;
  return &failure.manager;
}

struct Compressor {
  jpeg_compress_struct jpeg{};
  Failure failure;
  Compressor() { jpeg.err = install(failure); }
  ~Compressor() { jpeg_destroy_compress(&jpeg); }
  Compressor(const Compressor&) = delete;
  Compressor& operator=(const Compressor&) = delete;
};

struct Decompressor {
  jpeg_decompress_struct jpeg{};
  jpeg_progress_mgr progress{};
  Failure failure;
  Decompressor() {
    jpeg.err = install(failure);
    progress.progress_monitor = count_scans;
  }
  ~Decompressor() { jpeg_destroy_decompress(&jpeg); }
  Decompressor(const Decompressor&) = delete;
  Decompressor& operator=(const Decompressor&) = delete;
};

struct Segments {
  const JOCTET* exif = nullptr;  // with its prefix
  std::size_t exif_size = 0;
  const JOCTET* icc = nullptr;
  std::size_t icc_size = 0;
};

void set_parameters(jpeg_compress_struct* jpeg, PlaneView<const std::uint8_t> codes, const JpegOptions& options) {
  jpeg->image_width = static_cast<JDIMENSION>(codes.width / 3);
  jpeg->image_height = static_cast<JDIMENSION>(codes.height);
  jpeg->input_components = 3;
  jpeg->in_color_space = JCS_RGB;
  jpeg_set_defaults(jpeg);
  jpeg_set_quality(jpeg, options.quality, TRUE);
  const int factor = options.chroma == JpegOptions::Chroma::half ? 2 : 1;
  jpeg->comp_info[0].h_samp_factor = factor;
  jpeg->comp_info[0].v_samp_factor = factor;
}

bool compress(Compressor* compressor, PlaneView<const std::uint8_t> codes, const Segments* segments,
              const JpegOptions* options, std::FILE* file) {
  if (setjmp(compressor->failure.jump)) return false;
  jpeg_compress_struct* jpeg = &compressor->jpeg;
  jpeg_create_compress(jpeg);
  jpeg_stdio_dest(jpeg, file);
  set_parameters(jpeg, codes, *options);
  jpeg_start_compress(jpeg, TRUE);
  if (segments->exif_size > 0) {
    jpeg_write_marker(jpeg, JPEG_APP0 + 1, segments->exif, static_cast<unsigned>(segments->exif_size));
  }
  if (segments->icc_size > 0) {
    jpeg_write_icc_profile(jpeg, segments->icc, static_cast<unsigned>(segments->icc_size));
  }
  while (jpeg->next_scanline < jpeg->image_height) {
    // libjpeg's interface is not const-correct; it only reads these rows.
    auto* row = const_cast<JSAMPROW>(codes.row(static_cast<int>(jpeg->next_scanline)));
    jpeg_write_scanlines(jpeg, &row, 1);
  }
  jpeg_finish_compress(jpeg);
  return true;
}

bool read_header(Decompressor* decompressor, const unsigned char* bytes, unsigned long size) {
  if (setjmp(decompressor->failure.jump)) return false;
  jpeg_decompress_struct* jpeg = &decompressor->jpeg;
  jpeg_create_decompress(jpeg);
  jpeg->progress = &decompressor->progress;
  jpeg_mem_src(jpeg, bytes, size);
  jpeg_save_markers(jpeg, JPEG_APP0 + 1, 0xFFFF);
  jpeg_save_markers(jpeg, JPEG_APP0 + 2, 0xFFFF);
  jpeg_read_header(jpeg, TRUE);
  return true;
}

bool read_rows(Decompressor* decompressor, PlaneView<std::uint8_t> codes) {
  if (setjmp(decompressor->failure.jump)) return false;
  jpeg_decompress_struct* jpeg = &decompressor->jpeg;
  jpeg->out_color_space = JCS_RGB;
  jpeg_start_decompress(jpeg);
  while (jpeg->output_scanline < jpeg->output_height) {
    JSAMPROW row = codes.row(static_cast<int>(jpeg->output_scanline));
    jpeg_read_scanlines(jpeg, &row, 1);
  }
  jpeg_finish_decompress(jpeg);
  return true;
}

/// Joins the profile's segments into `bytes` (malloc) of `size`; null if there is none.
bool read_profile(Decompressor* decompressor, JOCTET** bytes, unsigned* size) {
  if (setjmp(decompressor->failure.jump)) return false;
  return jpeg_read_icc_profile(&decompressor->jpeg, bytes, size) != 0;
}

FileMetadata metadata_of(Decompressor& decompressor) {
  FileMetadata metadata;
  for (const auto* marker = decompressor.jpeg.marker_list; marker != nullptr; marker = marker->next) {
    const auto* data = reinterpret_cast<const std::byte*>(marker->data);
    const std::string_view text(reinterpret_cast<const char*>(marker->data), marker->data_length);
    if (marker->marker == JPEG_APP0 + 1 && metadata.exif.empty() && text.starts_with(exif_prefix)) {
      metadata.exif.assign(data + exif_prefix.size(), data + marker->data_length);
    }
  }
  JOCTET* profile = nullptr;
  unsigned size = 0;
  if (read_profile(&decompressor, &profile, &size)) {
    const auto* first = reinterpret_cast<const std::byte*>(profile);
    metadata.icc.assign(first, first + size);
  }
  std::free(profile);
  return metadata;
}

tl::unexpected<Error> malformed(const Failure& failure) { return not_readable("JPEG", failure.message.data()); }

Result<void> check_encodable(const Encoded8& picture, const FileMetadata& metadata, const JpegOptions& options) {
  if (picture.width() < 1 || picture.height() < 1 || picture.width() > JPEG_MAX_DIMENSION ||
      picture.height() > JPEG_MAX_DIMENSION) {
    return fail(ErrorCode::unsupported, "a JPEG has 1 to 65500 pixels per side, the image is " +
                                            std::to_string(picture.width()) + " x " + std::to_string(picture.height()) +
                                            ": choose .png, .tif or .exr");
  }
  if (options.quality < 1 || options.quality > 100) {
    return fail(ErrorCode::invalid_argument,
                "the JPEG quality is " + std::to_string(options.quality) + ", it must be 1 to 100");
  }
  if (metadata.exif.size() > max_segment - exif_prefix.size()) {
    return fail(ErrorCode::unsupported,
                "the EXIF block has " + std::to_string(metadata.exif.size()) + " bytes, a JPEG holds 65527");
  }
  return {};
}

}  // namespace

Result<void> encode_jpeg(const Encoded8& picture, const FileMetadata& metadata, const JpegOptions& options,
                         std::FILE* file) {
  if (auto possible = check_encodable(picture, metadata, options); !possible) return possible;
  std::vector<JOCTET> exif;
  if (!metadata.exif.empty()) {
    exif.assign(exif_prefix.begin(), exif_prefix.end());
    for (const std::byte byte : metadata.exif) exif.push_back(std::to_integer<JOCTET>(byte));
  }
  const Segments segments{exif.data(), exif.size(), reinterpret_cast<const JOCTET*>(metadata.icc.data()),
                          metadata.icc.size()};
  Compressor compressor;
  errno = 0;
  if (compress(&compressor, picture.codes.view(), &segments, &options, file)) return {};
  if (compressor.failure.manager.msg_code == JERR_FILE_WRITE) return write_failure();
  return fail(ErrorCode::unwritable, std::string("libjpeg: ") + compressor.failure.message.data());
}

Result<DecodedPicture> decode_jpeg(std::span<const std::byte> bytes, const DecodeLimits& limits) try {
  Decompressor decompressor;
  if (!read_header(&decompressor, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size())) {
    return malformed(decompressor.failure);
  }
  const auto& jpeg = decompressor.jpeg;
  if (auto size = check_size(jpeg.image_width, jpeg.image_height, limits); !size) {
    return tl::make_unexpected(size.error());
  }
  if (jpeg.jpeg_color_space == JCS_CMYK || jpeg.jpeg_color_space == JCS_YCCK || jpeg.jpeg_color_space == JCS_UNKNOWN) {
    return fail(ErrorCode::unsupported, "the JPEG is not grey or RGB (CMYK?): convert it to RGB first");
  }
  FileMetadata metadata = metadata_of(decompressor);  // before libjpeg discards the segments after the last row
  Encoded8 picture{Plane<std::uint8_t>(static_cast<int>(3 * jpeg.image_width), static_cast<int>(jpeg.image_height))};
  if (!read_rows(&decompressor, picture.codes.view())) return malformed(decompressor.failure);
  return DecodedPicture{std::move(picture), std::move(metadata)};
} catch (const std::bad_alloc&) {
  return fail(ErrorCode::too_large, "no memory for the pixels of the JPEG");
}

}  // namespace lowlux::isp
