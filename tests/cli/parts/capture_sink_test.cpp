#include "isp/cli/capture/capture_sink.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "capture/camera/capture_loop.h"
#include "capture/file/dng_source.h"
#include "isp/base/executor.h"
#include "isp/cli/capture/capture_args.h"
#include "isp/cli/capture/capture_report.h"
#include "isp/codec/png.h"
#include "tests/cli/simulate/simulate_command.h"
#include "tests/support/fake_camera.h"

namespace lowlux {
namespace {

using test::lowlux;

/// A simulated night, as cameras deliver it.
class CapturedNight : public test::SimulateCommand {
 protected:
  void SetUp() override {
    simulated("chart:macbeth", "night.dng", {"--luminance", "0.5", "--size", "192x128", "--no-truth"});
    auto night = capture::read_raw(file("night.dng"));
    ASSERT_TRUE(night) << night.error().message;
    night_ = std::move(night->raw);
  }

  /// The night in another format; the camera tells its black, gains and matrix.
  void use_format(const RawFormat& raw) {
    const Rect area = night_.active;
    format_ = {.raw = raw, .width = area.width, .height = area.height};
    format_.raw.phase = raw.layout == SensorLayout::bayer ? night_.phase : BayerPhase::rggb;
    format_.stride_bytes = row_bytes(raw, area.width) + 32;
    memory_.assign(capture::frame_bytes(format_), std::byte{0xA5});
    const double scale = largest_code(raw) / night_.white_dn[1];
    for (int y = 0; y < area.height; ++y) {
      for (int x = 0; x < area.width; ++x) {
        const auto code = std::lround(night_.dn.at(area.x + x, area.y + y) * scale);
        std::byte* const at = memory_.data() + y * format_.stride_bytes + x * (raw.bits == 8 ? 1 : 2);
        at[0] = static_cast<std::byte>(code & 0xFF);
        if (raw.bits != 8) at[1] = static_cast<std::byte>(code >> 8);
      }
    }
    frame_.bytes = memory_;
    const double black = night_.black_tag->at(0, 0) * scale;
    frame_.facts.black_level_dn = {black, black + 0.125, black, black};
    frame_.facts.colour_gains = {1.93, 1.57};
    frame_.facts.colour_matrix = {1.71, -0.52, -0.19, -0.31, 1.62, -0.31, 0.03, -0.61, 1.58};
    frame_.facts.colour_temperature_k = 5100;
    frame_.facts.exposure_s = 0.033;
    frame_.facts.analogue_gain = 3.98;
  }

  static cli::CaptureArgs args_of(std::vector<std::string> words) {
    words.insert(words.begin(), {"--v4l2", "fake"});
    auto parsed = cli::parse_capture(words);
    EXPECT_TRUE(std::holds_alternative<cli::CaptureArgs>(parsed));
    return std::get<cli::CaptureArgs>(parsed);
  }
  cli::CaptureStream stream() const { return {format_, "Fake camera"}; }

  void capture_picture(const std::string& name, const std::vector<std::string>& options) {
    std::vector<std::string> words{"-o", file(name)};
    words.insert(words.end(), options.begin(), options.end());
    const cli::CaptureArgs args = args_of(words);
    InlineExecutor one;
    auto sink = cli::make_picture_sink(args, stream(), one);
    ASSERT_TRUE(sink) << sink.error().message;
    const auto taken = (*sink)->take(frame_, work_);
    ASSERT_TRUE(taken) << taken.error().message;
    EXPECT_TRUE(*taken);
  }
  void capture_raw(const std::string& name) {
    const cli::CaptureArgs args = args_of({"-o", file(name)});
    cli::CaptureWork work;
    const auto taken = cli::make_raw_sink(args, stream())->take(frame_, work);
    ASSERT_TRUE(taken) << taken.error().message;
  }
  std::string developed(const std::string& raw, const std::string& name, const std::vector<std::string>& options) {
    std::vector<std::string> words{"develop", file(raw), "-o", file(name), "--quiet"};
    words.insert(words.end(), options.begin(), options.end());
    const auto result = lowlux(words);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return scratch_.read(name);
  }

  RawDn night_;
  capture::CameraFormat format_;
  std::vector<std::byte> memory_;
  capture::CameraFrame frame_;
  cli::CaptureWork work_;
  std::atomic<bool> stop_{false};
};

RawFormat bayer(int bits) { return {.bits = bits, .packing = bits == 8 ? RawPacking::byte : RawPacking::little16}; }
RawFormat mono(int bits) {
  RawFormat out = bayer(bits);
  out.layout = SensorLayout::monochrome;
  return out;
}

TEST_F(CapturedNight, IsThePictureThatDevelopMakesOfItsRawFileByteForByte) {
  const std::vector<std::string> still{"--denoise", "off"}, as_ever, eye{"--look", "eye", "--scene-luminance", "0.1"};
  struct Case {
    RawFormat format;
    std::vector<std::string> options;
    bool colours_known;
  };
  int number = 0;
  for (const Case& c : {Case{bayer(8), still, true}, Case{bayer(10), as_ever, true}, Case{bayer(12), eye, true},
                        Case{bayer(16), still, false}, Case{mono(8), still, true}, Case{mono(12), as_ever, true}}) {
    use_format(c.format);
    if (!c.colours_known) frame_.facts.colour_gains.reset(), frame_.facts.colour_matrix.reset();
    const std::string name = "frame" + std::to_string(number++);
    capture_picture(name + ".png", c.options);
    capture_raw(name + ".dng");
    const std::string file_of_raw = developed(name + ".dng", name + "d.png", c.options);
    EXPECT_GT(file_of_raw.size(), 1000u);
    EXPECT_TRUE(scratch_.read(name + ".png") == file_of_raw) << name;
  }
  EXPECT_EQ(work_.files.size(), 6u);
}

TEST_F(CapturedNight, NeedsABlackLevelFromSomewhere) {
  use_format(bayer(10));
  frame_.facts.black_level_dn.reset();
  const cli::CaptureArgs args = args_of({"-o", file("a.png")});
  InlineExecutor one;
  auto sink = cli::make_picture_sink(args, stream(), one);
  ASSERT_TRUE(sink);
  const auto taken = (*sink)->take(frame_, work_);
  ASSERT_FALSE(taken);
  EXPECT_NE(taken.error().message.find("--black"), std::string::npos) << taken.error().message;
  EXPECT_FALSE(scratch_.holds("a.png"));
  // Given for a raw file, it is in there.
  const cli::CaptureArgs raw = args_of({"-o", file("a.dng"), "--black", "60,61,62,63"});
  ASSERT_TRUE(cli::make_raw_sink(raw, stream())->take(frame_, work_));
  const auto read = capture::read_raw(file("a.dng"));
  ASSERT_TRUE(read && read->raw.black_tag);
  EXPECT_EQ(read->raw.black_tag->at(1, 1), 63);
}

TEST_F(CapturedNight, BlackLevelsOfRawFilesThatAreNotBelowWhiteAreRefused) {
  use_format(bayer(10));
  for (const char* black : {"65535", "1023", "60,61,62,1023"}) {
    const cli::CaptureArgs raw = args_of({"-o", file("a.dng"), "--black", black});
    const auto taken = cli::make_raw_sink(raw, stream())->take(frame_, work_);
    ASSERT_FALSE(taken) << black;
    EXPECT_NE(taken.error().message.find("is not above the black level"), std::string::npos) << taken.error().message;
    EXPECT_FALSE(scratch_.holds("a.dng"));
  }
  const cli::CaptureArgs highest = args_of({"-o", file("a.dng"), "--black", "1022"});
  EXPECT_TRUE(cli::make_raw_sink(highest, stream())->take(frame_, work_));
}

/// The three planes of a film's frame by BT.601 in video range, in double, from 8-bit sRGB codes; chroma of the mean of
/// 2 x 2 pixels.
struct YuvReference {
  explicit YuvReference(const Plane<std::uint8_t>& codes) {
    const int width = codes.width() / 3;
    const auto rgb = [&](int x, int y, int c) { return static_cast<double>(codes.at(3 * x + c, y)); };
    for (int y = 0; y < codes.height(); ++y) {
      for (int x = 0; x < width; ++x) {
        values.push_back(16 + 219.0 / 255 * (0.299 * rgb(x, y, 0) + 0.587 * rgb(x, y, 1) + 0.114 * rgb(x, y, 2)));
      }
    }
    for (const int plane : {2, 0}) {  // B - Y, then R - Y
      const double scale = 224.0 / 255 / (2 * (1 - (plane == 2 ? 0.114 : 0.299)));
      for (int y = 0; y < codes.height(); y += 2) {
        for (int x = 0; x < width; x += 2) {
          double difference = 0;
          for (int i = 0; i < 4; ++i) {
            const int u = x + i % 2, v = y + i / 2;
            const double luma = 0.299 * rgb(u, v, 0) + 0.587 * rgb(u, v, 1) + 0.114 * rgb(u, v, 2);
            difference += (rgb(u, v, plane) - luma) / 4;
          }
          values.push_back(128 + scale * difference);
        }
      }
    }
  }
  std::vector<double> values;
};

TEST_F(CapturedNight, IsTheSamePictureLiveAsDeveloped) {
  use_format(bayer(12));
  capture_raw("live.dng");
  const std::string png = developed("live.dng", "file.png",
                                    {"--denoise", "off", "--repair", "off", "--exposure", "5", "--demosaic", "malvar"});
  const auto picture = isp::decode_png(std::as_bytes(std::span(png)));
  ASSERT_TRUE(picture);
  const YuvReference expected(std::get<Encoded8>(picture->picture).codes);

  const cli::CaptureArgs args = args_of({"--live", "--denoise", "off", "--exposure", "5", "--demosaic", "malvar"});
  const int film = open(file("film.y4m").c_str(), O_RDWR | O_CREAT | O_TRUNC, 0600);
  auto sink = cli::make_live_sink(args, stream(), film, stop_);
  ASSERT_TRUE(sink) << sink.error().message;
  const auto taken = (*sink)->take(frame_, work_);
  close(film);
  ASSERT_TRUE(taken) << taken.error().message;
  const std::string y4m = scratch_.read("film.y4m");
  const std::size_t at = y4m.find("FRAME\n") + 6;
  ASSERT_EQ(y4m.size(), at + expected.values.size());
  double worst = 0;
  int beyond_rounding = 0;
  for (std::size_t i = 0; i < expected.values.size(); ++i) {
    const double off = std::fabs(static_cast<std::uint8_t>(y4m[at + i]) - expected.values[i]);
    worst = std::max(worst, off);
    beyond_rounding += off > 0.51;  // half a code, and coefficients in 65536ths
  }
  // The file's matrix is rounded to 2^-16 and its neutral to 2^-20: channels at the edge of a code, here 3 of 36864
  // values, may fall to its other side.
  EXPECT_LE(worst, 0.51 + 219.0 / 255);
  EXPECT_LE(beyond_rounding, static_cast<int>(expected.values.size() / 1000));
}

// No frame fits a hundredth of a millisecond, and every one fits ten minutes. The profile tells the noise, which so
// small a frame does not.
TEST_F(CapturedNight, LiveFramesOfABudgetAreCountedByTheirStep) {
  use_format(bayer(14));
  const std::string profile = LOWLUX_TESTDATA "/../calib/profiles/ELD_SonyA7S2.json";
  const auto steps_of = [&](const char* budget_ms) {
    const cli::CaptureArgs args =
        args_of({"--live", "--denoise", "draft", "--budget-ms", budget_ms, "--profile", profile});
    const int film = open("/dev/null", O_WRONLY);
    auto sink = cli::make_live_sink(args, stream(), film, stop_);
    EXPECT_TRUE(sink);
    cli::CaptureWork work;
    for (int i = 0; i < 4; ++i) EXPECT_TRUE((*sink)->take(frame_, work));
    close(film);
    EXPECT_NE(cli::capture_json({stream(), {}, work}, nullptr).find("\"steps\""), std::string::npos);
    return work.steps.value_or(std::array<std::uint64_t, 5>{});
  };
  EXPECT_EQ(steps_of("0.01"), (std::array<std::uint64_t, 5>{0, 0, 0, 0, 4}));
  EXPECT_EQ(steps_of("600000"), (std::array<std::uint64_t, 5>{3, 0, 0, 0, 1})) << "the first one's time is not known";
}

TEST_F(CapturedNight, LeavesDamagedFramesOutOfFilesAndNumbersTheOthers) {
  use_format(bayer(10));
  test::FakeCamera camera(format_);
  for (const bool damaged : {false, true, false}) {
    capture::CameraFrame frame = frame_;
    frame.damaged = damaged;
    camera.deliver(frame);
  }
  camera.events.emplace_back(fail(ErrorCode::not_found, "the device is gone", "fake"));
  const cli::CaptureArgs args = args_of({"-o", file("f.dng"), "--frames", "5"});
  const auto sink = cli::make_raw_sink(args, stream());
  capture::LoopCount count;
  const auto done = capture::capture_frames(
      camera, args.limits, stop_, [&](const capture::CameraFrame& frame) { return sink->take(frame, work_); },
      [](const auto&) {}, count);
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().code, ErrorCode::not_found);
  std::vector<std::string> left = scratch_.names();
  std::erase(left, "night.dng");
  EXPECT_EQ(left, (std::vector<std::string>{"f-0001.dng", "f-0002.dng"}));
}

TEST_F(CapturedNight, KeepsFilesThatExist) {
  use_format(bayer(8));
  scratch_.write("a.dng", "mine");
  const cli::CaptureArgs args = args_of({"-o", file("a.dng")});
  const auto taken = cli::make_raw_sink(args, stream())->take(frame_, work_);
  ASSERT_FALSE(taken);
  EXPECT_EQ(taken.error().code, ErrorCode::exists);
  EXPECT_EQ(scratch_.read("a.dng"), "mine");
}

}  // namespace
}  // namespace lowlux
