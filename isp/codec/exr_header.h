#pragma once

#include <cstddef>
#include <span>

#include "isp/base/result.h"

namespace lowlux::isp {

/// Walks the attributes of an OpenEXR header without believing any size in it: OpenEXR itself takes the memory an
/// attribute asks for before it finds the file too short for it. An error unless every attribute, and every string and
/// preview inside one, ends within the file. Files of several parts and deep files are refused.
Result<void> check_exr_header(std::span<const std::byte> bytes);

}  // namespace lowlux::isp
