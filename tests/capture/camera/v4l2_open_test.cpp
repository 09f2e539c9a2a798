#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <cerrno>
#include <limits>

#include "capture/v4l2/v4l2_negotiation.h"
#include "tests/capture/camera/v4l2_opened.h"

namespace lowlux::test {
namespace {

using capture::CameraRequest;
using capture::V4l2Options;

constexpr RawFormat srggb8{8, RawPacking::byte, SensorLayout::bayer, BayerPhase::rggb};

TEST(V4l2Open, TakesTheDeepestBayerFormatAtItsLargestSizeAndTheDriversStride) {
  for (const bool multi_planar : {false, true}) {
    FakeV4l2 fake(multi_planar);
    const auto camera = opened(fake);
    EXPECT_EQ(camera->name(), "Fake Camera?");  // what cannot be printed is not
    EXPECT_EQ(camera->format().raw, srggb10);
    EXPECT_EQ(camera->format().width, 32);
    EXPECT_EQ(camera->format().height, 24);
    EXPECT_EQ(camera->format().stride_bytes, 72u);
    EXPECT_EQ(camera->format().frame_rate_hz, 30.0);
    EXPECT_TRUE(camera->warnings().empty()) << joined(camera->warnings());
  }
}

TEST(V4l2Open, TakesMonochromeWhereThereIsNoBayer) {
  FakeV4l2 fake;
  fake.formats = {{V4L2_PIX_FMT_YUYV, 2, {{16, 12}}}, {V4L2_PIX_FMT_GREY, 1, {}}, {V4L2_PIX_FMT_Y12, 2, {{16, 12}}}};
  const auto camera = opened(fake);
  EXPECT_EQ(camera->format().raw.layout, SensorLayout::monochrome);
  EXPECT_EQ(camera->format().raw.bits, 12);
}

TEST(V4l2Open, AmongEqualDepthsTheOrderInForceIsKept) {
  FakeV4l2 fake;
  fake.formats = {{V4L2_PIX_FMT_SBGGR10, 2, {{16, 12}}}, {V4L2_PIX_FMT_SGBRG10, 2, {{16, 12}}}};
  fake.layout.fourcc = V4L2_PIX_FMT_SGBRG8;
  const auto camera = opened(fake);
  EXPECT_EQ(camera->format().raw.phase, BayerPhase::gbrg);
}

TEST(V4l2Open, WhereTheMediaControllerRulesWhatIsInForceIsKept) {
  FakeV4l2 fake;
  fake.capabilities |= V4L2_CAP_IO_MC;
  fake.layout = {V4L2_PIX_FMT_SRGGB8, 16, 12, 16, 192};
  const auto camera = opened(fake);
  EXPECT_EQ(camera->format().raw, srggb8);
  EXPECT_EQ(camera->format().width, 16);
}

TEST(V4l2Open, WithoutAListOfSizesOrWithARangeOfThemTheOneInForceIsKept) {
  FakeV4l2 fake;
  fake.formats = {{V4L2_PIX_FMT_SRGGB10, 2, {}}};
  EXPECT_EQ(opened(fake)->format().width, 640);
  fake.formats[0].sizes = {{16, 16}, {16384, 8640}};
  fake.formats[0].is_range = true;
  EXPECT_EQ(opened(fake)->format().width, 640);
  EXPECT_EQ(opened(fake, {.request = {.width = 64, .height = 48}})->format().width, 64);
  const auto listed = capture::list_v4l2_cameras(fake.system());
  ASSERT_EQ(listed.size(), 1u);
  EXPECT_EQ(listed[0].formats, std::vector<std::string>{"SRGGB10 16x16 to 16384x8640"});
}

TEST(V4l2Open, WhatIsAskedForIsHadExactlyOrIsAnErrorThatNamesWhatThereIs) {
  FakeV4l2 fake;
  const auto camera = opened(fake, {.request = {.format = srggb8, .width = 16, .height = 12}});
  EXPECT_EQ(camera->format().raw, srggb8);
  EXPECT_EQ(camera->format().width, 16);

  FakeV4l2 other;
  const Error format = refused(other, {.request = {.format = RawFormat{12, RawPacking::csi2}}});
  EXPECT_EQ(format.code, ErrorCode::unsupported);
  EXPECT_TRUE(has(format, "has no SRGGB12_CSI2P: it offers SRGGB8 32x24 16x12, SRGGB10 16x12 32x24, R12 16x12"))
      << format.message;

  EXPECT_TRUE(has(refused(other, {.request = {.format = RawFormat{16, RawPacking::big16, SensorLayout::monochrome}}}),
                  "has no Y16-BE: "));
  EXPECT_TRUE(has(refused(other, {.request = {.format = RawFormat{9}}}), "has no such raw format: "));

  other.on_set_format = [](FakeV4l2::Layout& layout) { layout.width = 32, layout.stride_bytes = 64; };
  const Error size = refused(other, {.request = {.format = srggb10, .width = 17, .height = 12}});
  EXPECT_EQ(size.code, ErrorCode::unsupported);
  EXPECT_TRUE(has(size, "asked for SRGGB10 17x12, Fake Camera? makes it SRGGB10 32x12: it offers")) << size.message;
}

TEST(V4l2Open, ARefusalThatSucceedsWithAnotherFormatIsSeen) {
  FakeV4l2 fake;
  fake.on_set_format = [](FakeV4l2::Layout& layout) { layout.fourcc = V4L2_PIX_FMT_YUYV; };
  EXPECT_TRUE(has(refused(fake), "makes it YUYV 32x24"));
  EXPECT_TRUE(has(refused(fake, {.request = {.format = srggb10}}), "makes it YUYV"));

  // Nobody insisted on the format: another raw one will do, and is told.
  fake.on_set_format = [](FakeV4l2::Layout& layout) { layout.fourcc = V4L2_PIX_FMT_SGRBG10; };
  auto camera = opened(fake);
  EXPECT_EQ(camera->format().raw.phase, BayerPhase::grbg);
  EXPECT_EQ(camera->warnings().size(), 1u);
  camera.reset();
  EXPECT_EQ(refused(fake, {.request = {.format = srggb10}}).code, ErrorCode::unsupported);
}

TEST(V4l2Open, ASizeTheDriverAdjustsIsTakenWithAWarningIfNobodyInsisted) {
  FakeV4l2 fake;
  fake.on_set_format = [](FakeV4l2::Layout& layout) { layout.width = 30; };
  const auto camera = opened(fake);
  EXPECT_EQ(camera->format().width, 30);
  ASSERT_EQ(camera->warnings().size(), 1u);
  EXPECT_NE(camera->warnings()[0].find("lists SRGGB10 32x24 and delivers SRGGB10 30x24"), std::string::npos);
}

TEST(V4l2Open, ADriverThatOffersNothingRawIsToldApart) {
  FakeV4l2 fake;
  fake.formats = {{V4L2_PIX_FMT_YUYV, 2, {{16, 12}}}, {V4L2_PIX_FMT_SRGGB10DPCM8, 1, {{16, 12}}}};
  const Error error = refused(fake);
  EXPECT_EQ(error.code, ErrorCode::unsupported);
  EXPECT_TRUE(has(error, "no raw format that lowlux knows: it offers YUYV, bRA8")) << error.message;
  fake.formats.clear();
  EXPECT_TRUE(has(refused(fake), "it offers no format"));
}

struct Lie {
  const char* what;
  ErrorCode code;
  std::function<void(FakeV4l2::Layout&)> tell;
};

TEST(V4l2Open, DriversThatContradictThemselvesAreRefused) {
  constexpr std::uint32_t huge = std::numeric_limits<std::uint32_t>::max();
  const Lie lies[] = {
      {"no stride", ErrorCode::malformed, [](auto& layout) { layout.stride_bytes = 0; }},
      {"a stride under a row", ErrorCode::malformed, [](auto& layout) { layout.stride_bytes = 63; }},
      {"a buffer under a frame", ErrorCode::malformed, [](auto& layout) { layout.buffer_bytes = 72 * 23 + 63; }},
      {"no width", ErrorCode::malformed, [](auto& layout) { layout.width = 0; }},
      {"no height", ErrorCode::malformed, [](auto& layout) { layout.height = 0; }},
      {"an absurd width", ErrorCode::malformed, [](auto& layout) { layout.width = 65537; }},
      {"an absurd height", ErrorCode::malformed, [](auto& layout) { layout.height = huge; }},
      {"an absurd stride", ErrorCode::malformed, [](auto& layout) { layout.stride_bytes = huge; }},
      {"an absurd buffer", ErrorCode::too_large, [](auto& layout) { layout.buffer_bytes = huge; }},
      {"half pictures", ErrorCode::unsupported, [](auto& layout) { layout.field = V4L2_FIELD_INTERLACED; }},
      {"more planes", ErrorCode::unsupported, [](auto& layout) { layout.planes = 2; }},
      {"no planes", ErrorCode::unsupported, [](auto& layout) { layout.planes = 0; }}};
  for (const Lie& lie : lies) {
    FakeV4l2 fake(true);
    fake.on_set_format = lie.tell;
    EXPECT_EQ(refused(fake).code, lie.code) << lie.what;
  }
  // To the byte: the last row needs no padding.
  FakeV4l2 fake;
  fake.on_set_format = [](auto& layout) { layout.buffer_bytes = 72 * 23 + 64; };
  const auto camera = opened(fake);
  EXPECT_EQ(capture::frame_bytes(camera->format()), 72u * 23 + 64);
}

TEST(V4l2Open, NodesThatAreNoCameraAreToldApart) {
  FakeV4l2 fake;
  fake.capabilities = V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING;
  EXPECT_TRUE(has(refused(fake), "captures no video"));
  fake.capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_READWRITE;
  EXPECT_TRUE(has(refused(fake), "does not stream"));
  fake.faults[VIDIOC_QUERYCAP] = {ENOTTY};
  EXPECT_TRUE(has(refused(fake), "not a V4L2 device"));
}

TEST(V4l2Open, EachFailureToOpenHasItsCodeAndItsCure) {
  struct Case {
    int open_errno;
    ErrorCode code;
    const char* words;
  };
  for (const Case& one :
       {Case{ENOENT, ErrorCode::not_found, "no such device"}, Case{ENXIO, ErrorCode::not_found, "connect the camera"},
        Case{EBUSY, ErrorCode::unreadable, "another program uses it"},
        Case{EACCES, ErrorCode::unreadable, "in the group that owns it"},
        Case{EINTR, ErrorCode::unreadable, "cannot be opened"},
        Case{EMFILE, ErrorCode::unreadable, "cannot be opened"}}) {
    FakeV4l2 fake;
    fake.open_errno = one.open_errno;
    const Error error = refused(fake);
    EXPECT_EQ(error.code, one.code) << one.open_errno;
    EXPECT_TRUE(has(error, one.words)) << error.message;
  }
  // The real system.
  EXPECT_EQ(capture::open_v4l2("/dev/lowlux-none", {}).error().code, ErrorCode::not_found);
  EXPECT_TRUE(has(capture::open_v4l2("/dev/null", {}).error(), "not a V4L2 device"));
}

TEST(V4l2Open, AFormatThatAnotherProgramHoldsIsBusy) {
  FakeV4l2 fake;
  fake.faults[VIDIOC_S_FMT] = {EBUSY};
  const Error error = refused(fake);
  EXPECT_EQ(error.code, ErrorCode::unreadable);
  EXPECT_TRUE(has(error, "another program uses the device")) << error.message;
}

TEST(V4l2Open, SignalsAreNoFailures) {
  FakeV4l2 fake;
  for (const unsigned long request : {VIDIOC_QUERYCAP, VIDIOC_S_FMT, VIDIOC_ENUM_FMT})
    fake.faults[request] = {EINTR, 3};
  EXPECT_TRUE(opened(fake));
  fake.faults[VIDIOC_QUERYCAP] = {EINTR};  // for ever
  EXPECT_EQ(refused(fake).code, ErrorCode::unreadable);
}

TEST(V4l2Open, ADeviceThatVanishesDuringAnyCallIsGone) {
  const V4l2Options all{.request = {.format = srggb10,
                                    .width = 32,
                                    .height = 24,
                                    .frame_rate_hz = 10,
                                    .exposure_s = 0.01,
                                    .analogue_gain = 1,
                                    .flip_horizontal = true,
                                    .flip_vertical = true}};
  int calls = 0;
  for (;; ++calls) {
    FakeV4l2 fake;
    fake.controls = {{V4L2_CID_HFLIP, {0, 0, 1}},         {V4L2_CID_VFLIP, {0, 0, 1}},
                     {V4L2_CID_EXPOSURE_AUTO, {0, 0, 3}}, {V4L2_CID_EXPOSURE_ABSOLUTE, {1, 1, 10000}},
                     {V4L2_CID_AUTOGAIN, {1, 0, 1}},      {V4L2_CID_ANALOGUE_GAIN, {9, 0, 9}}};
    fake.calls_before_unplugging = calls;
    const auto camera = capture::open_v4l2("/dev/video0", all, fake.system());
    if (camera) break;
    EXPECT_EQ(camera.error().code, ErrorCode::not_found) << calls << ": " << camera.error().message;
    EXPECT_EQ(fake.open_files, 0);
  }
  EXPECT_GT(calls, 20);
}

TEST(V4l2Open, RequestsOutsideTheirRangeAreRefusedBeforeTheDeviceIsTouched) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  constexpr double infinite = std::numeric_limits<double>::infinity();
  const CameraRequest requests[] = {{.width = 32},
                                    {.height = 32},
                                    {.width = 0, .height = 1},
                                    {.width = 1, .height = -1},
                                    {.width = 65537, .height = 1},
                                    {.frame_rate_hz = 0},
                                    {.frame_rate_hz = nan},
                                    {.frame_rate_hz = infinite},
                                    {.exposure_s = -1},
                                    {.exposure_s = nan},
                                    {.analogue_gain = 0.5},
                                    {.analogue_gain = infinite},
                                    {.buffers = 1},
                                    {.buffers = 33}};
  for (const CameraRequest& request : requests) {
    FakeV4l2 fake;
    EXPECT_EQ(refused(fake, {.request = request}).code, ErrorCode::invalid_argument) << &request - requests;
    EXPECT_TRUE(fake.calls.empty());
  }
  FakeV4l2 fake;
  EXPECT_TRUE(has(refused(fake, {.request = {.analogue_gain = 2}, .gain_code = 5}), "give only one"));
}

TEST(V4l2List, NamesTheCamerasAndTheirRawFormats) {
  FakeV4l2 fake;
  const auto cameras = capture::list_v4l2_cameras(fake.system());
  ASSERT_EQ(cameras.size(), 1u);
  EXPECT_EQ(cameras[0].id, "/dev/video0");
  EXPECT_EQ(cameras[0].name, "Fake Camera?");
  EXPECT_EQ(joined(cameras[0].formats), "SRGGB8 32x24 16x12\nSRGGB10 16x12 32x24\nR12 16x12\n");
  EXPECT_EQ(fake.open_files, 0);
}

TEST(V4l2List, LeavesOutWhatIsNoCameraAndSaysWhyOneCannotBeOpened) {
  FakeV4l2 fake;
  fake.open_errno = EACCES;
  EXPECT_NE(capture::list_v4l2_cameras(fake.system()).at(0).name.find("group"), std::string::npos);
  fake.open_errno = ENODEV;
  EXPECT_TRUE(capture::list_v4l2_cameras(fake.system()).empty());
  fake.open_errno = 0;
  fake.capabilities = V4L2_CAP_VIDEO_OUTPUT;
  EXPECT_TRUE(capture::list_v4l2_cameras(fake.system()).empty());
  fake.paths.clear();
  EXPECT_TRUE(capture::list_v4l2_cameras(fake.system()).empty());
}

TEST(V4l2List, OfThisMachineHasPathsOfVideoDevices) {
  for (const auto& camera : capture::list_v4l2_cameras()) EXPECT_TRUE(camera.id.starts_with("/dev/video"));
}

}  // namespace
}  // namespace lowlux::test
