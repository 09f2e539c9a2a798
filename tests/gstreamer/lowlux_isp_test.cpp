#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <gst/check/gstharness.h>
#include <gst/video/video.h>

#include "isp/adapter/lowlux_stage.h"
#include "isp/base/packed/raw_format.h"
#include "isp/gstreamer/caps.h"
#include "tests/adapter/stage_frames.h"

// The element against the C functions of the stage that is behind it: the same bytes from the same frames.
namespace lowlux::gst {
namespace {

using Bytes = std::vector<std::uint8_t>;

struct FreeHarness {
  void operator()(GstHarness* harness) const { gst_harness_teardown(harness); }
};
using Harness = std::unique_ptr<GstHarness, FreeHarness>;

struct ReleaseStage {
  void operator()(lowlux_stage* stage) const { lowlux_stage_release(stage); }
};

/// What is drawn: frames of a format, and what is made of them.
struct Stream {
  std::string mosaic = "rggb10le";
  std::string output = "RGBx";
  int width = 64, height = 48;

  bool is_grey() const { return mosaic.starts_with("GRAY"); }
  std::string sink_caps() const {
    return (is_grey() ? "video/x-raw, format=" : "video/x-bayer, format=") + mosaic +
           ", width=" + std::to_string(width) + ", height=" + std::to_string(height) + ", framerate=30/1";
  }
  std::string source_caps() const {
    if (output == "mosaic") return "video/x-bayer, format=" + mosaic.substr(0, 4) + "16le";
    return "video/x-raw, format=" + output;
  }
  InputCaps in() const {
    GstCaps* caps = gst_caps_from_string(sink_caps().c_str());
    const std::optional<InputCaps> read = read_input_caps(caps);
    gst_caps_unref(caps);
    EXPECT_TRUE(read) << sink_caps();
    return read.value_or(InputCaps{});
  }
};

Bytes frame_of(const Stream& stream, std::uint32_t seed) {
  const InputCaps in = stream.in();
  const std::optional<RawFormat> format = raw_format_of_v4l2(in.fourcc);
  const auto bytes = stage_testing::packed_frame(
      *format, stage_testing::scene(*format, stream.width, stream.height, seed), stream.width, in.stride);
  Bytes out(bytes.size());
  std::memcpy(out.data(), bytes.data(), out.size());
  return out;
}

GstBuffer* buffer_of(const Bytes& bytes, int index) {
  GstBuffer* buffer = gst_buffer_new_memdup(bytes.data(), bytes.size());
  GST_BUFFER_PTS(buffer) = static_cast<GstClockTime>(index) * GST_SECOND / 30;
  GST_BUFFER_DURATION(buffer) = GST_SECOND / 30;
  return buffer;
}

/// The stage alone, with the settings of an element that is left as it is but for the level and temporal filtering.
class Reference {
 public:
  explicit Reference(bool temporal) {
    lowlux_stage_settings settings{};
    settings.size = sizeof settings;
    settings.most_denoise = LOWLUX_STAGE_LEVEL_STANDARD;
    settings.tone = 1;
    settings.temporal = temporal ? 1 : 0;
    lowlux_stage* stage = nullptr;
    EXPECT_EQ(lowlux_stage_open(&settings, &stage, nullptr, 0), LOWLUX_STAGE_OK);
    stage_.reset(stage);
  }
  void configure(const Stream& stream, const OutputCaps& output) {
    const InputCaps caps = stream.in();
    stride_ = caps.stride;
    lowlux_stage_input in{};
    in.size = sizeof in;
    in.api = LOWLUX_STAGE_V4L2;
    in.fourcc = caps.fourcc;
    in.width = caps.width;
    in.height = caps.height;
    layout_ = {};
    layout_.size = sizeof layout_;
    layout_.fourcc = output.fourcc;
    layout_.yuv_matrix = output.fourcc != LOWLUX_STAGE_NV12 ? 0 : caps.height >= 720 ? 709 : 601;
    ASSERT_GE(lowlux_stage_configure(stage_.get(), &in, &layout_), 0) << lowlux_stage_last_error(stage_.get());
  }
  void reset() { lowlux_stage_reset(stage_.get()); }
  /// Returns the planes of the image of a frame, each without gaps between its rows.
  std::vector<Bytes> processed(const Bytes& frame, int index) {
    std::vector<Bytes> planes;
    lowlux_stage_picture picture{};
    picture.size = sizeof picture;
    picture.planes = layout_.planes;
    for (int i = 0; i < layout_.planes; ++i) {
      planes.emplace_back(layout_.bytes[i]);
      picture.plane[i] = {planes.back().data(), planes.back().size(), layout_.stride[i]};
    }
    lowlux_stage_params params{};
    params.size = sizeof params;
    params.valid = LOWLUX_STAGE_HAS_TIMESTAMP | LOWLUX_STAGE_HAS_SATURATION;
    params.timestamp_ns = static_cast<std::uint64_t>(index) * GST_SECOND / 30;
    params.saturation = 1;
    const lowlux_stage_source source{frame.data(), frame.size(), stride_, -1};
    EXPECT_EQ(lowlux_stage_process(stage_.get(), &source, &picture, &params, nullptr, nullptr), LOWLUX_STAGE_OK)
        << lowlux_stage_last_error(stage_.get());
    return planes;
  }
  const lowlux_stage_output& layout() const { return layout_; }

 private:
  std::unique_ptr<lowlux_stage, ReleaseStage> stage_;
  lowlux_stage_output layout_{};
  std::size_t stride_ = 0;
};

Harness harness_of(const Stream& stream, bool temporal = false, const char* look = "camera", double white_dn = 0) {
  GstElement* element = gst_element_factory_make("lowluxisp", nullptr);
  g_object_set(element, "temporal", static_cast<gboolean>(temporal), "white-level", white_dn, nullptr);
  gst_util_set_object_arg(G_OBJECT(element), "look", look);
  Harness harness(gst_harness_new_with_element(element, "sink", "src"));
  gst_object_unref(element);
  gst_harness_set_sink_caps_str(harness.get(), stream.source_caps().c_str());
  gst_harness_set_src_caps_str(harness.get(), stream.sink_caps().c_str());
  return harness;
}

OutputCaps output_of(GstHarness* harness) {
  GstCaps* caps = gst_pad_get_current_caps(harness->sinkpad);
  const std::optional<OutputCaps> read = read_output_caps(caps);
  if (caps != nullptr) gst_caps_unref(caps);
  EXPECT_TRUE(read);
  return read.value_or(OutputCaps{});
}

/// Checks the rows of a buffer against those of the stage, and releases it.
void expect_image(GstBuffer* buffer, const OutputCaps& caps, const Reference& reference,
                  const std::vector<Bytes>& planes) {
  ASSERT_NE(buffer, nullptr);
  GstMapInfo map{};
  ASSERT_NE(gst_buffer_map(buffer, &map, GST_MAP_READ), FALSE);
  EXPECT_EQ(map.size, caps.bytes());
  const lowlux_stage_output& layout = reference.layout();
  for (int plane = 0; plane < layout.planes; ++plane) {
    const std::size_t offset = caps.is_mosaic() ? 0 : GST_VIDEO_INFO_PLANE_OFFSET(&caps.picture, plane);
    const std::size_t stride =
        caps.is_mosaic() ? caps.stride : static_cast<std::size_t>(GST_VIDEO_INFO_PLANE_STRIDE(&caps.picture, plane));
    const std::size_t row = layout.stride[plane], rows = layout.bytes[plane] / row;
    for (std::size_t y = 0; y < rows; ++y) {
      ASSERT_EQ(std::memcmp(map.data + offset + y * stride, planes[plane].data() + y * row, row), 0)
          << "plane " << plane << ", row " << y;
    }
  }
  gst_buffer_unmap(buffer, &map);
  gst_buffer_unref(buffer);
}

Stream drawn(std::mt19937& random) {
  static const std::vector<std::string> orders{"rggb", "grbg", "gbrg", "bggr"};
  static const std::vector<std::string> depths{"", "10le", "12le", "14le", "16le"};
  static const std::vector<std::string> outputs{"RGBx", "BGRx", "RGB", "BGR", "NV12", "mosaic"};
  const auto pick = [&](const std::vector<std::string>& from) { return from[random() % from.size()]; };
  const auto side = [&] { return static_cast<int>(std::lround(2 * std::exp2(7.0 * (random() % 1000) / 1000))); };
  Stream stream;
  stream.mosaic = pick(orders);
  stream.mosaic += pick(depths);
  stream.output = pick(outputs);
  if (stream.output != "mosaic" && random() % 4 == 0) stream.mosaic = random() % 2 == 0 ? "GRAY8" : "GRAY16_LE";
  stream.width = side();
  stream.height = side();
  return stream;
}

TEST(LowluxIsp, GivesTheBytesOfTheStage) {
  for (std::uint32_t seed = 1; seed <= 60; ++seed) {
    std::mt19937 random(seed);
    const Stream stream = drawn(random);
    SCOPED_TRACE("seed " + std::to_string(seed) + ": " + stream.sink_caps() + " to " + stream.output);
    const bool temporal = seed % 2 == 0;
    const Harness harness = harness_of(stream, temporal);
    Reference reference(temporal);
    for (int frame = 0; frame < 3; ++frame) {
      const Bytes bytes = frame_of(stream, 10 * seed + static_cast<std::uint32_t>(frame));
      GstBuffer* image = gst_harness_push_and_pull(harness.get(), buffer_of(bytes, frame));
      const OutputCaps caps = output_of(harness.get());
      if (frame == 0) reference.configure(stream, caps);
      ASSERT_EQ(GST_BUFFER_PTS(image), static_cast<GstClockTime>(frame) * GST_SECOND / 30);
      expect_image(image, caps, reference, reference.processed(bytes, frame));
      if (HasFatalFailure()) return;
    }
  }
}

TEST(LowluxIsp, FollowsCapsThatChange) {
  const Stream first, second{.mosaic = "gbrg16le", .width = 50, .height = 70};
  const Stream third{.mosaic = "GRAY16_LE", .width = 51, .height = 33};
  const Harness harness = harness_of(first);
  Reference reference(false);
  for (const Stream& stream : {first, second, third, first}) {
    gst_harness_set_src_caps_str(harness.get(), stream.sink_caps().c_str());
    const Bytes bytes = frame_of(stream, 5);
    GstBuffer* image = gst_harness_push_and_pull(harness.get(), buffer_of(bytes, 0));
    const OutputCaps caps = output_of(harness.get());
    EXPECT_EQ(caps.width, stream.width);
    EXPECT_EQ(caps.height, stream.height);
    reference.configure(stream, caps);
    expect_image(image, caps, reference, reference.processed(bytes, 0));
  }
}

TEST(LowluxIsp, ReadsRowsAsTheirMetadataStatesThem) {
  const Stream stream;
  const Harness harness = harness_of(stream);
  const InputCaps in = stream.in();
  const Bytes bytes = frame_of(stream, 3);
  const gsize offset = 32, stride = in.stride + 24;
  Bytes padded(offset + stride * static_cast<gsize>(in.height), 0xA5);
  for (int y = 0; y < in.height; ++y) {
    std::memcpy(padded.data() + offset + stride * static_cast<gsize>(y),
                bytes.data() + in.stride * static_cast<gsize>(y), in.stride);
  }
  GstBuffer* buffer = buffer_of(padded, 0);
  gsize offsets[GST_VIDEO_MAX_PLANES] = {offset};
  gint strides[GST_VIDEO_MAX_PLANES] = {static_cast<gint>(stride)};
  gst_buffer_add_video_meta_full(buffer, GST_VIDEO_FRAME_FLAG_NONE, GST_VIDEO_FORMAT_GRAY16_LE,
                                 static_cast<guint>(in.width), static_cast<guint>(in.height), 1, offsets, strides);
  GstBuffer* image = gst_harness_push_and_pull(harness.get(), buffer);
  const OutputCaps caps = output_of(harness.get());
  Reference reference(false);
  reference.configure(stream, caps);
  expect_image(image, caps, reference, reference.processed(bytes, 0));
}

TEST(LowluxIsp, RowsAreThoseOfGstreamersElementsOrOfDrivers) {
  const Stream stream{.width = 50};  // rows of 100 bytes, padded to 52 pixels
  const InputCaps in = stream.in();
  ASSERT_EQ(in.stride, 104U);
  const Stream bytewise{.mosaic = "rggb", .width = 50};
  EXPECT_EQ(bytewise.in().stride, 52U);
  for (const char* const format : {"GRAY8", "GRAY16_LE"}) {
    for (const int width : {48, 49, 50, 51}) {
      const Stream grey{.mosaic = format, .width = width};
      GstCaps* caps = gst_caps_from_string(grey.sink_caps().c_str());
      GstVideoInfo info;
      ASSERT_NE(gst_video_info_from_caps(&info, caps), FALSE);
      gst_caps_unref(caps);
      EXPECT_EQ(grey.in().stride, static_cast<std::size_t>(GST_VIDEO_INFO_PLANE_STRIDE(&info, 0))) << format << width;
    }
  }
  const Bytes bytes = frame_of(stream, 3);
  Bytes tight;
  for (int y = 0; y < in.height; ++y) {
    const auto row = bytes.begin() + static_cast<std::ptrdiff_t>(in.stride) * y;
    tight.insert(tight.end(), row, row + 100);
  }
  for (const Bytes& frame : {bytes, tight}) {
    const Harness harness = harness_of(stream);
    GstBuffer* image = gst_harness_push_and_pull(harness.get(), buffer_of(frame, 0));
    const OutputCaps caps = output_of(harness.get());
    Reference reference(false);
    reference.configure(stream, caps);
    expect_image(image, caps, reference, reference.processed(bytes, 0));
  }
}

TEST(LowluxIsp, ForgetsFramesBeforeAFlushAndAGap) {
  for (const bool flush : {true, false}) {
    const Stream stream{.width = 96, .height = 80};
    const Harness harness = harness_of(stream, true);
    Reference reference(true);
    for (int frame = 0; frame < 6; ++frame) {
      const Bytes bytes = frame_of(stream, static_cast<std::uint32_t>(frame));
      GstBuffer* buffer = buffer_of(bytes, frame);
      if (frame == 3 && flush) {
        gst_harness_push_event(harness.get(), gst_event_new_flush_start());
        gst_harness_push_event(harness.get(), gst_event_new_flush_stop(TRUE));
        GstSegment segment;
        gst_segment_init(&segment, GST_FORMAT_TIME);
        gst_harness_push_event(harness.get(), gst_event_new_segment(&segment));
      }
      if (frame == 3 && !flush) GST_BUFFER_FLAG_SET(buffer, GST_BUFFER_FLAG_DISCONT);
      GstBuffer* image = gst_harness_push_and_pull(harness.get(), buffer);
      const OutputCaps caps = output_of(harness.get());
      if (frame == 0) reference.configure(stream, caps);
      if (frame == 3) reference.reset();
      expect_image(image, caps, reference, reference.processed(bytes, frame));
    }
  }
}

/// Returns the text of the error on a bus; empty: there is none.
std::string error_on(GstBus* bus) {
  GstMessage* message = gst_bus_pop_filtered(bus, GST_MESSAGE_ERROR);
  if (message == nullptr) return "";
  GError* error = nullptr;
  gst_message_parse_error(message, &error, nullptr);
  std::string text = error->message;
  g_error_free(error);
  gst_message_unref(message);
  return text;
}

struct UnrefBus {
  void operator()(GstBus* bus) const { gst_object_unref(bus); }
};
using Bus = std::unique_ptr<GstBus, UnrefBus>;

TEST(LowluxIsp, RefusesABufferThatEndsBeforeTheFrame) {
  const Stream stream;
  const Harness harness = harness_of(stream);
  const Bus bus(gst_bus_new());
  gst_element_set_bus(harness->element, bus.get());
  Bytes bytes = frame_of(stream, 1);
  bytes.resize(bytes.size() / 2);
  EXPECT_EQ(gst_harness_push(harness.get(), buffer_of(bytes, 0)), GST_FLOW_ERROR);
  EXPECT_EQ(error_on(bus.get()), "the input ends before the frame does");
  const Bytes whole = frame_of(stream, 1);
  EXPECT_EQ(gst_harness_push(harness.get(), buffer_of(whole, 1)), GST_FLOW_OK) << "the next frame is processed";
  gst_element_set_bus(harness->element, nullptr);
}

TEST(LowluxIsp, NamesItsPropertiesWhereTheLuminanceOfTheSceneIsUnknown) {
  const Stream stream;
  const Bytes bytes = frame_of(stream, 1);
  const Harness harness = harness_of(stream, false, "eye");
  const Bus bus(gst_bus_new());
  gst_element_set_bus(harness->element, bus.get());
  EXPECT_EQ(gst_harness_push(harness.get(), buffer_of(bytes, 0)), GST_FLOW_ERROR);
  const std::string error = error_on(bus.get());
  for (const char* name : {"lux", "exposure-time", "f-number", "analogue-gain"}) {
    EXPECT_NE(error.find(name), std::string::npos) << error;
  }
  EXPECT_EQ(error.find("--"), std::string::npos) << error;
  g_object_set(harness->element, "lux", 10.0, nullptr);
  EXPECT_EQ(gst_harness_push(harness.get(), buffer_of(bytes, 1)), GST_FLOW_OK);
  gst_element_set_bus(harness->element, nullptr);
}

TEST(LowluxIsp, WarnsOnceOfAPropertyWithoutTheOneItRequires) {
  const Stream stream;
  const Bytes bytes = frame_of(stream, 1);
  const Harness harness = harness_of(stream);
  const Bus bus(gst_bus_new());
  gst_element_set_bus(harness->element, bus.get());
  int frame = 0;
  const auto expect_warnings = [&](const std::vector<std::string>& expected) {
    for (int i = 0; i < 2; ++i) EXPECT_EQ(gst_harness_push(harness.get(), buffer_of(bytes, frame++)), GST_FLOW_OK);
    std::vector<std::string> found;
    while (GstMessage* message = gst_bus_pop_filtered(bus.get(), GST_MESSAGE_WARNING)) {
      GError* warning = nullptr;
      gst_message_parse_warning(message, &warning, nullptr);
      found.emplace_back(warning->message);
      g_error_free(warning);
      gst_message_unref(message);
    }
    EXPECT_EQ(found, expected);
  };
  expect_warnings({});
  g_object_set(harness->element, "red-gain", 2.0, nullptr);
  expect_warnings({"red-gain has no effect: it requires blue-gain"});
  g_object_set(harness->element, "blue-gain", 1.5, "noise-gain", 0.5, nullptr);
  expect_warnings({"noise-gain has no effect: it requires noise-read"});
  g_object_set(harness->element, "red-gain", 0.0, "noise-read", 1.5, nullptr);
  expect_warnings({"blue-gain has no effect: it requires red-gain"});
  g_object_set(harness->element, "blue-gain", 0.0, "noise-gain", 0.0, nullptr);
  expect_warnings({"noise-read has no effect: it requires noise-gain"});
  gst_element_set_bus(harness->element, nullptr);
}

TEST(LowluxIsp, RefusesCapsThatSayTooLittle) {
  for (const char* caps : {"video/x-bayer, width=64, height=48, framerate=30/1",
                           "video/x-bayer, format=rggb, width=0, height=48, framerate=30/1",
                           "video/x-bayer, format=rggb, width=64, height=1, framerate=30/1",
                           "video/x-bayer, format=xtrans, width=64, height=48, framerate=30/1",
                           "video/x-raw, format=RGB, width=64, height=48, framerate=30/1"}) {
    GstElement* element = gst_element_factory_make("lowluxisp", nullptr);
    const Harness harness(gst_harness_new_with_element(element, "sink", "src"));
    gst_object_unref(element);
    gst_harness_set_sink_caps_str(harness.get(), "video/x-raw, format=RGBx");
    GstPad* sink = gst_element_get_static_pad(harness->element, "sink");
    GstCaps* refused = gst_caps_from_string(caps);
    EXPECT_EQ(gst_pad_query_accept_caps(sink, refused) != FALSE && gst_caps_is_fixed(refused) != FALSE &&
                  read_input_caps(refused).has_value(),
              false)
        << caps;
    gst_caps_unref(refused);
    gst_object_unref(sink);
  }
}

TEST(LowluxIsp, MonochromeFramesHaveNoMosaicToOutput) {
  GstCaps* sink = gst_caps_from_string("video/x-raw, format=GRAY8, width=64, height=48, framerate=30/1");
  GstCaps* source = other_caps(GST_PAD_SINK, sink);
  GstCaps* mosaic = gst_caps_from_string("video/x-bayer");
  GstCaps* picture = gst_caps_from_string("video/x-raw, format=NV12");
  EXPECT_EQ(gst_caps_can_intersect(source, mosaic), FALSE);
  EXPECT_NE(gst_caps_can_intersect(source, picture), FALSE);
  EXPECT_FALSE(read_output_caps(sink));
  for (GstCaps* const caps : {sink, source, mosaic, picture}) gst_caps_unref(caps);
}

TEST(LowluxIsp, DoesNotStartWithoutItsProfile) {
  GstElement* element = gst_element_factory_make("lowluxisp", nullptr);
  gst_object_ref_sink(element);
  const Bus bus(gst_bus_new());
  gst_element_set_bus(element, bus.get());
  g_object_set(element, "profile", "/nowhere/camera.json", nullptr);
  EXPECT_EQ(gst_element_set_state(element, GST_STATE_PAUSED), GST_STATE_CHANGE_FAILURE);
  EXPECT_EQ(error_on(bus.get()), "/nowhere/camera.json: the profile cannot be read");
  gst_element_set_state(element, GST_STATE_NULL);
  gst_element_set_bus(element, nullptr);
  gst_object_unref(element);
}

TEST(LowluxIsp, LeavesOutFramesThatComeTooLate) {
  const Stream stream;
  const Harness harness = harness_of(stream);
  const Bytes bytes = frame_of(stream, 1);
  ASSERT_EQ(gst_harness_push(harness.get(), buffer_of(bytes, 0)), GST_FLOW_OK);
  gst_harness_push_upstream_event(harness.get(), gst_event_new_qos(GST_QOS_TYPE_UNDERFLOW, 2, GST_SECOND, 0));
  ASSERT_EQ(gst_harness_push(harness.get(), buffer_of(bytes, 1)), GST_FLOW_OK);
  EXPECT_EQ(gst_harness_buffers_received(harness.get()), 1U);
  ASSERT_EQ(gst_harness_push(harness.get(), buffer_of(bytes, 60)), GST_FLOW_OK);
  EXPECT_EQ(gst_harness_buffers_received(harness.get()), 2U);
}

TEST(LowluxIsp, PostsWhatWasDoneWhereAsked) {
  const Stream stream;
  const Harness harness = harness_of(stream);
  const Bus bus(gst_bus_new());
  gst_element_set_bus(harness->element, bus.get());
  g_object_set(harness->element, "post-messages", TRUE, "black-level", 60.0, "noise-gain", 0.5, "noise-read", 1.5,
               nullptr);
  ASSERT_EQ(gst_harness_push(harness.get(), buffer_of(frame_of(stream, 1), 0)), GST_FLOW_OK);
  GstMessage* message = gst_bus_pop_filtered(bus.get(), GST_MESSAGE_ELEMENT);
  ASSERT_NE(message, nullptr);
  const GstStructure* told = gst_message_get_structure(message);
  double black = 0, gain = 0, read = 0;
  EXPECT_TRUE(gst_structure_get(told, "black-level", G_TYPE_DOUBLE, &black, "noise-gain", G_TYPE_DOUBLE, &gain,
                                "noise-read", G_TYPE_DOUBLE, &read, nullptr));
  EXPECT_EQ(black, 60);
  EXPECT_EQ(gain, 0.5);
  EXPECT_NEAR(read, std::sqrt(1.5 * 1.5 + 1.0 / 12), 1e-6) << "with the rounding to codes";
  gst_message_unref(message);
  gst_element_set_bus(harness->element, nullptr);
}

TEST(LowluxIsp, TakesPixelsAtTheWhiteLevelForSaturated) {
  Stream stream;
  stream.output = "RGB";
  const InputCaps caps = stream.in();
  Bytes bytes(caps.stride * static_cast<std::size_t>(stream.height));
  for (std::size_t i = 0; i < bytes.size(); i += 2) {  // 700 of 1023
    bytes[i] = 700 & 255;
    bytes[i + 1] = 700 >> 8;
  }
  for (const double white : {0.0, 700.0}) {
    const Harness harness = harness_of(stream, false, "camera", white);
    // With these gains an unsaturated pixel is magenta.
    g_object_set(harness->element, "black-level", 64.0, "red-gain", 2.0, "blue-gain", 2.0, "exposure-ev", 0.0, nullptr);
    ASSERT_EQ(gst_harness_push(harness.get(), buffer_of(bytes, 0)), GST_FLOW_OK);
    GstBuffer* image = gst_harness_pull(harness.get());
    GstMapInfo map{};
    ASSERT_NE(gst_buffer_map(image, &map, GST_MAP_READ), FALSE);
    const int red = map.data[0], green = map.data[1];
    gst_buffer_unmap(image, &map);
    gst_buffer_unref(image);
    if (white > 0) {
      EXPECT_EQ(red, 255);
      EXPECT_EQ(green, 255);
    } else {
      EXPECT_LT(green, 240);
    }
  }
}

TEST(LowluxIsp, NamesTheMatrixAndThePlaceOfChroma) {
  for (const int height : {48, 720}) {
    Stream stream;
    stream.output = "NV12";
    stream.height = height;
    const Harness harness = harness_of(stream);
    ASSERT_EQ(gst_harness_push(harness.get(), buffer_of(frame_of(stream, 1), 0)), GST_FLOW_OK);
    const GstVideoInfo info = output_of(harness.get()).picture;
    EXPECT_EQ(info.chroma_site, GST_VIDEO_CHROMA_SITE_JPEG);
    EXPECT_EQ(info.colorimetry.matrix, height < 720 ? GST_VIDEO_COLOR_MATRIX_BT601 : GST_VIDEO_COLOR_MATRIX_BT709);
  }
}

// At either end of the range of each number and between, alone.
TEST(LowluxIsp, NoValueOfAPropertyEndsTheStream) {
  const Stream stream;
  const Bytes bytes = frame_of(stream, 1);
  std::mt19937 random(20261125);
  for (const char* name : {"exposure-time", "analogue-gain", "noise-gain", "noise-read", "red-gain", "blue-gain",
                           "saturation", "exposure-ev", "lux", "f-number", "budget-ms", "field-of-view"}) {
    for (int i = 0; i < 6; ++i) {
      const Harness harness = harness_of(stream);
      g_object_set(harness->element, "noise-gain", 0.5, "noise-read", 1.5, "red-gain", 2.0, "blue-gain", 1.5, nullptr);
      const auto* const spec =
          reinterpret_cast<GParamSpecDouble*>(g_object_class_find_property(G_OBJECT_GET_CLASS(harness->element), name));
      const double share = std::pow(10, -std::uniform_real_distribution(0.0, 12.0)(random));
      const double value =
          i == 0 ? spec->minimum : spec->minimum + (spec->maximum - spec->minimum) * (i == 1 ? 1 : share);
      g_object_set(harness->element, name, value, nullptr);
      EXPECT_EQ(gst_harness_push(harness.get(), buffer_of(bytes, 0)), GST_FLOW_OK) << name << " " << value;
    }
  }
}

TEST(LowluxIsp, PropertiesAreReturnedAsTheyWereSet) {
  GstElement* element = gst_element_factory_make("lowluxisp", nullptr);
  gst_object_ref_sink(element);
  guint count = 0;
  GParamSpec** specs = g_object_class_list_properties(G_OBJECT_GET_CLASS(element), &count);
  int checked = 0;
  for (guint i = 0; i < count; ++i) {
    if (specs[i]->owner_type != G_OBJECT_TYPE(element)) continue;
    ++checked;
    SCOPED_TRACE(specs[i]->name);
    GValue set = G_VALUE_INIT, got = G_VALUE_INIT;
    g_value_init(&set, specs[i]->value_type);
    g_value_init(&got, specs[i]->value_type);
    g_object_get_property(G_OBJECT(element), specs[i]->name, &got);
    EXPECT_NE(g_param_value_defaults(specs[i], &got), FALSE) << "not the default at first";
    if (G_VALUE_HOLDS_DOUBLE(&set)) g_value_set_double(&set, 3.5);
    if (G_VALUE_HOLDS_INT(&set)) g_value_set_int(&set, 3);
    if (G_VALUE_HOLDS_ENUM(&set)) g_value_set_enum(&set, 1);
    if (G_VALUE_HOLDS_STRING(&set)) g_value_set_string(&set, "camera.json");
    if (G_VALUE_HOLDS_BOOLEAN(&set)) {
      g_value_set_boolean(&set, static_cast<gboolean>(std::string_view(specs[i]->name) != "tone"));
    }
    g_object_set_property(G_OBJECT(element), specs[i]->name, &set);
    g_object_get_property(G_OBJECT(element), specs[i]->name, &got);
    EXPECT_EQ(g_param_values_cmp(specs[i], &set, &got), 0);
    g_value_unset(&set);
    g_value_unset(&got);
  }
  EXPECT_EQ(checked, 22);
  g_free(specs);
  gst_object_unref(element);
}

// LOWLUX_GSTREAMER_FRAMES states how many frames; scripts/nightly has 100,000.
TEST(LowluxIspSoak, CapsChangesAndFlushesLoseNothing) {
  const char* stated = std::getenv("LOWLUX_GSTREAMER_FRAMES");
  const int frames = stated == nullptr ? 1500 : std::atoi(stated);
  std::mt19937 random(20261124);
  Stream stream = drawn(random);
  const Harness harness = harness_of(stream, true);
  Bytes bytes = frame_of(stream, 1);
  unsigned received = 0;
  std::set<std::string> outputs;
  for (int frame = 0; frame < frames; ++frame) {
    const unsigned event = random() % 50;
    if (event == 0) {
      stream = drawn(random);
      gst_harness_set_sink_caps_str(harness.get(), stream.source_caps().c_str());
      gst_harness_set_src_caps_str(harness.get(), stream.sink_caps().c_str());
      bytes = frame_of(stream, random());
    } else if (event == 1) {
      gst_harness_push_event(harness.get(), gst_event_new_flush_start());
      gst_harness_push_event(harness.get(), gst_event_new_flush_stop(TRUE));
      GstSegment segment;
      gst_segment_init(&segment, GST_FORMAT_TIME);
      gst_harness_push_event(harness.get(), gst_event_new_segment(&segment));
    } else if (event == 2) {
      g_object_set(harness->element, "budget-ms", static_cast<double>(random() % 3), nullptr);
    }
    ASSERT_EQ(gst_harness_push(harness.get(), buffer_of(bytes, frame)), GST_FLOW_OK) << "frame " << frame;
    while (GstBuffer* image = gst_harness_try_pull(harness.get())) {
      ASSERT_EQ(gst_buffer_get_size(image), output_of(harness.get()).bytes()) << "frame " << frame;
      gst_buffer_unref(image);
      outputs.insert(stream.output);
      ++received;
    }
  }
  EXPECT_EQ(received, static_cast<unsigned>(frames));
  if (frames >= 1500) {
    EXPECT_EQ(outputs.size(), 6U) << "each output was made";
  }
}

}  // namespace
}  // namespace lowlux::gst

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  gst_init(&argc, &argv);
  GError* error = nullptr;
  GstPlugin* plugin = gst_plugin_load_file(LOWLUX_GSTREAMER_PLUGIN, &error);
  if (plugin == nullptr) {
    g_printerr("%s\n", error->message);
    return 1;
  }
  gst_object_unref(plugin);
  return RUN_ALL_TESTS();
}
