#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <span>

#include "isp/base/result.h"
#include "isp/codec/picture_file.h"

namespace lowlux::isp {

/// Holds the options of encode_exr().
struct ExrOptions {
  /// Half keeps 11 significant bits (1 part in 2048) from 6.1e-5 to 65504 and clamps larger values to +-65504: finer
  /// than the noise of any camera. Full keeps every float unchanged.
  enum class Depth : std::uint8_t { half, full } depth = Depth::half;
  /// PIZ is lossless: wavelets and Huffman codes. The README states its size and time on sensor noise.
  enum class Compression : std::uint8_t { none, piz } compression = Compression::none;
};

/// Writes scene-linear R, G, B channels. `metadata.chromaticities`, `white_luminance_cd_m2` if it is positive, the
/// exposure time, f-number, ISO, focal length, camera and time of `metadata.info`, and of its source tags caption,
/// author, copyright, lens, serial numbers and place become attributes; an OpenEXR file cannot hold an ICC profile.
/// @param file open for writing, at its start
Result<void> encode_exr(const SceneLinear& picture, const FileMetadata& metadata, const ExrOptions& options,
                        std::FILE* file);

/// Reads the data window of the channels R, G, B, or of Y as grey, whatever their type; other channels, including
/// alpha, are dropped. Deep files, multi-part files, subsampled colour and files without these channels are errors.
Result<DecodedPicture> decode_exr(std::span<const std::byte> bytes, const DecodeLimits& limits = {});

/// Checks the attributes of an OpenEXR header without trusting any size in it: OpenEXR itself allocates the memory an
/// attribute asks for before it finds the file too short for it. An error unless every attribute, and every string and
/// preview inside one, ends within the file. Multi-part files and deep files are errors.
Result<void> check_exr_header(std::span<const std::byte> bytes);

}  // namespace lowlux::isp
