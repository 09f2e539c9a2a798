#pragma once

#include <string>

#include "isp/base/plane.h"
#include "isp/base/result.h"
#include "isp/output/atomic_file.h"

namespace lowlux::cli {

/// A figure of each pixel, and its file.
struct PixelMap {
  std::string path;
  Plane<float> value;
};

/// Writes a map as grey PFM, whole or not at all. Errors name the file.
Result<void> write_map(const PixelMap& map, isp::Overwrite overwrite, isp::Sync sync = isp::Sync::no);

}  // namespace lowlux::cli
