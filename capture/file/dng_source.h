#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "capture/decoder/decoded_raw.h"
#include "capture/x_trans/x_trans_frame.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"

namespace lowlux::capture {

/// Reads a raw file: a DNG, or any other raw that LibRaw decodes. Values that the file does not state stay absent.
/// LibRaw runs in a process of its own, so a file that crashes it or makes it run too long is an Error here.
/// @param x_trans_use  sees X-Trans mosaics before they are interpolated (use_mosaic)
Result<RawFrame> read_raw(const std::filesystem::path& file, const ReadLimits& limits = {},
                          const XTransUse& x_trans_use = {});

/// Reads a raw file from its bytes; errors refer to it as `name`.
Result<RawFrame> read_raw(std::span<const std::byte> bytes, const std::string& name, const ReadLimits& limits = {},
                          const XTransUse& x_trans_use = {});

}  // namespace lowlux::capture
