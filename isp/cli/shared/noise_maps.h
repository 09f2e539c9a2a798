#pragma once

#include <string>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/plane.h"
#include "isp/base/result.h"
#include "isp/output/atomic_file.h"
#include "isp/pipeline/noise_reduction.h"

namespace lowlux::cli {

/// Holds a value for each pixel, and its file.
struct PixelMap {
  std::string path;
  Plane<float> value;
};

/// Writes maps as grey PFM, each to a file that gets its name by AtomicFile::commit_all. Errors name the file.
Result<std::vector<isp::AtomicFile>> prepare_maps(const std::vector<PixelMap>& maps, isp::Overwrite overwrite,
                                                  isp::Sync sync = isp::Sync::no);

/// Returns the files of an image's maps: OUT.noise.pfm and OUT.confidence.pfm for OUT.png.
std::vector<std::string> noise_map_names(const std::string& picture);

/// Returns the maps in their image's geometry: cropped and upright, one pixel per 2x2 cell of mosaics, one
/// per pixel of other frames; none if `maps` is empty.
std::vector<PixelMap> noise_map_files(isp::NoiseMaps maps, const RawDn& raw, const std::string& picture,
                                      Executor& executor);

/// Returns the file of an image's map of seeing: OUT.seeing.pfm for OUT.png.
std::string seeing_map_name(const std::string& picture);

/// Returns the map of seeing turned upright like its image, one pixel per 4x4 pixels.
PixelMap seeing_map_file(Plane<float> map, const RawDn& raw, const std::string& picture, Executor& executor);

}  // namespace lowlux::cli
