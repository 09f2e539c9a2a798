#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "isp/base/result.h"

namespace lowlux::capture {

/// Reads all bytes of a regular file. Errors name the file: it is missing, cannot be read, is not a regular file, or
/// has more than `max_bytes`.
Result<std::vector<std::byte>> read_file_bytes(const std::filesystem::path& file, std::uint64_t max_bytes);

/// Reads an open file, such as a pipe, to its end. Errors: it cannot be read, or has more than `max_bytes`, which is
/// found once they are read.
Result<std::vector<std::byte>> read_stream_bytes(int descriptor, std::uint64_t max_bytes);

/// Returns the error of a number of bytes over a limit.
tl::unexpected<Error> too_many_bytes(std::uint64_t bytes, std::uint64_t max_bytes);

}  // namespace lowlux::capture
