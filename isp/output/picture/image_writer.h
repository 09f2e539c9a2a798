#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/image.h"
#include "isp/base/result.h"
#include "isp/base/source_tags.h"
#include "isp/codec/exr.h"
#include "isp/codec/jpeg.h"
#include "isp/codec/tiff.h"
#include "isp/output/atomic_file.h"

namespace lowlux::isp {

enum class FileFormat : std::uint8_t { png, jpeg, tiff, exr, pfm };

SampleType sample_type(const Picture& picture);

/// Returns the format by the file extension, in any case: .png .jpg .jpeg .tif .tiff .exr .pfm; others are an error
/// that lists these.
Result<FileFormat> format_of(const std::string& path);

/// Returns whether a format holds a sample type. PNG: u8, u16. JPEG: u8. TIFF: all. OpenEXR, PFM: f32.
bool supported(FileFormat format, SampleType type);

/// Checks in advance that the format holds the samples, and that floats are scene-linear.
Result<void> check_writable(FileFormat format, SampleType type, OutputSpace space);

/// Holds the options of write_picture().
struct WriteOptions {
  Overwrite overwrite = Overwrite::no;
  Sync sync = Sync::no;
  std::string software = "lowlux";                // with its version, for the metadata
  std::shared_ptr<const SourceTags> source_tags;  // tags of the raw file; picture_tags are added to EXIF; null: none
  std::optional<double> white_luminance_cd_m2;    // luminance of (1, 1, 1); OpenEXR keeps it
  JpegOptions jpeg;
  TiffOptions tiff;
  ExrOptions exr;
};

/// Writes the image completely or not at all, with the ICC profile or chromaticities of `space` and the exposure data
/// of `info`; PFM can hold neither. Pixels are written as stored: rotate them first (orient.h); the file states
/// orientation 1. The executor's threads compress PNG.
Result<void> write_picture(const Picture& picture, OutputSpace space, const FrameInfo& info, const std::string& path,
                           const WriteOptions& options, Executor& executor);

/// Writes the image as write_picture does, to a file that gets its name by AtomicFile::commit or commit_all.
Result<AtomicFile> prepare_picture(const Picture& picture, OutputSpace space, const FrameInfo& info,
                                   const std::string& path, const WriteOptions& options, Executor& executor);

/// Writes the image to a file descriptor that may be a pipe (write_to_stream); nothing is written if it cannot be
/// encoded.
Result<void> write_picture(const Picture& picture, OutputSpace space, const FrameInfo& info, FileFormat format,
                           int descriptor, const WriteOptions& options, Executor& executor);

/// Returns a PNG file in memory, with the ICC profile of `space`. Error: there is not enough memory; the size is
/// impossible.
Result<std::vector<std::byte>> png_bytes(const Encoded8& picture, OutputSpace space, Executor& executor);

}  // namespace lowlux::isp
