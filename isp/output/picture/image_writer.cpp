#include "isp/output/picture/image_writer.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <span>
#include <string_view>
#include <utility>

#include "isp/base/text.h"
#include "isp/codec/pfm.h"
#include "isp/codec/png.h"
#include "isp/codec/source_tags_output.h"
#include "isp/output/picture/icc.h"
#include "isp/output/picture/metadata.h"
#include "isp/output/stream_copy.h"

namespace lowlux::isp {
namespace {

struct Extension {
  std::string_view text;
  FileFormat format;
};
constexpr std::array<Extension, 7> extensions{{{".png", FileFormat::png},
                                               {".jpg", FileFormat::jpeg},
                                               {".jpeg", FileFormat::jpeg},
                                               {".tif", FileFormat::tiff},
                                               {".tiff", FileFormat::tiff},
                                               {".exr", FileFormat::exr},
                                               {".pfm", FileFormat::pfm}}};

const char* name_of(FileFormat format) {
  switch (format) {
    case FileFormat::png:
      return "PNG";
    case FileFormat::jpeg:
      return "JPEG";
    case FileFormat::tiff:
      return "TIFF";
    case FileFormat::exr:
      return "OpenEXR";
    case FileFormat::pfm:
      break;
  }
  return "PFM";
}

const char* name_of(SampleType type) {
  switch (type) {
    case SampleType::u8:
      return "8-bit";
    case SampleType::u16:
      return "16-bit";
    case SampleType::f32:
      break;
  }
  return "float";
}

const char* samples_held(FileFormat format) {
  switch (format) {
    case FileFormat::png:
      return "8 or 16 bits";
    case FileFormat::jpeg:
      return "8 bits";
    case FileFormat::tiff:
      return "8 or 16 bits or floats";
    case FileFormat::exr:
    case FileFormat::pfm:
      break;
  }
  return "floats";
}

int width_of(const Picture& picture) {
  return std::visit([](const auto& image) { return image.width(); }, picture);
}
int height_of(const Picture& picture) {
  return std::visit([](const auto& image) { return image.height(); }, picture);
}

FileMetadata metadata_for(const Picture& picture, OutputSpace space, const FrameInfo& info, const WriteOptions& o) {
  FileMetadata metadata;
  metadata.icc = icc_profile(space);
  if (o.source_tags) metadata.source_tags = std::make_shared<const SourceTags>(picture_tags(*o.source_tags));
  metadata.exif =
      exif_block(info, {width_of(picture), height_of(picture), space, o.software, metadata.source_tags.get()});
  metadata.info = written_info(info, o.software);
  metadata.chromaticities = chromaticities_of(space);
  metadata.white_luminance_cd_m2 = o.white_luminance_cd_m2;
  return metadata;
}

Result<void> encode(const Picture& picture, FileFormat format, const FileMetadata& metadata, const WriteOptions& o,
                    Executor& executor, std::FILE* file) {
  switch (format) {
    case FileFormat::png:
      if (const auto* codes = std::get_if<Encoded8>(&picture)) return encode_png(*codes, metadata, executor, file);
      return encode_png(std::get<Encoded16>(picture), metadata, executor, file);
    case FileFormat::jpeg:
      return encode_jpeg(std::get<Encoded8>(picture), metadata, o.jpeg, file);
    case FileFormat::tiff:
      return encode_tiff(picture, metadata, o.tiff, file);
    case FileFormat::exr:
      return encode_exr(std::get<SceneLinear>(picture), metadata, o.exr, file);
    case FileFormat::pfm:
      break;
  }
  return encode_pfm(std::get<SceneLinear>(picture), file);
}

}  // namespace

SampleType sample_type(const Picture& picture) { return static_cast<SampleType>(picture.index()); }
static_assert(std::is_same_v<std::variant_alternative_t<0, Picture>, Encoded8>);
static_assert(std::is_same_v<std::variant_alternative_t<1, Picture>, Encoded16>);
static_assert(std::is_same_v<std::variant_alternative_t<2, Picture>, SceneLinear>);

Result<FileFormat> format_of(const std::string& path) {
  const std::size_t name = path.rfind('/') == std::string::npos ? 0 : path.rfind('/') + 1;
  const std::size_t dot = path.rfind('.');
  std::string ending = dot == std::string::npos || dot <= name ? "" : path.substr(dot);
  std::transform(ending.begin(), ending.end(), ending.begin(), ascii_lower);
  for (const Extension& known : extensions) {
    if (ending == known.text) return known.format;
  }
  return fail(ErrorCode::invalid_argument,
              "cannot find the format of " + path + ": name it .png, .jpg, .jpeg, .tif, .tiff, .exr or .pfm", path);
}

bool supported(FileFormat format, SampleType type) {
  switch (format) {
    case FileFormat::png:
      return type != SampleType::f32;
    case FileFormat::jpeg:
      return type == SampleType::u8;
    case FileFormat::tiff:
      return true;
    case FileFormat::exr:
    case FileFormat::pfm:
      break;
  }
  return type == SampleType::f32;
}

Result<void> check_writable(FileFormat format, SampleType type, OutputSpace space) {
  if (!supported(format, type)) {
    return fail(ErrorCode::invalid_argument, std::string(name_of(format)) + " files hold " + samples_held(format) +
                                                 ", the image is " + name_of(type));
  }
  if (type == SampleType::f32 && !is_linear(space)) {
    return fail(ErrorCode::invalid_argument,
                "float images are scene-linear: choose a linear space (linear-srgb, linear-rec2020, xyz, camera)");
  }
  return {};
}

Result<void> write_picture(const Picture& picture, OutputSpace space, const FrameInfo& info, const std::string& path,
                           const WriteOptions& options, Executor& executor) {
  return prepare_picture(picture, space, info, path, options, executor).and_then([](AtomicFile out) {
    return out.commit();
  });
}

Result<AtomicFile> prepare_picture(const Picture& picture, OutputSpace space, const FrameInfo& info,
                                   const std::string& path, const WriteOptions& options, Executor& executor) {
  const auto located = [&](Error error) {
    if (error.where.empty()) error = Error{error.code, "cannot write " + path + ": " + error.message, path};
    return error;
  };
  const auto format = format_of(path);
  if (!format) return tl::make_unexpected(format.error());
  return check_writable(*format, sample_type(picture), space)
      .and_then([&] { return AtomicFile::create(path, options.overwrite, options.sync); })
      .and_then([&](AtomicFile out) {
        return encode(picture, *format, metadata_for(picture, space, info, options), options, executor, out.file())
            .map([&] { return std::move(out); });
      })
      .map_error(located);
}

Result<void> write_picture(const Picture& picture, OutputSpace space, const FrameInfo& info, FileFormat format,
                           int descriptor, const WriteOptions& options, Executor& executor) {
  return check_writable(format, sample_type(picture), space).and_then([&] {
    return write_to_stream(descriptor, [&](std::FILE* file) {
      return encode(picture, format, metadata_for(picture, space, info, options), options, executor, file);
    });
  });
}

Result<std::vector<std::byte>> png_bytes(const Encoded8& picture, OutputSpace space, Executor& executor) {
  char* bytes = nullptr;
  std::size_t size = 0;
  std::FILE* const file = open_memstream(&bytes, &size);
  if (file == nullptr) return fail(ErrorCode::too_large, "no memory for the image's file");
  FileMetadata metadata;
  metadata.icc = icc_profile(space);
  const Result<void> written = encode_png(picture, metadata, executor, file);
  const bool whole = std::fclose(file) == 0;  // `bytes` is complete only after fclose
  const std::unique_ptr<char, decltype(&std::free)> owned(bytes, std::free);
  if (!written) return tl::make_unexpected(written.error());
  if (!whole) return fail(ErrorCode::too_large, "no memory for the image's file");
  const auto all = std::as_bytes(std::span(owned.get(), size));
  return std::vector<std::byte>(all.begin(), all.end());
}

}  // namespace lowlux::isp
