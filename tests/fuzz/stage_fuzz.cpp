// The stage's C functions with any settings, formats, parameters and frames: pictures in exactly sized memory, or an
// error that has a name.
// Input: figures in the order they are asked for below; what is left after them is the frame, over and over.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "isp/adapter/lowlux_stage.h"
#include "isp/base/raw_format.h"
#include "tests/fuzz/input.h"

namespace {

using lowlux::test::FuzzInput;

constexpr int most_pixels = 64;  // each way

void check(int code) {
  if (code > LOWLUX_STAGE_ADJUSTED || code <= LOWLUX_STAGE_INTERNAL) std::abort();
}

lowlux_stage_rect rect(FuzzInput& in) {
  lowlux_stage_rect out{};
  if (in.below(2) == 0) return out;
  for (std::int32_t* const side : {&out.x, &out.y, &out.width, &out.height}) *side = in.take<std::int8_t>();
  return out;
}

lowlux_stage_input input(FuzzInput& in) {
  lowlux_stage_input out{};
  out.size = sizeof out;
  const auto formats = lowlux::raw_formats();
  const lowlux::RawFormatNames& names = formats[in.take<std::uint8_t>() % formats.size()];
  out.api = names.v4l2_fourcc != 0 ? LOWLUX_STAGE_V4L2 : LOWLUX_STAGE_DRM;
  out.fourcc = names.v4l2_fourcc != 0 ? names.v4l2_fourcc : names.drm_fourcc;
  out.modifier = names.v4l2_fourcc != 0 ? 0 : names.drm_modifier;
  if (in.below(16) == 0) out.fourcc = in.take<std::uint32_t>();
  out.width = in.below(most_pixels + 1);
  out.height = in.below(most_pixels + 1);
  out.crop = rect(in);
  out.masked = rect(in);
  if (in.below(4) == 0) out.white_level = in.take<double>();
  return out;
}

lowlux_stage_output output(FuzzInput& in) {
  constexpr std::uint32_t pictures[] = {LOWLUX_STAGE_XBGR8888, LOWLUX_STAGE_XRGB8888, LOWLUX_STAGE_BGR888,
                                        LOWLUX_STAGE_RGB888,   LOWLUX_STAGE_NV12,     LOWLUX_STAGE_RGB48,
                                        LOWLUX_STAGE_BAYER16};
  lowlux_stage_output out{};
  out.size = sizeof out;
  out.fourcc = pictures[in.below(7)];
  if (in.below(4) == 0) {
    for (std::size_t& stride : out.stride) stride = in.take<std::uint16_t>();
  }
  if (in.below(4) == 0) out.yuv_matrix = in.take<std::int16_t>();
  return out;
}

void frame(lowlux_stage* stage, const lowlux_stage_input& in, const lowlux_stage_output& out, FuzzInput& bytes) {
  auto params = bytes.take<lowlux_stage_params>();
  params.size = sizeof params;
  params.valid &= LOWLUX_STAGE_HAS_ALL;
  const std::size_t stride = bytes.below(8) == 0 ? bytes.take<std::uint16_t>() : std::size_t{160};
  std::vector<std::uint8_t> codes(std::min<std::size_t>(stride * static_cast<std::size_t>(in.height), 1U << 20U));
  for (std::size_t i = 0; i < codes.size(); ++i) codes[i] = bytes.left > 0 ? bytes.data[i % bytes.left] : 0;
  const lowlux_stage_source source{codes.data(), codes.size(), stride, -1};
  std::vector<std::uint8_t> planes[LOWLUX_STAGE_MAX_PLANES];
  lowlux_stage_picture picture{};
  picture.size = sizeof picture;
  picture.planes = out.planes;
  for (int i = 0; i < out.planes; ++i) {
    planes[i].resize(out.bytes[i]);
    picture.plane[i] = {planes[i].data(), planes[i].size(), out.stride[i]};
  }
  lowlux_stage_result result{};
  result.size = sizeof result;
  lowlux_stage_statistics statistics{};
  statistics.size = sizeof statistics;
  check(lowlux_stage_process(stage, &source, &picture, &params, &result, &statistics));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzInput bytes{data, size};
  lowlux_stage_settings settings{};
  settings.size = sizeof settings;
  settings.threads = 1 + bytes.below(2);
  settings.most_denoise = bytes.below(4);
  settings.temporal = bytes.below(2);
  settings.look = bytes.below(2);
  settings.tone = bytes.below(2);
  lowlux_stage* stage = nullptr;
  check(lowlux_stage_open(&settings, &stage, nullptr, 0));
  if (stage == nullptr) std::abort();
  const lowlux_stage_input in = input(bytes);
  lowlux_stage_output out = output(bytes);
  const int configured = lowlux_stage_configure(stage, &in, &out);
  check(configured);
  const int frames = 1 + bytes.below(3);
  for (int i = 0; i < frames && configured >= 0; ++i) frame(stage, in, out, bytes);
  lowlux_stage_release(stage);
  return 0;
}
