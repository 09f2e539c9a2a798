#include "isp/output/dng/dng_writer.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <tiffio.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <functional>
#include <iterator>
#include <limits>
#include <memory>
#include <sstream>

#include "isp/output/dng/dng_check.h"
#include "isp/output/dng/dng_tags.h"
#include "tests/support/as_floats.h"
#include "tests/support/numbers.h"
#include "tests/support/process.h"
#include "tests/support/raw_frames.h"
#include "tests/support/scratch_directory.h"
#include "tests/support/this_process.h"

namespace lowlux::isp {
namespace {

using test::nan;
using test::plain_frame;
using test::ScratchDirectory;
constexpr double infinity = std::numeric_limits<double>::infinity();

std::shared_ptr<const NoiseRatio> ratio_of(const Rect& active, int block_px) {
  NoiseRatio out{.block_px = block_px,
                 .ratio = Plane<float>(ratio_blocks(active.width, block_px), ratio_blocks(active.height, block_px))};
  for (std::size_t i = 0; i < out.ratio.size(); ++i) out.ratio.data()[i] = i % 3 == 0 ? 1 : 0.125f;
  return std::make_shared<const NoiseRatio>(std::move(out));
}

/// A frame that has every tag the writer knows.
RawFrame full_frame(SensorLayout layout) {
  RawFrame frame = plain_frame(50, 41, layout);
  frame.raw.active = {6, 2, 43, 38};
  frame.raw.default_crop = {1, 1, 40, 36};
  frame.raw.masked = {{0, 2, 5, 38}};
  frame.raw.masked_is_stated = true;
  frame.raw.black_tag->column_dn.assign(43, -0.25);
  frame.raw.black_tag->row_dn.assign(38, 0.1);
  FrameInfo& info = frame.raw.info;
  info.date_time = "2024:02:03 04:05:06";
  info.exposure_s = 0.25;
  info.iso = 102400;
  info.f_number = 1.4;
  info.focal_length_mm = 35;
  info.temperature_c = -3.5;
  info.orientation = Orientation::rotate_90;
  frame.noise = NoiseProfile{{1e-4, 1e-4, 1e-4}, {1e-7, 1e-7, 1e-7}};
  frame.noise_ratio = ratio_of(frame.raw.active, 8);
  frame.corrections.defects = {{3, 4, 1, 2}};
  frame.corrections.radial_gains = {{{0.1, 0, 0, 0, 0}, 0.5, 0.5}};
  if (layout == SensorLayout::monochrome) return frame;
  ColourCalibration lamp = frame.colour.calibrations[0];
  lamp.cct_k = 2856;
  lamp.camera_calibration = diagonal3({1.01, 1, 0.98});
  lamp.forward = Matrix3{{{0.7, 0.2, 0.0642}, {0.3, 0.8, -0.1}, {0, -0.1, 0.9251}}};
  frame.colour.calibrations.insert(frame.colour.calibrations.begin(), lamp);
  return frame;
}

bool is_installed(const std::string& program) {
  return test::run_process({"sh", "-c", "command -v " + program}).exit_code == 0;
}

/// The independent reader. An error or a warning is a line of its own.
TEST(DngWriter, ExiftoolFindsNothingWrong) {
  if (!is_installed("exiftool")) GTEST_SKIP() << "exiftool is not installed";
  const ScratchDirectory scratch;
  for (const SensorLayout layout : {SensorLayout::bayer, SensorLayout::monochrome, SensorLayout::linear_rgb}) {
    for (const auto& [full, floats] : {std::pair{true, false}, {false, false}, {true, true}, {false, true}}) {
      RawFrame frame = full ? full_frame(layout) : plain_frame(50, 41, layout);
      if (floats) test::make_floats(frame.raw);
      const DngCompression compression = full ? DngCompression::none : DngCompression::lossless;
      const auto written =
          write_dng(frame, scratch.file("a.dng"), {.overwrite = Overwrite::yes, .compression = compression});
      ASSERT_TRUE(written) << written.error().message;
      const auto said = test::run_process({"exiftool", "-validate", "-warning", "-error", "-a", scratch.file("a.dng")});
      EXPECT_EQ(said.out, "Validate                        : OK\n") << said.err;
    }
  }
}

std::vector<double> numbers_of(const std::string& text) {
  std::istringstream in(text);
  return {std::istream_iterator<double>(in), {}};
}

TEST(DngWriter, ExiftoolReadsTheSameFigures) {
  if (!is_installed("exiftool")) GTEST_SKIP() << "exiftool is not installed";
  const ScratchDirectory scratch;
  ASSERT_TRUE(write_dng(full_frame(SensorLayout::bayer), scratch.file("a.dng"),
                        {.software = "lowlux 9", .description = "a night, simulated"}));
  const std::string said = test::run_process({"exiftool", "-s", "-n", scratch.file("a.dng")}).out;
  const auto value_of = [&](const std::string& tag) -> std::string {
    const std::size_t line = said.find("\n" + tag + " ");
    if (line == std::string::npos) return "no such tag in " + said;
    const std::size_t start = said.find(": ", line) + 2;
    return said.substr(start, said.find('\n', start) - start);
  };
  const auto expect = [&](const std::string& tag, const std::string& text) { EXPECT_EQ(value_of(tag), text) << tag; };
  const auto expect_near = [&](const std::string& tag, const std::vector<double>& expected) {
    const std::vector<double> found = numbers_of(value_of(tag));
    ASSERT_EQ(found.size(), expected.size()) << tag;
    for (std::size_t i = 0; i < found.size(); ++i) {
      EXPECT_NEAR(found[i], expected[i], 1e-7 * std::fabs(expected[i])) << tag;  // relative: through floats
    }
  };
  expect("FileType", "DNG");
  expect("DNGVersion", "1 4 0 0");
  expect("DNGBackwardVersion", "1 3 0 0");  // there are opcodes
  expect("UniqueCameraModel", "Maker Model 1");
  expect("SubfileType", "0");
  expect("PhotometricInterpretation", "32803");
  expect("CFARepeatPatternDim", "2 2");
  expect("CFAPattern2", "0 1 1 2");
  expect("CFAPlaneColor", "0 1 2");
  expect("CFALayout", "1");
  expect("ActiveArea", "2 6 40 49");
  expect("MaskedAreas", "2 0 40 5");
  expect("DefaultScale", "1 1");
  expect("DefaultCropOrigin", "1 1");
  expect("DefaultCropSize", "40 36");
  expect("BlackLevel", "256");
  expect("WhiteLevel", "65535");
  expect("CalibrationIlluminant1", "17");
  expect("CalibrationIlluminant2", "21");
  expect_near("ColorMatrix2", {0.8, -0.2, -0.1, -0.4, 1.2, 0.2, -0.1, 0.2, 0.6});
  expect_near("CameraCalibration1", {1.01, 0, 0, 0, 1, 0, 0, 0, 0.98});
  expect_near("ForwardMatrix1", {0.7, 0.2, 0.0642, 0.3, 0.8, -0.1, 0, -0.1, 0.9251});
  expect("AnalogBalance", "1 1 1");
  expect_near("AsShotNeutral", {0.5, 1, 0.6});
  expect("BaselineExposure", "0");
  expect_near("NoiseProfile", {0.0001, 1e-07, 0.0001, 1e-07, 0.0001, 1e-07});
  expect("Software", "lowlux 9");
  expect("ImageDescription", "a night, simulated");
  expect("ModifyDate", "2024:02:03 04:05:06");
  expect("DateTimeOriginal", "2024:02:03 04:05:06");
  expect("ExposureTime", "0.25");
  expect_near("FNumber", {1.4});
  expect("FocalLength", "35");
  expect("RecommendedExposureIndex", "102400");
  expect("AmbientTemperature", "-3.5");
  expect("Orientation", "6");
}

TEST(DngWriter, ASinglePixelIsAFileOfOneSample) {
  const ScratchDirectory scratch;
  for (const SensorLayout layout : {SensorLayout::bayer, SensorLayout::monochrome, SensorLayout::linear_rgb}) {
    RawFrame frame = plain_frame(1, 1, layout);
    test::make_floats(frame.raw);
    for (std::size_t i = 0; i < frame.raw.dn_float.size(); ++i)
      frame.raw.dn_float.data()[i] = 9000 + static_cast<float>(i);
    ASSERT_TRUE(write_dng(frame, scratch.file("a.dng"), {.overwrite = Overwrite::yes}));
    TIFF* tiff = TIFFOpen(scratch.file("a.dng").c_str(), "r");
    ASSERT_NE(tiff, nullptr);
    std::array<float, 3> samples{};
    EXPECT_EQ(TIFFReadEncodedStrip(tiff, 0, samples.data(), sizeof samples), 4 * samples_of(layout));
    EXPECT_EQ(samples[0], 9000);
    EXPECT_EQ(samples[2], layout == SensorLayout::linear_rgb ? 9002 : 0);
    TIFFClose(tiff);
  }
}

TEST(DngWriter, TheRepeatOfBlackIsStatedUnlessItIsTheDefault) {
  const ScratchDirectory scratch;
  for (const bool repeats : {false, true}) {
    RawFrame frame = plain_frame(50, 41, repeats ? SensorLayout::bayer : SensorLayout::linear_rgb);
    if (repeats) frame.raw.black_tag = BlackLevel{.rows = 2, .columns = 2, .pattern_dn = {1, 2, 3, 4}};
    ASSERT_TRUE(write_dng(frame, scratch.file("a.dng"), {.overwrite = Overwrite::yes}));
    TIFF* tiff = TIFFOpen(scratch.file("a.dng").c_str(), "r");
    ASSERT_NE(tiff, nullptr);
    const std::uint16_t* repeat = nullptr;
    EXPECT_EQ(TIFFGetField(tiff, TIFFTAG_BLACKLEVELREPEATDIM, &repeat), repeats ? 1 : 0);
    std::uint16_t count = 0;
    const float* levels = nullptr;
    ASSERT_EQ(TIFFGetField(tiff, TIFFTAG_BLACKLEVEL, &count, &levels), 1);
    EXPECT_EQ(count, repeats ? 4 : 3);
    TIFFClose(tiff);
  }
}

TEST(DngWriter, StripsAreAboutOneMegabyteAndAdjacent) {
  const ScratchDirectory scratch;
  ASSERT_TRUE(write_dng(plain_frame(1000, 1501), scratch.file("a.dng")));
  TIFF* tiff = TIFFOpen(scratch.file("a.dng").c_str(), "r");
  ASSERT_NE(tiff, nullptr);
  std::uint64_t *offset = nullptr, *bytes = nullptr;
  ASSERT_EQ(TIFFNumberOfStrips(tiff), 3u);
  TIFFGetField(tiff, TIFFTAG_STRIPOFFSETS, &offset);
  TIFFGetField(tiff, TIFFTAG_STRIPBYTECOUNTS, &bytes);
  EXPECT_EQ(bytes[0], 524u * 2000);  // the most rows that stay within 2^20 bytes
  for (int i = 1; i < 3; ++i) EXPECT_EQ(offset[i], offset[i - 1] + bytes[i - 1]);
  TIFFClose(tiff);
}

TEST(DngWriter, FloatingPointSamplesAreWrittenBitByBitWithTheirTags) {
  const ScratchDirectory scratch;
  for (const SensorLayout layout : {SensorLayout::bayer, SensorLayout::monochrome, SensorLayout::linear_rgb}) {
    RawFrame frame = plain_frame(500, 700, layout);
    test::make_floats(frame.raw, 1.0 / 65536);
    frame.raw.black_tag->pattern_dn.assign(static_cast<std::size_t>(samples_of(layout)), 0.125);
    frame.raw.white_dn.fill(3);
    const float special[] = {-0.0F, 1e-45F, -2.5F, 5e7F, std::numeric_limits<float>::min()};
    std::ranges::copy(special, frame.raw.dn_float.data());
    ASSERT_TRUE(write_dng(frame, scratch.file("a.dng"), {.overwrite = Overwrite::yes, .baseline_exposure_ev = 7.5}));
    TIFF* const tiff = TIFFOpen(scratch.file("a.dng").c_str(), "r");
    ASSERT_NE(tiff, nullptr);
    std::uint16_t bits = 0, format = 0, count = 0;
    const std::uint8_t* backward = nullptr;
    const std::uint32_t* white = nullptr;
    float baseline = 0;
    TIFFGetField(tiff, TIFFTAG_BITSPERSAMPLE, &bits);
    TIFFGetField(tiff, TIFFTAG_SAMPLEFORMAT, &format);
    TIFFGetField(tiff, TIFFTAG_DNGBACKWARDVERSION, &backward);
    TIFFGetField(tiff, TIFFTAG_WHITELEVEL, &count, &white);
    TIFFGetField(tiff, TIFFTAG_BASELINEEXPOSURE, &baseline);
    EXPECT_EQ(bits, 32);
    EXPECT_EQ(format, SAMPLEFORMAT_IEEEFP);
    EXPECT_EQ(backward[1], 4) << "floating-point samples came with DNG 1.4";
    EXPECT_EQ(white[0], 3U);
    EXPECT_EQ(baseline, 7.5F);
    std::vector<float> row(static_cast<std::size_t>(frame.raw.row_samples()));
    for (int y = 0; y < 700; ++y) {
      ASSERT_EQ(TIFFReadScanline(tiff, row.data(), static_cast<std::uint32_t>(y), 0), 1);
      ASSERT_EQ(std::memcmp(row.data(), frame.raw.dn_float.row(y), row.size() * sizeof(float)), 0) << y;
    }
    TIFFClose(tiff);
  }
}

TEST(DngWriter, TheLightSourceIsTheNearestOfExif) {
  for (const auto& [cct_k, code] : {std::pair{2856.0, 17},
                                    {6504.0, 21},
                                    {5003.0, 23},
                                    {5503.0, 20},
                                    {7504.0, 22},
                                    {4874.0, 18},
                                    {6774.0, 19},
                                    {4230.0, 2},
                                    {3200.0, 24},
                                    {2700.0, 17},
                                    {1e-3, 17},
                                    {6550.0, 21},
                                    {1e6, 22}}) {
    EXPECT_EQ(light_source_of(cct_k), code) << cct_k;
  }
  for (const double none : {0.0, -6504.0, nan, infinity}) EXPECT_EQ(light_source_of(none), 0);
}

TEST(DngWriter, MoreThanFourGigabytesAreRefused) {
  EXPECT_TRUE(check_dng_size(1'950'000'000));
  const auto refused = check_dng_size(1'950'000'001);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::too_large);
  EXPECT_TRUE(check_dng_size(975'000'000, sizeof(float)));
  EXPECT_FALSE(check_dng_size(975'000'001, sizeof(float)));
}

TEST(DngWriter, AnExistingFileIsKeptUnlessOverwritingIsAskedFor) {
  const ScratchDirectory scratch;
  scratch.write("a.dng", "old");
  const auto refused = write_dng(plain_frame(24, 24), scratch.file("a.dng"));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::exists);
  EXPECT_EQ(scratch.read("a.dng"), "old");
  EXPECT_TRUE(write_dng(plain_frame(24, 24), scratch.file("a.dng"), {.overwrite = Overwrite::yes}));
  EXPECT_NE(scratch.read("a.dng"), "old");
  EXPECT_EQ(scratch.names().size(), 1u);
}

TEST(DngWriter, AMissingDirectoryIsAnErrorAndNothingIsMade) {
  const ScratchDirectory scratch;
  const auto refused = write_dng(plain_frame(24, 24), scratch.file("missing/a.dng"));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().where, scratch.file("missing/a.dng"));
  EXPECT_TRUE(scratch.names().empty());
}

TEST(DngWriter, ADirectoryThatMayNotBeWrittenStaysEmpty) {
  const ScratchDirectory scratch;
  namespace fs = std::filesystem;
  fs::create_directory(scratch.file("locked"));
  fs::permissions(scratch.path(), fs::perms{0755});
  fs::permissions(scratch.file("locked"), fs::perms{0555});
  {
    const test::WithoutRoot user;
    const auto written = write_dng(plain_frame(24, 24), scratch.file("locked/a.dng"));
    ASSERT_FALSE(written);
    EXPECT_NE(written.error().message.find("no permission"), std::string::npos) << written.error().message;
  }
  EXPECT_TRUE(fs::is_empty(scratch.file("locked")));
}

TEST(DngWriter, AWriteThatFailsHalfWayLeavesNothing) {
  const ScratchDirectory scratch;
  const RawFrame frame = plain_frame(200, 200);  // 80 kB
  auto* const handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  for (const rlim_t bytes : {rlim_t{4}, rlim_t{1000}, rlim_t{79'000}, rlim_t{80'300}}) {
    const rlimit limit{bytes, before.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
    const auto written = write_dng(frame, scratch.file("a.dng"));
    setrlimit(RLIMIT_FSIZE, &before);
    ASSERT_FALSE(written) << bytes;
    EXPECT_EQ(written.error().code, ErrorCode::unwritable);
    EXPECT_TRUE(scratch.names().empty()) << bytes;
  }
  std::signal(SIGXFSZ, handler);
}

TEST(DngWriter, TextsAreCutDownToWhatTheFieldsHold) {
  if (!is_installed("exiftool")) GTEST_SKIP() << "exiftool is not installed";
  const ScratchDirectory scratch;
  RawFrame frame = plain_frame(24, 24);
  frame.raw.info.model = "Maker\n\x01 2\xC3\xA9";
  frame.raw.info.date_time = "yesterday";
  const std::string endless(100'000, 'x');
  ASSERT_TRUE(write_dng(frame, scratch.file("a.dng"), {.software = endless, .description = "\x1b[2J" + endless}));
  const auto said = test::run_process({"exiftool", "-s", "-s", "-s", "-UniqueCameraModel", "-Software",
                                       "-ImageDescription", "-ModifyDate", "-warning", scratch.file("a.dng")});
  EXPECT_EQ(said.out, "Maker 2\n" + endless.substr(0, 255) + "\n[2J" + endless.substr(0, 3997) + "\n");
}

TEST(DngWriter, AMakerThatIsNotKnownIsBlank) {
  const ScratchDirectory scratch;
  RawFrame frame = plain_frame(24, 24);
  frame.raw.info.make = frame.raw.info.model = "";
  ASSERT_TRUE(write_dng(frame, scratch.file("a.dng")));
  TIFF* const tiff = TIFFOpen(scratch.file("a.dng").c_str(), "r");
  ASSERT_NE(tiff, nullptr);
  for (const std::uint32_t tag : {TIFFTAG_MAKE, TIFFTAG_MODEL}) {
    const char* text = nullptr;
    EXPECT_EQ(TIFFGetField(tiff, tag, &text), 1) << tag;
    EXPECT_STREQ(text, "") << tag;
  }
  TIFFClose(tiff);
}

struct Fault {
  const char* tag;
  std::function<void(RawFrame&)> make;
};

TEST(DngWriter, FloatsADngCannotHoldAreRefusedByTheTagsName) {
  const std::vector<Fault> faults{
      {"image", [](RawFrame& f) { f.raw.dn = Plane<std::uint16_t>(50, 41); }},
      {"sample", [](RawFrame& f) { f.raw.dn_float.at(7, 9) = std::nanf(""); }},
      {"sample", [](RawFrame& f) { f.raw.dn_float.at(7, 9) = -std::numeric_limits<float>::infinity(); }},
      {"sample", [](RawFrame& f) { f.raw.dn_float.at(7, 9) = 1.2e12F; }},
      {"WhiteLevel", [](RawFrame& f) { f.raw.white_dn.fill(65534.5); }},
      {"WhiteLevel", [](RawFrame& f) { f.raw.white_dn.fill(4294967296.0); }},
      {"BlackLevel", [](RawFrame& f) { f.raw.black_tag->pattern_dn = {-1}; }},
  };
  const ScratchDirectory scratch;
  for (const Fault& fault : faults) {
    RawFrame frame = full_frame(SensorLayout::bayer);
    test::make_floats(frame.raw);
    ASSERT_TRUE(write_dng(frame, scratch.file("good.dng"), {.overwrite = Overwrite::yes}));
    fault.make(frame);
    const auto written = write_dng(frame, scratch.file("a.dng"));
    ASSERT_FALSE(written) << fault.tag;
    EXPECT_EQ(written.error().code, ErrorCode::invalid_argument);
    EXPECT_NE(written.error().message.find(std::string("this ") + fault.tag + ":"), std::string::npos)
        << fault.tag << ": " << written.error().message;
  }
  for (const double ev : {101.0, -101.0, nan}) {
    EXPECT_FALSE(write_dng(plain_frame(24, 24), scratch.file("a.dng"), {.baseline_exposure_ev = ev}));
  }
}

TEST(DngWriter, SidesThatRawDevelopersDoNotReadAreRefused) {
  const ScratchDirectory scratch;
  for (const auto& [width, height] : {std::pair(21, 40), std::pair(40, 21), std::pair(64001, 22)}) {
    const auto written = write_dng(plain_frame(width, height), scratch.file("a.dng"));
    ASSERT_FALSE(written) << width << " x " << height;
    EXPECT_EQ(written.error().code, ErrorCode::invalid_argument);
    EXPECT_NE(written.error().message.find("pixels: expected 22 to 64000 each way"), std::string::npos)
        << written.error().message;
  }
  EXPECT_TRUE(scratch.names().empty());
}

TEST(DngWriter, FiguresADngCannotHoldAreRefusedByTheTagsName) {
  const std::vector<Fault> faults{
      {"image", [](RawFrame& f) { f.raw.dn = {}; }},
      {"image", [](RawFrame& f) { f.raw.layout = SensorLayout::linear_rgb; }},  // 50 samples are no pixels of 3
      {"ActiveArea", [](RawFrame& f) { f.raw.active.width = 45; }},
      {"ActiveArea", [](RawFrame& f) { f.raw.active.x = -1; }},
      {"ActiveArea", [](RawFrame& f) { f.raw.active.height = 0; }},
      {"ActiveArea", [](RawFrame& f) { f.raw.active.width = std::numeric_limits<int>::max(); }},
      {"DefaultCropSize", [](RawFrame& f) { f.raw.default_crop.x = 4; }},
      {"MaskedAreas", [](RawFrame& f) { f.raw.masked[0].height = 40; }},
      {"BlackLevel", [](RawFrame& f) { f.raw.black_tag->rows = 2; }},
      {"BlackLevel", [](RawFrame& f) { f.raw.black_tag->rows = -1; }},
      {"BlackLevel", [](RawFrame& f) { f.raw.black_tag->samples = 3; }},
      {"BlackLevel", [](RawFrame& f) { f.raw.black_tag->pattern_dn = {-1}; }},
      {"BlackLevel", [](RawFrame& f) { f.raw.black_tag->pattern_dn = {nan}; }},
      {"BlackLevelDeltaH", [](RawFrame& f) { f.raw.black_tag->column_dn.pop_back(); }},
      {"BlackLevelDeltaV", [](RawFrame& f) { f.raw.black_tag->row_dn[3] = infinity; }},
      {"WhiteLevel", [](RawFrame& f) { f.raw.white_dn[2] = 60000; }},
      {"WhiteLevel", [](RawFrame& f) { f.raw.white_dn.fill(255); }},
      {"WhiteLevel", [](RawFrame& f) { f.raw.white_dn.fill(65536); }},
      {"WhiteLevel", [](RawFrame& f) { f.raw.white_dn.fill(nan); }},
      {"ColorMatrix", [](RawFrame& f) { f.colour.calibrations.resize(3, f.colour.calibrations[0]); }},
      {"ColorMatrix", [](RawFrame& f) { f.colour.calibrations[0].xyz_to_camera = {}; }},
      {"ColorMatrix",
       [](RawFrame& f) {
         f.colour.calibrations[0].xyz_to_camera = diagonal3({1e-30, 1e-30, 1e-30});
       }},
      {"ColorMatrix", [](RawFrame& f) { f.colour.calibrations[1].xyz_to_camera[1][1] = nan; }},
      {"ColorMatrix", [](RawFrame& f) { f.colour.calibrations[1].xyz_to_camera[1][1] = 1e9; }},
      {"CameraCalibration", [](RawFrame& f) { f.colour.calibrations[0].camera_calibration[0][0] = -infinity; }},
      {"ForwardMatrix", [](RawFrame& f) { (*f.colour.calibrations[0].forward)[0][0] = nan; }},
      {"AnalogBalance", [](RawFrame& f) { f.colour.analog_balance[0] = 0; }},
      {"AsShotNeutral",
       [](RawFrame& f) {
         f.colour.as_shot_neutral = Vector3{1, -1, 1};
       }},
      {"AsShotWhiteXY",
       [](RawFrame& f) {
         f.colour.as_shot_white_xy = {0.7, 0.7};
       }},
      {"NoiseProfile", [](RawFrame& f) { f.noise->scale[1] = nan; }},
      {"NoiseProfile", [](RawFrame& f) { f.noise->offset[1] = 2; }},
      {"DNGPrivateData",
       [](RawFrame& f) {
         f.noise_ratio = ratio_of({0, 0, 50, 41}, 8);
       }},
      {"DNGPrivateData",
       [](RawFrame& f) {
         NoiseRatio none{.block_px = 50, .ratio = Plane<float>(1, 1)};
         none.ratio.at(0, 0) = 0;
         f.noise_ratio = std::make_shared<const NoiseRatio>(std::move(none));
       }},
      {"GainMap", [](RawFrame& f) { f.corrections.gain_maps.emplace_back(); }},
      {"FixVignetteRadial", [](RawFrame& f) { f.corrections.radial_gains[0].k[4] = nan; }},
      {"FixBadPixelsList", [](RawFrame& f) { f.corrections.defects[0].x = 43; }},
  };
  const ScratchDirectory scratch;
  for (const Fault& fault : faults) {
    RawFrame frame = full_frame(SensorLayout::bayer);
    fault.make(frame);
    const auto written = write_dng(frame, scratch.file("a.dng"));
    ASSERT_FALSE(written) << fault.tag;
    EXPECT_EQ(written.error().code, ErrorCode::invalid_argument);
    EXPECT_EQ(written.error().where, scratch.file("a.dng"));
    EXPECT_NE(written.error().message.find(std::string("this ") + fault.tag + ":"), std::string::npos)
        << fault.tag << ": " << written.error().message;
  }
  EXPECT_TRUE(scratch.names().empty());
}

}  // namespace
}  // namespace lowlux::isp
