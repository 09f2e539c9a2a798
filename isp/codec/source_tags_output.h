#pragma once

#include <cstdint>
#include <cstdio>

#include "isp/base/result.h"
#include "isp/base/source_tags.h"

namespace lowlux::isp {

/// Adds tags to the first directory of a TIFF, to its EXIF directory and to a GPS directory, byte by byte: libtiff
/// would round rationals to floats, and drops tags that it does not know. Tags that the file has stay as they are,
/// except UniqueCameraModel, by which raw developers find their profiles. New directories and values are appended.
/// @param file  a complete classic little-endian TIFF, open for reading and writing; a BigTIFF stays as it is, and so
/// does
///              a file that would grow beyond 4 GiB
/// Errors: unwritable.
Result<void> add_source_tags(std::FILE* file, const SourceTags& tags);

/// Returns the tags that belong into a finished image: caption, author, copyright, lens, place and how the image was
/// taken, but no maker's notes, whose offsets do not survive, no tags above 4096 bytes, none of raw developers, and 48
/// KiB in all: further ones are left out.
SourceTags picture_tags(const SourceTags& tags);

}  // namespace lowlux::isp
