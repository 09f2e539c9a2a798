// A V4L2 driver that answers anything: formats, sizes, controls, buffers and frames. Rows that are handed out lie in
// its memory, nothing stays open, and no call is one that no driver would take.
#include <linux/videodev2.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "capture/camera/camera_frame.h"
#include "capture/v4l2/v4l2_source.h"
#include "isp/base/packed/raw_format.h"
#include "tests/fuzz/check_frame.h"
#include "tests/fuzz/input.h"
#include "tests/support/fake_v4l2.h"

namespace {

using lowlux::test::FakeV4l2;
using lowlux::test::FuzzInput;
using lowlux::test::require;

std::uint32_t any_fourcc(FuzzInput& in) {
  const auto formats = lowlux::raw_formats();
  const int which = in.below(32);
  return which == 31 ? in.take<std::uint32_t>() : formats[static_cast<std::size_t>(which) % formats.size()].v4l2_fourcc;
}

/// Mostly what cameras have, sometimes anything.
std::uint32_t size(FuzzInput& in) { return in.below(16) == 0 ? in.take<std::uint32_t>() : in.take<std::uint8_t>(); }

FakeV4l2::Layout any_layout(FuzzInput& in) {
  FakeV4l2::Layout out;
  out.fourcc = any_fourcc(in);
  out.width = size(in);
  out.height = size(in);
  out.stride_bytes = in.below(4) == 0 ? size(in) : 4 * out.width;
  out.buffer_bytes = in.below(4) == 0 ? size(in) : out.stride_bytes * out.height;
  out.field = in.below(8) == 0 ? in.take<std::uint8_t>() : 1;
  out.planes = in.below(8) == 0 ? in.take<std::uint8_t>() : 1;
  return out;
}

void set_up(FakeV4l2& fake, FuzzInput& in) {
  if (in.below(16) == 0) fake.capabilities = in.take<std::uint32_t>();
  for (int i = in.below(4); i > 0; --i) {
    FakeV4l2::Format format{.fourcc = any_fourcc(in), .bytes_per_pixel = 1U + static_cast<unsigned>(in.below(4))};
    for (int k = in.below(3); k > 0; --k) format.sizes.emplace_back(size(in), size(in));
    format.is_range = format.sizes.size() == 2 && in.below(2) == 0;
    fake.formats.push_back(std::move(format));
  }
  if (in.below(2) == 0) fake.layout = any_layout(in);
  if (in.below(4) == 0) fake.on_set_format = [answer = any_layout(in)](auto& layout) { layout = answer; };
  constexpr std::uint32_t ids[] = {
      V4L2_CID_HFLIP,  V4L2_CID_VFLIP,         V4L2_CID_EXPOSURE, V4L2_CID_EXPOSURE_ABSOLUTE, V4L2_CID_HBLANK,
      V4L2_CID_VBLANK, V4L2_CID_ANALOGUE_GAIN, V4L2_CID_GAIN,     V4L2_CID_RED_BALANCE};
  for (int i = in.below(6); i > 0; --i) {
    const std::uint32_t id = ids[in.below(9)];
    FakeV4l2::Control& control = fake.controls[id];
    control.value = in.take<int>();
    control.minimum = in.take<std::int16_t>();
    control.maximum = in.take<std::int16_t>();
    control.step = in.take<std::uint8_t>();  // 0 is taken for 1
    control.flags = in.take<std::uint16_t>();
  }
  if (in.below(2) == 0) fake.pixel_rate_hz = in.take<std::int64_t>();
  if (in.below(2) == 0) fake.crop_width = in.take<std::uint16_t>();
  fake.interval[0] = in.take<std::uint16_t>();
  fake.interval[1] = in.take<std::uint16_t>();
  if (in.below(8) == 0) fake.buffers_given = in.take<std::uint8_t>();
  if (in.below(8) == 0) fake.buffer_length = in.take<std::uint16_t>();
  // The fake takes memory as a driver would; more than this is refused for its size, or is a lie that mapping finds.
  constexpr std::uint32_t max_bytes = 1U << 20U;
  const auto no_more = [answer = std::move(fake.on_set_format)](auto& layout) {
    if (answer) answer(layout);
    if (layout.buffer_bytes > max_bytes) layout.buffer_bytes = max_bytes;
  };
  fake.on_set_format = no_more;
  fake.layout.buffer_bytes = std::min(fake.layout.buffer_bytes, max_bytes);
}

lowlux::capture::V4l2Options options(FuzzInput& in) {
  lowlux::capture::V4l2Options out;
  const auto formats = lowlux::raw_formats();
  if (in.below(2) == 0) out.request.format = formats[static_cast<std::size_t>(in.below(64)) % formats.size()].format;
  if (in.below(4) == 0) out.request.width = in.take<std::uint8_t>(), out.request.height = in.take<std::uint8_t>();
  if (in.below(4) == 0) out.request.frame_rate_hz = in.take<float>();
  if (in.below(4) == 0) out.request.exposure_s = in.take<float>();
  if (in.below(4) == 0) out.request.analogue_gain = in.take<float>();
  if (in.below(4) == 0) out.request.flip_horizontal = out.request.flip_vertical = in.below(2) == 0;
  if (in.below(4) == 0) out.gain_code = in.take<int>();
  if (in.below(2) == 0) out.memory = lowlux::capture::V4l2Memory::dma_buf;
  return out;
}

FakeV4l2::Frame any_frame(FuzzInput& in) {
  FakeV4l2::Frame out{.sequence = in.take<std::uint16_t>(), .flags = in.take<std::uint16_t>()};
  if (in.below(4) == 0) out.bytes_used = in.take<std::uint16_t>();
  if (in.below(8) == 0) out.data_offset = in.take<std::uint32_t>();
  if (in.below(8) == 0) out.index = in.take<std::uint8_t>();
  return out;
}

/// @return whether all buffers were told by their right numbers
bool live(lowlux::capture::Camera& camera, FakeV4l2& fake, FuzzInput& in) {
  bool honest = true;
  static_cast<void>(camera.start());
  for (int i = in.below(8); i > 0; --i) {
    fake.frames.push_back(any_frame(in));
    honest = honest && !fake.frames.back().index;
    const auto frame = camera.next(std::chrono::milliseconds(50));
    if (!frame) continue;
    require(frame->bytes.size() >= lowlux::capture::frame_bytes(camera.format()));
    lowlux::test::check(lowlux::capture::raw_frame_of(*frame, camera.format(), camera.name()));
    if (in.below(4) != 0) camera.return_buffer(*frame);
  }
  if (const auto controls = camera.take_exposure()) {
    require(controls->min_s > 0 && controls->max_s >= controls->min_s && controls->step_s > 0);
    const auto set = camera.set_exposure({.exposure_s = 1e-4 * in.below(10000), .gain = {}});
    require(!set || *set > 0);
  }
  return honest;
}

}  // namespace

LOWLUX_FUZZ_TARGET(v4l2)(const std::uint8_t* data, std::size_t size) {
  FuzzInput in{data, size};
  FakeV4l2 fake(in.below(2) == 0);
  set_up(fake, in);
  const auto cameras = lowlux::capture::list_v4l2_cameras(fake.system());
  require(cameras.size() <= 1 && fake.open_files == 0);
  auto camera = lowlux::capture::open_v4l2("/dev/video0", options(in), fake.system());
  bool honest = true;
  if (camera) {
    honest = live(**camera, fake, in);
    camera->reset();
  }
  require(fake.open_files == 0 && fake.open_maps == 0 && fake.accesses == 0);
  require(fake.misuses == 0 || !honest);  // who is told a wrong buffer gives back one that was not lent
  return 0;
}
