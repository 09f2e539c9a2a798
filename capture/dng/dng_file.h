#pragma once

#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "capture/dng/tiff_directory.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"

namespace lowlux::capture {

/// The directories of a DNG file that lowlux reads. They borrow the bytes of the file.
struct DngFile {
  TiffDirectory main;                     // the first directory
  std::vector<TiffDirectory> raw_images;  // full-size CFA or LinearRaw images, the largest first; never empty
  std::vector<TiffDirectory> previews;    // all other linked directories
  std::optional<TiffDirectory> exif;
  std::vector<std::string> warnings;  // one for each optional directory that is damaged
};

/// Returns the warning for an optional tag that is damaged, and so ignored.
std::string ignored(const Error& error);

/// Returns the value of an optional tag; if it is damaged, adds a warning and returns nullopt.
template <class T>
std::optional<T> or_ignored(Result<std::optional<T>> tag, std::vector<std::string>& warnings) {
  if (tag) return *std::move(tag);
  warnings.push_back(ignored(tag.error()));
  return std::nullopt;
}

/// Opens a DNG; nullopt: not a TIFF, or a TIFF without the tag DNGVersion. Fails on a DNG without a raw image.
Result<std::optional<DngFile>> open_dng(std::span<const std::byte> bytes);

}  // namespace lowlux::capture
