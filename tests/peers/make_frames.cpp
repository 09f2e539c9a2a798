// Raw files as `capture` writes them and with every tag the writer knows, from one simulated raw file of an RGGB
// mosaic.
//   peer_frames IN.dng FOLDER
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <string>
#include <vector>

#include "capture/camera/camera_frame.h"
#include "capture/file/dng_source.h"
#include "isp/output/dng/dng_writer.h"

namespace lowlux {
namespace {

/// The scene in 10 bits out of a camera's buffer, black 64. The camera says all it can, or nothing.
RawFrame captured(const RawFrame& scene, SensorLayout layout, bool camera_tells) {
  const Rect& area = scene.raw.active;
  const int width = area.width & ~1, height = area.height & ~1;
  capture::CameraFormat format{.raw = {10, RawPacking::little16, layout, BayerPhase::rggb},
                               .width = width,
                               .height = height,
                               .stride_bytes = 2 * static_cast<std::size_t>(width)};
  std::vector<std::byte> memory(capture::frame_bytes(format));
  const double black = scene.raw.black_tag->at(0, 0);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const bool mosaic = layout == SensorLayout::bayer;
      const std::uint16_t dn = scene.raw.dn.at(area.x + (mosaic ? x : x | 1), area.y + (mosaic ? y : y & ~1));
      const auto code = std::lround(64 + (dn - black) * 959 / (scene.raw.white_dn[1] - black));
      std::byte* const at = memory.data() + y * format.stride_bytes + 2 * static_cast<std::size_t>(x);
      at[0] = static_cast<std::byte>(code & 0xFF);
      at[1] = static_cast<std::byte>(code >> 8);
    }
  }
  capture::CameraFrame frame;
  frame.bytes = memory;
  frame.facts.black_level_dn = {64, 64, 64, 64};
  if (camera_tells) {
    frame.facts.exposure_s = 0.033;
    frame.facts.analogue_gain = 3.98;
    frame.facts.colour_gains = {1.93, 1.57};
    frame.facts.colour_matrix = {1.71, -0.52, -0.19, -0.31, 1.62, -0.31, 0.03, -0.61, 1.58};
    frame.facts.colour_temperature_k = 5100;
    frame.facts.temperature_c = 31;
  }
  return capture::raw_frame_of(frame, format, "Camera 1");
}

/// The scene, to be turned, with black by site, column and row, a crop, defects, shading and noise.
RawFrame with_every_tag(RawFrame scene) {
  const Rect& area = scene.raw.active;
  const double black = scene.raw.black_tag->at(0, 0);
  scene.raw.default_crop = {4, 4, area.width - 8, area.height - 8};
  scene.raw.black_tag = BlackLevel{.rows = 2, .columns = 2, .pattern_dn = std::vector<double>(4, black)};
  scene.raw.black_tag->column_dn.assign(area.width, -0.25);
  scene.raw.black_tag->row_dn.assign(area.height, 0.25);
  scene.raw.info.orientation = Orientation::rotate_90;
  scene.raw.info.date_time = "2024:12:24 23:59:01";
  scene.raw.info.focal_length_mm = 35;
  scene.corrections.defects = {{30, 40, 1, 1}};
  scene.corrections.radial_gains = {{{0.02, 0, 0, 0, 0}, 0.5, 0.5}};
  scene.noise = NoiseProfile{{1e-4, 1e-4, 1e-4}, {1e-7, 1e-7, 1e-7}};
  return scene;
}

/// The scene as 32-bit floats, black 0 and white 1, as merges and `denoise` of floats are written.
RawFrame as_fractions(RawFrame scene) {
  RawDn& raw = scene.raw;
  const double black = raw.black_tag->at(0, 0), range = raw.white_dn[1] - black;
  raw.dn_float = Plane<float>(raw.dn.width(), raw.dn.height());
  for (std::size_t i = 0; i < raw.dn.size(); ++i) {
    raw.dn_float.data()[i] = static_cast<float>((raw.dn.data()[i] - black) / range);
  }
  raw.dn = {};
  raw.black_tag = BlackLevel{.pattern_dn = {0}};
  raw.white_dn.fill(1);
  return scene;
}

int write(const RawFrame& frame, const std::string& file) {
  const auto written = isp::write_dng(frame, file);
  if (!written) std::fprintf(stderr, "peer_frames: %s: %s\n", file.c_str(), written.error().message.c_str());
  return written ? 0 : 1;
}

}  // namespace
}  // namespace lowlux

int main(int argc, char** argv) {
  using namespace lowlux;
  if (argc != 3) return std::fprintf(stderr, "usage: peer_frames IN.dng FOLDER\n"), 2;
  auto scene = capture::read_raw(argv[1]);
  if (!scene) return std::fprintf(stderr, "peer_frames: %s\n", scene.error().message.c_str()), 1;
  const std::string folder = std::string(argv[2]) + "/";
  int failed = write(captured(*scene, SensorLayout::bayer, true), folder + "captured.dng");
  failed += write(captured(*scene, SensorLayout::bayer, false), folder + "captured_unknown.dng");
  failed += write(captured(*scene, SensorLayout::monochrome, true), folder + "captured_monochrome.dng");
  failed += write(with_every_tag(*std::move(scene)), folder + "every_tag.dng");
  scene = capture::read_raw(argv[1]);
  if (scene) failed += write(as_fractions(*std::move(scene)), folder + "floats.dng");
  return failed == 0 ? 0 : 1;
}
