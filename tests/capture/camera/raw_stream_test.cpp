#include "capture/libcamera/raw_stream.h"

#include <limits>

#include <gtest/gtest.h>

#include "capture/camera/camera_request.h"

namespace lowlux::capture {
namespace {

constexpr std::uint64_t csi2_modifier = (std::uint64_t{11} << 56) | 1;

constexpr RawFormat srggb10{.bits = 10};
constexpr RawFormat srggb12_packed{.bits = 12, .packing = RawPacking::csi2};

/// Codes as libcamera's formats.h writes them, not taken from the table under test.
const std::vector<OfferedStream>& a_camera() {
  static const std::vector<OfferedStream> streams{
      {.drm_fourcc = fourcc('X', 'R', '2', '4'), .sizes = {{640, 480}}},
      {.drm_fourcc = fourcc('R', '1', '2', ' '), .sizes = {{4056, 3040}}},
      {.drm_fourcc = fourcc('R', 'G', '1', '0'), .sizes = {{1332, 990}}},
      {.drm_fourcc = fourcc('R', 'G', '1', '2'),
       .drm_modifier = csi2_modifier,
       .sizes = {{2028, 1520}, {4056, 3040}, {2028, 1080}}},
      {.drm_fourcc = fourcc('R', 'G', '1', '2'), .drm_modifier = 77, .sizes = {{4056, 3040}}},
  };
  return streams;
}

TEST(CameraRequest, OnlyWhatMakesSenseWhateverTheCameraPasses) {
  EXPECT_TRUE(check_camera_request({}));
  EXPECT_TRUE(check_camera_request({.width = 1, .height = 65535, .frame_rate_hz = 0.01, .buffers = 32}));
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  for (const CameraRequest& ill :
       {CameraRequest{.buffers = 1}, CameraRequest{.buffers = 33}, CameraRequest{.width = 640},
        CameraRequest{.height = 480}, CameraRequest{.width = 0, .height = 480},
        CameraRequest{.width = 640, .height = 65536}, CameraRequest{.width = -640, .height = 480},
        CameraRequest{.frame_rate_hz = 0.0}, CameraRequest{.frame_rate_hz = infinity},
        CameraRequest{.exposure_s = -1.0}, CameraRequest{.exposure_s = nan}, CameraRequest{.analogue_gain = nan}}) {
    const auto checked = check_camera_request(ill);
    ASSERT_FALSE(checked);
    EXPECT_EQ(checked.error().code, ErrorCode::invalid_argument);
  }
}

TEST(FindCamera, ByIdThenByPlaceThenByTextThatOnlyOneHas) {
  const std::vector<CameraListing> cameras{{.id = "/base/i2c/imx219@10", .name = "imx219", .formats = {}},
                                           {.id = "/base/i2c/imx477@1a", .name = "imx477", .formats = {}},
                                           {.id = "0", .name = "webcam", .formats = {}}};
  EXPECT_EQ(find_camera(cameras, "/base/i2c/imx477@1a"), 1);
  EXPECT_EQ(find_camera(cameras, "1"), 1);  // though three have a 1 somewhere
  EXPECT_EQ(find_camera(cameras, "0"), 2);  // an id goes before a place
  EXPECT_EQ(find_camera(cameras, "imx219"), 0);
  EXPECT_EQ(find_camera(cameras, "477"), 1);  // no place: text
  EXPECT_EQ(find_camera(cameras, "web"), 2);
}

TEST(FindCamera, AnErrorNamesWhatThereIs) {
  const std::vector<CameraListing> cameras{{.id = "a1", .name = "left", .formats = {}},
                                           {.id = "a2", .name = "", .formats = {}}};
  for (const char* several : {"a", ""}) {
    const auto found = find_camera(cameras, several);
    ASSERT_FALSE(found);
    EXPECT_EQ(found.error().code, ErrorCode::invalid_argument);
    EXPECT_EQ(found.error().message, R"(2 cameras match, and only one can be opened: there is "a1" (left), "a2")");
  }
  for (const char* none : {"b", "-1", "3", "99999999999999999999"}) {
    const auto found = find_camera(cameras, none);
    ASSERT_FALSE(found);
    EXPECT_EQ(found.error().code, ErrorCode::not_found);
    EXPECT_EQ(found.error().where, none);
  }
  EXPECT_EQ(find_camera({}, "0").error().code, ErrorCode::not_found);
  EXPECT_EQ(find_camera(std::span(cameras).first(1), ""), 0);
}

TEST(RawStream, AListingHasTheRawFormatsOnly) {
  EXPECT_EQ(raw_stream_texts(a_camera()), (std::vector<std::string>{"R12 4056x3040", "SRGGB10 1332x990",
                                                                    "SRGGB12_CSI2P 2028x1520 4056x3040 2028x1080"}));
  EXPECT_TRUE(raw_stream_texts(std::span(a_camera()).first(1)).empty());
}

TEST(RawStream, TheDeepestBayerFormatAtItsLargestSizeIsTaken) {
  const auto choice = choose_raw_stream(a_camera(), {}, "camera");
  ASSERT_TRUE(choice) << choice.error().message;
  EXPECT_EQ(choice->format, srggb12_packed);
  EXPECT_EQ(choice->drm_fourcc, fourcc('R', 'G', '1', '2'));
  EXPECT_EQ(choice->drm_modifier, csi2_modifier);
  EXPECT_EQ(choice->size, (FrameSize{4056, 3040}));
}

TEST(RawStream, MonochromeIsTakenWhereThereIsNoBayer) {
  const auto choice = choose_raw_stream(std::span(a_camera()).first(2), {}, "camera");
  ASSERT_TRUE(choice) << choice.error().message;
  EXPECT_EQ(choice->format.layout, SensorLayout::monochrome);
}

TEST(RawStream, OfEqualDepthsTheLargestSizeDecidesAndThenTheOrder) {
  std::vector<OfferedStream> offered{{.drm_fourcc = fourcc('B', 'A', '1', '0'), .sizes = {{640, 480}}},
                                     {.drm_fourcc = fourcc('R', 'G', '1', '0'), .sizes = {{640, 480}, {1332, 990}}}};
  EXPECT_EQ(choose_raw_stream(offered, {}, "camera")->format.phase, BayerPhase::rggb);
  EXPECT_EQ(choose_raw_stream(offered, {.width = 640, .height = 480}, "camera")->format.phase, BayerPhase::rggb);
  offered[1].sizes.pop_back();
  EXPECT_EQ(choose_raw_stream(offered, {}, "camera")->format.phase, BayerPhase::grbg);
}

TEST(RawStream, ASizeAskedForDecidesBeforeTheDepth) {
  const auto listed = choose_raw_stream(a_camera(), {.width = 1332, .height = 990}, "camera");
  ASSERT_TRUE(listed) << listed.error().message;
  EXPECT_EQ(listed->format, srggb10);
  const auto unlisted = choose_raw_stream(a_camera(), {.width = 1000, .height = 990}, "camera");
  ASSERT_TRUE(unlisted) << unlisted.error().message;
  EXPECT_EQ(unlisted->format, srggb12_packed);
  EXPECT_EQ(unlisted->size, (FrameSize{1000, 990}));
}

TEST(RawStream, AFormatAskedForIsTakenOrRefusedWithWhatThereIs) {
  const auto taken = choose_raw_stream(a_camera(), {.format = srggb10}, "camera");
  ASSERT_TRUE(taken) << taken.error().message;
  EXPECT_EQ(taken->format, srggb10);
  const auto refused = choose_raw_stream(a_camera(), {.format = RawFormat{.bits = 12}}, "camera");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::unsupported);
  EXPECT_EQ(refused.error().message,
            "this camera does not offer SRGGB12, but R12 4056x3040, SRGGB10 1332x990, "
            "SRGGB12_CSI2P 2028x1520 4056x3040 2028x1080");
}

TEST(RawStream, PicturesAreNeverTakenForRaw) {
  const std::vector<OfferedStream> pictures{{.drm_fourcc = fourcc('B', 'G', '2', '4'), .sizes = {{640, 480}}},
                                            {.drm_fourcc = fourcc('N', 'V', '1', '2'), .sizes = {{640, 480}}},
                                            {.drm_fourcc = fourcc('R', 'G', '1', '6'), .sizes = {}}};  // RGB565
  for (const auto& offered : {pictures, std::vector<OfferedStream>{}}) {
    const auto choice = choose_raw_stream(offered, {}, "Sensor B");
    ASSERT_FALSE(choice);
    EXPECT_EQ(choice.error().code, ErrorCode::unsupported);
    EXPECT_TRUE(choice.error().message.starts_with("this camera offers no raw stream in a known format"));
    EXPECT_EQ(choice.error().where, "Sensor B");
  }
}

TEST(RawStream, WithoutListedSizesTheCameraDecides) {
  const std::vector<OfferedStream> offered{{.drm_fourcc = fourcc('R', 'G', '1', '0')}};
  EXPECT_EQ(choose_raw_stream(offered, {}, "camera")->size, FrameSize{});
}

RawStreamChoice chosen() { return {.format = srggb10, .drm_fourcc = fourcc('R', 'G', '1', '0'), .size = {640, 480}}; }
AgreedStream agreed() {
  return {.drm_fourcc = fourcc('R', 'G', '1', '0'),
          .width = 640,
          .height = 480,
          .stride_bytes = 1280,
          .frame_bytes = 1280 * 480,
          .buffers = 4};
}

TEST(AgreedFormat, IsTheOneOfTheStreamAsItCameBack) {
  std::vector<std::string> warnings;
  AgreedStream wide = agreed();
  wide.stride_bytes = 1536;
  wide.frame_bytes = 1536 * 479 + 1280;  // the last row may end with its samples
  const auto format = agreed_format(wide, chosen(), {.format = srggb10, .width = 640, .height = 480}, warnings);
  ASSERT_TRUE(format) << format.error().message;
  EXPECT_EQ(format->raw, srggb10);
  EXPECT_EQ(format->width, 640);
  EXPECT_EQ(format->height, 480);
  EXPECT_EQ(format->stride_bytes, 1536U);
  EXPECT_FALSE(format->frame_rate_hz);
  EXPECT_EQ(frame_bytes(*format), 1536U * 479 + 1280);
  EXPECT_TRUE(warnings.empty());
}

TEST(AgreedFormat, AnAdjustedSizeIsAWarningOrWhereItWasAskedForAnError) {
  AgreedStream adjusted = agreed();
  adjusted.width = 636;
  std::vector<std::string> warnings;
  const auto format = agreed_format(adjusted, chosen(), {}, warnings);
  ASSERT_TRUE(format) << format.error().message;
  EXPECT_EQ(format->width, 636);
  EXPECT_EQ(warnings, std::vector<std::string>{"the camera gives 636x480 in place of 640x480"});
  const auto refused = agreed_format(adjusted, chosen(), {.width = 640, .height = 480}, warnings);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::unsupported);
  EXPECT_EQ(refused.error().message, "the camera gives 636x480 in place of 640x480: ask for a size it has");
  RawStreamChoice any_size = chosen();
  any_size.size = {};
  warnings.clear();
  EXPECT_TRUE(agreed_format(adjusted, any_size, {}, warnings));
  EXPECT_TRUE(warnings.empty());
}

TEST(AgreedFormat, AnotherFormatIsAWarningOrWhereItWasAskedForAnError) {
  AgreedStream adjusted = agreed();
  adjusted.drm_fourcc = fourcc('R', 'G', '1', '2');
  std::vector<std::string> warnings;
  EXPECT_EQ(agreed_format(adjusted, chosen(), {}, warnings)->raw.bits, 12);
  EXPECT_EQ(warnings, std::vector<std::string>{"the camera gives SRGGB12 in place of SRGGB10"});
  const auto refused = agreed_format(adjusted, chosen(), {.format = srggb10}, warnings);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::unsupported);
}

TEST(AgreedFormat, ThePhaseIsTheOneAfterTheFlips) {
  AgreedStream flipped = agreed();
  flipped.drm_fourcc = fourcc('B', 'G', '1', '0');
  std::vector<std::string> warnings;
  EXPECT_EQ(agreed_format(flipped, chosen(), {}, warnings)->raw.phase, BayerPhase::bggr);
  EXPECT_TRUE(warnings.empty());  // nobody asked for a phase
  EXPECT_EQ(agreed_format(flipped, chosen(), {.format = srggb10}, warnings)->raw.phase, BayerPhase::bggr);
  EXPECT_EQ(warnings, std::vector<std::string>{"the camera gives SBGGR10 in place of SRGGB10: the sensor's flips "
                                               "decide which colour comes first"});
}

TEST(AgreedFormat, ContradictionsAreRefused) {
  std::vector<std::string> warnings;
  const auto code_of = [&](auto&& change) {
    AgreedStream ill = agreed();
    change(ill);
    const auto format = agreed_format(ill, chosen(), {}, warnings);
    return format ? std::optional<ErrorCode>() : format.error().code;
  };
  constexpr std::uint32_t huge = std::numeric_limits<std::uint32_t>::max();
  EXPECT_EQ(code_of([](AgreedStream& a) { a.drm_fourcc = fourcc('B', 'G', '2', '4'); }), ErrorCode::unsupported);
  EXPECT_EQ(code_of([](AgreedStream& a) { a.width = 0; }), ErrorCode::malformed);
  EXPECT_EQ(code_of([](AgreedStream& a) { a.height = 65536; }), ErrorCode::malformed);
  EXPECT_EQ(code_of([](AgreedStream& a) { a.width = huge; }), ErrorCode::malformed);
  EXPECT_EQ(code_of([](AgreedStream& a) { a.stride_bytes = 1279; }), ErrorCode::malformed);
  EXPECT_EQ(code_of([](AgreedStream& a) { a.stride_bytes = 0; }), ErrorCode::malformed);
  EXPECT_EQ(code_of([](AgreedStream& a) { a.stride_bytes = huge; }), ErrorCode::malformed);
  EXPECT_EQ(code_of([](AgreedStream& a) { --a.frame_bytes; }), ErrorCode::malformed);
  EXPECT_EQ(code_of([](AgreedStream& a) { a.frame_bytes = 0x40000000; }), std::nullopt);  // 4 GiB of four
  EXPECT_EQ(code_of([](AgreedStream& a) { a.frame_bytes = 0x40000001; }), ErrorCode::too_large);
  EXPECT_EQ(code_of([](AgreedStream& a) { a.buffers = huge; }), ErrorCode::too_large);
}

}  // namespace
}  // namespace lowlux::capture
