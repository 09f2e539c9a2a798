#pragma once

#include <cstdarg>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>

#include "isp/base/result.h"

struct tiff;  // libtiff's open file

namespace lowlux::isp {

/// Bytes of pixels in one strip, about.
inline constexpr std::size_t tiff_strip_bytes = std::size_t{1} << 20;

/// Bytes of pixels a file with offsets of 32 bits can hold, with room for its directories.
inline constexpr std::uint64_t tiff_classic_limit = 3'900'000'000;

/// A TIFF that libtiff writes to a stream of the caller's. Its complaints are kept, not printed.
class TiffOutput {
 public:
  /// @param file open for reading and writing, at its start; it stays open
  /// @param big  offsets of 64 bits (BigTIFF)
  TiffOutput(std::FILE* file, bool big);
  TiffOutput(const TiffOutput&) = delete;
  TiffOutput& operator=(const TiffOutput&) = delete;
  ~TiffOutput();

  /// nullptr if there was no memory, or after finish().
  tiff* handle() const;

  /// Lets libtiff write its last bytes, once. @param written whether all calls of the caller's succeeded
  /// @return the first failure of the stream, else of libtiff
  Result<void> finish(bool written);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Keeps the first message libtiff has for one file, instead of printing it.
struct TiffMessages {
  std::string first_error;

  __attribute__((format(printf, 2, 0))) void keep(const char* format, std::va_list arguments) {
    if (!first_error.empty()) return;
    char line[200];
    std::vsnprintf(line, sizeof line, format, arguments);
    first_error = line;
  }
};

}  // namespace lowlux::isp
