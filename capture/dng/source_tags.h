#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "capture/dng/dng_file.h"
#include "isp/base/frame.h"
#include "isp/base/source_tags.h"

namespace lowlux::capture {

/// Returns the tags of a DNG that are passed on: author, copyright, XMP, IPTC, names and serial numbers of the camera,
/// its colour profile, sharpness and green split, the maker's data, and all EXIF and GPS tags. The maker note of EXIF
/// is passed on only if MakerNoteSafety states that it may be. Opcodes are in RawFrame::corrections.
///
/// Values beyond the end of the file, and those above 64 MB in all, are left out with a warning: directories may name
/// the same bytes any number of times.
std::shared_ptr<const SourceTags> dng_source_tags(std::span<const std::byte> file, const DngFile& dng,
                                                  std::vector<std::string>& warnings);

/// Returns the tags of another raw file, or of the EXIF block of an image, that are passed on: author, copyright, XMP,
/// IPTC, EXIF and GPS tags, without the maker note (find_exif); null if there are no EXIF data. Limits as above.
std::shared_ptr<const SourceTags> raw_source_tags(std::span<const std::byte> file, std::vector<std::string>& warnings);

/// Names the camera of a raw file that is not a DNG as the file itself does, in its tags Make and Model, where it has
/// both (find_exif). The decoder shortens these names; its name of the camera, by which raw developers find their
/// profiles, becomes the tag UniqueCameraModel that is passed on. Files without EXIF data, such as CRW, keep it.
void name_camera_as_file(std::span<const std::byte> file, RawFrame& frame);

}  // namespace lowlux::capture
