#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "isp/base/source_tags.h"

namespace lowlux::capture {

/// Returns the tags of a raw file that are passed on; null if there are none, or the file cannot be read. Of a DNG
/// these are author, copyright, XMP, IPTC, names and serial numbers of the camera, its colour profile, sharpness and
/// green split, the maker's data, all EXIF and GPS tags, and of OpcodeList3 what is not in RawFrame::corrections; of
/// other raws that are a TIFF, such as NEF, CR2, ARW and PEF, author, copyright, XMP, IPTC, EXIF and GPS tags.
///
/// Values beyond the end of the file, and those above 64 MB in all, are left out with a warning: directories may name
/// the same bytes any number of times.
std::shared_ptr<const SourceTags> read_source_tags(std::span<const std::byte> file, std::vector<std::string>& warnings);
std::shared_ptr<const SourceTags> read_source_tags(const std::filesystem::path& file,
                                                   std::vector<std::string>& warnings);

}  // namespace lowlux::capture
