#pragma once

#include <cstddef>
#include <cstdio>
#include <span>

#include "isp/base/executor.h"
#include "isp/codec/picture_file.h"

namespace lowlux::isp {

/// Writes an 8- or 16-bit RGB PNG (PNG, third edition) with iCCP and eXIf chunks if `metadata` has them. Every row is
/// filtered with Average and compressed by runs and Huffman codes only (Z_RLE): on noisy photographs that is as small
/// as a full match search and many times faster (README). Blocks of rows of about 1 MB are compressed by the executor's
/// threads; the bytes written do not depend on their number.
Result<void> encode_png(const Encoded8& picture, const FileMetadata& metadata, Executor& executor, std::FILE* file);
Result<void> encode_png(const Encoded16& picture, const FileMetadata& metadata, Executor& executor, std::FILE* file);

/// Reads any PNG: Encoded16 from 16-bit files, Encoded8 from all others. Grey and palette become RGB; alpha and tRNS
/// are dropped, which leaves the colours unchanged, since PNG does not premultiply. Without a profile `metadata.icc` is
/// empty; gAMA, cHRM and sRGB chunks are not interpreted.
Result<DecodedPicture> decode_png(std::span<const std::byte> bytes, const DecodeLimits& limits = {});

}  // namespace lowlux::isp
