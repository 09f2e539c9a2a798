#include "isp/cli/shared/noise_maps.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "isp/base/image.h"
#include "isp/cli/shared/exit_code.h"
#include "isp/codec/pfm.h"
#include "isp/output/picture/orient.h"

namespace lowlux::cli {
namespace {

/// Returns the cells that intersect a crop.
/// @param side  side of a cell, in pixels
Plane<float> cropped(const Plane<float>& cells, const Rect& crop, int side) {
  const int left = crop.x / side, top = crop.y / side;
  Plane<float> out((crop.x + crop.width + side - 1) / side - left, (crop.y + crop.height + side - 1) / side - top);
  for (int y = 0; y < out.height(); ++y) std::copy_n(cells.row(top + y) + left, out.width(), out.row(y));
  return out;
}

}  // namespace

std::vector<std::string> noise_map_names(const std::string& picture) {
  const std::string stem = std::filesystem::path(picture).replace_extension().string();
  return {stem + ".noise.pfm", stem + ".confidence.pfm"};
}

std::vector<PixelMap> noise_map_files(isp::NoiseMaps maps, const RawDn& raw, const std::string& picture,
                                      Executor& executor) {
  if (maps.chroma_confidence.size() == 0) return {};
  SceneLinear both;  // as planes of one image they are rotated alike
  const int side = raw.layout == SensorLayout::bayer ? 2 : 1;
  both.plane[0] = cropped(maps.residual_variance_e2, raw.default_crop, side);
  both.plane[1] = cropped(maps.chroma_confidence, raw.default_crop, side);
  both.plane[2] = Plane<float>(both.plane[0].width(), both.plane[0].height());
  auto upright = std::get<SceneLinear>(isp::oriented(std::move(both), raw.info.orientation, executor));
  const std::vector<std::string> names = noise_map_names(picture);
  std::vector<PixelMap> out;
  out.push_back({names[0], std::move(upright.plane[0])});
  out.push_back({names[1], std::move(upright.plane[1])});
  return out;
}

std::string seeing_map_name(const std::string& picture) {
  return std::filesystem::path(picture).replace_extension().string() + ".seeing.pfm";
}

PixelMap seeing_map_file(Plane<float> map, const RawDn& raw, const std::string& picture, Executor& executor) {
  SceneLinear only;
  for (Plane<float>& plane : only.plane) plane = Plane<float>(map.width(), map.height());
  only.plane[0] = std::move(map);
  auto upright = std::get<SceneLinear>(isp::oriented(std::move(only), raw.info.orientation, executor));
  return {seeing_map_name(picture), std::move(upright.plane[0])};
}

Result<std::vector<isp::AtomicFile>> prepare_maps(const std::vector<PixelMap>& maps, isp::Overwrite overwrite,
                                                  isp::Sync sync) {
  std::vector<isp::AtomicFile> files;
  for (const PixelMap& map : maps) {
    auto file = isp::AtomicFile::create(map.path, overwrite, sync);
    if (!file) return tl::make_unexpected(with_file(file.error(), map.path));
    if (const auto written = isp::encode_pfm(map.value.view(), file->file()); !written) {
      return tl::make_unexpected(with_file(written.error(), map.path));
    }
    files.push_back(*std::move(file));
  }
  return files;
}

}  // namespace lowlux::cli
