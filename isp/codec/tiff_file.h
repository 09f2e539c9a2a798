#pragma once

#include <cstdarg>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>

#include "isp/base/frame.h"
#include "isp/base/result.h"

struct tiff;  // libtiff's open file

namespace lowlux::isp {

/// Sets the approximate number of bytes of pixels in one strip.
inline constexpr std::size_t tiff_strip_bytes = std::size_t{1} << 20;

/// Limits the bytes of pixels in a file with offsets of 32 bits, with space for its directories.
inline constexpr std::uint64_t tiff_classic_limit = 3'900'000'000;

/// Writes a TIFF by libtiff to a stream of the caller. Messages of libtiff are kept, not printed.
class TiffOutput {
 public:
  /// Opens a TIFF for writing.
  /// @param file open for reading and writing, at its start; it stays open
  /// @param big  offsets of 64 bits (BigTIFF)
  TiffOutput(std::FILE* file, bool big);
  TiffOutput(const TiffOutput&) = delete;
  TiffOutput& operator=(const TiffOutput&) = delete;
  ~TiffOutput();

  /// Returns libtiff's open file; nullptr if there was no memory, or after finish().
  tiff* handle() const;

  /// Makes libtiff write its last bytes, once. @param written whether all calls of the caller succeeded
  /// @return the first failure of the stream, else of libtiff
  Result<void> finish(bool written);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Keeps the first message of libtiff for one file, instead of printing it.
struct TiffMessages {
  std::string first_error;

  __attribute__((format(printf, 2, 0))) void keep(const char* format, std::va_list arguments) {
    if (!first_error.empty()) return;
    char line[200];
    std::vsnprintf(line, sizeof line, format, arguments);
    first_error = line;
  }
};

/// Writes an EXIF directory (exposure, aperture, focal length, sensitivity, temperature, time) and leaves `file` at a
/// new main directory. @return its offset in the file, for TIFFTAG_EXIFIFD; 0 if it could not be written
std::uint64_t write_tiff_exif(tiff* file, const FrameInfo& info);

/// Sets Make, Model, Software, DateTime and Orientation of the main directory.
void set_tiff_info(tiff* file, const FrameInfo& info);

/// Returns the information of both directories. Leaves `file` at its EXIF directory if it has one: call it last.
FrameInfo read_tiff_info(tiff* file);

}  // namespace lowlux::isp
