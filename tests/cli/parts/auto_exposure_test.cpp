#include "isp/cli/capture/auto_exposure.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <deque>
#include <random>
#include <variant>

#include "capture/camera/capture_loop.h"
#include "isp/base/camera_profile.h"
#include "isp/cli/capture/capture_report.h"
#include "isp/cli/shared/profile_option.h"
#include "tests/support/scratch_directory.h"

namespace lowlux {
namespace {

using capture::CameraExposure;
using capture::CameraGain;

constexpr int width = 192, height = 96;

/// A camera in the dark, whose exposure follows what is set some frames later.
class NightCamera final : public capture::Camera {
 public:
  NightCamera() {
    controls.min_s = controls.step_s = 1e-4;
    controls.max_s = 0.5;
    for (const double factor : {1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0}) controls.gains.push_back({factor, 0});
  }
  const std::string& name() const override { return name_; }
  const capture::CameraFormat& format() const override { return format_; }
  const std::vector<std::string>& warnings() const override { return warnings_; }
  Result<void> start() override { return {}; }
  void stop() override {}
  void return_buffer(const capture::CameraFrame& /*frame*/) override {}
  Result<capture::ExposureControls> take_exposure() override {
    return error ? Result<capture::ExposureControls>(tl::make_unexpected(*error)) : controls;
  }
  Result<double> set_exposure(const CameraExposure& exposure) override {
    ++sets;
    if (failing_set == sets) return fail(ErrorCode::unreadable, "the driver refuses the value 7", "fake");
    CameraExposure taken = exposure;
    taken.exposure_s = std::min(exposure.exposure_s, longest_s);
    waiting_.assign(1, taken);
    due_ = sequence_ + latency;
    return taken.exposure_s;
  }
  Result<capture::CameraFrame> next(std::chrono::milliseconds /*timeout*/) override {
    if (!waiting_.empty() && sequence_ >= due_) {
      now = waiting_.front();
      waiting_.clear();
    }
    expose();
    capture::CameraFrame out;
    out.bytes = bytes_;
    out.sequence = sequence_++;
    if (states) {
      out.facts.exposure_s = now.exposure_s;
      out.facts.analogue_gain = now.gain ? now.gain->factor : 1;
    }
    return out;
  }

  capture::ExposureControls controls;
  std::optional<Error> error;
  bool states = false;
  std::uint32_t latency = 3;
  double longest_s = 1;   // the driver's own limit
  double e_per_s = 200;   // of the mid tone
  double highlight = 20;  // times as many
  int sets = 0, failing_set = -1;
  CameraExposure now{.exposure_s = 0.001, .gain = CameraGain{}};

 private:
  void expose() {
    const double gain_dn = 0.1 * (now.gain ? now.gain->factor : 1);
    std::normal_distribution<double> normal;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const double e = e_per_s * (x < 16 ? highlight : 1) * now.exposure_s;
        const double dn = 256 + gain_dn * (e + std::sqrt(e + 9) * normal(random_));
        const auto code = static_cast<std::uint16_t>(std::clamp(std::round(dn), 0.0, 4095.0));
        std::memcpy(bytes_.data() + 2 * static_cast<std::size_t>(y * width + x), &code, 2);
      }
    }
  }

  std::string name_ = "night camera";
  capture::CameraFormat format_{.raw = {12, RawPacking::little16, SensorLayout::bayer, BayerPhase::rggb},
                                .width = width,
                                .height = height,
                                .stride_bytes = 2 * width,
                                .frame_rate_hz = 30};
  std::vector<std::string> warnings_;
  std::vector<std::byte> bytes_ = std::vector<std::byte>(2 * width * height);
  std::mt19937 random_{17};
  std::deque<CameraExposure> waiting_;
  std::uint32_t sequence_ = 0, due_ = 0;
};

class AutoExposureOfCapture : public testing::Test {
 protected:
  cli::CaptureArgs args_of(std::vector<std::string> words) {
    words.insert(words.begin(), {"--libcamera", "0", "--auto-exposure", "-o", scratch_.file("a.dng")});
    return std::get<cli::CaptureArgs>(cli::parse_capture(words));
  }
  test::ScratchDirectory scratch_;
  NightCamera camera_;
};

TEST_F(AutoExposureOfCapture, FindsTheExposureBeforeAFrameIsTaken) {
  std::printf("seed 17\n");
  for (const bool states : {false, true}) {
    for (const double e_per_s : {5.0, 500.0, 50000.0, 5e6}) {
      NightCamera camera;
      camera.states = states;
      camera.e_per_s = e_per_s;
      const cli::CaptureArgs args =
          args_of({"--max-exposure", "0.1", "--clip", "0.01", "--frames", "3", "--mains", "off"});
      auto automatic = cli::AutoExposure::make(args, camera);
      ASSERT_TRUE(automatic) << automatic.error().message;
      capture::LoopCount count;
      std::atomic<bool> stop{false};
      std::vector<capture::FrameFacts> facts;
      const auto done = capture::capture_frames(
          camera, args.limits, stop,
          [&](const capture::CameraFrame& frame) {
            facts.push_back(frame.facts);
            return true;
          },
          [](const auto&) {}, count,
          [&](capture::CameraFrame& frame) -> Result<bool> {
            if (auto taken = (*automatic)->take(frame); !taken) return tl::make_unexpected(taken.error());
            return (*automatic)->is_ready();
          });
      ASSERT_TRUE(done) << done.error().message;
      EXPECT_LE(count.skipped, 80u);
      ASSERT_EQ(facts.size(), 3u);
      for (const auto& of_frame : facts) {  // stated by the camera, or known
        EXPECT_NEAR(of_frame.exposure_s.value_or(0), camera.now.exposure_s, 1e-9);
        EXPECT_EQ(of_frame.analogue_gain, camera.now.gain->factor);
      }
      // The highlight fills the range, or the time is at one of its limits.
      const double codes = 0.1 * camera.now.gain->factor * 20 * e_per_s * camera.now.exposure_s / (4095 - 256);
      if (camera.now.exposure_s < 0.0999 && camera.now.exposure_s > 1.1e-4) {
        EXPECT_GT(codes * (1 + camera.controls.step_s / camera.now.exposure_s), 0.85) << e_per_s;  // not a step longer
      }
      EXPECT_LT(codes, 1.0) << e_per_s;
      if (e_per_s == 5) {
        EXPECT_NEAR(camera.now.exposure_s, 0.1, 1e-9);
        EXPECT_GT(camera.now.gain->factor, 2);
      } else if (e_per_s == 5e6) {
        EXPECT_EQ(camera.now.gain->factor, 1);
      }
    }
  }
}

// A wall without a dark place: nothing states black, and each frame shows its own light as black.
TEST_F(AutoExposureOfCapture, SettlesWhereBlackIsNotKnownAndNothingIsBlack) {
  std::printf("seed 17\n");
  for (const double e_per_s : {4e5, 1e6, 1e7}) {
    NightCamera camera;
    camera.highlight = 1.2;
    camera.e_per_s = e_per_s;
    auto automatic = cli::AutoExposure::make(args_of({"--max-exposure", "0.1", "--mains", "off"}), camera);
    ASSERT_TRUE(automatic);
    int sets = 0;
    for (int i = 0; i < 160; ++i) {
      if (i == 100) sets = camera.sets;
      auto frame = camera.next({});
      ASSERT_TRUE((*automatic)->take(*frame));
    }
    EXPECT_TRUE((*automatic)->found()) << e_per_s;
    EXPECT_LE(camera.sets, sets + 1) << e_per_s;
    const double codes = 0.1 * camera.now.gain->factor * 1.2 * e_per_s * camera.now.exposure_s / (4095 - 256);
    EXPECT_GT(codes, 0.75) << e_per_s;
    EXPECT_LT(codes, 1.0) << e_per_s;
  }
}

TEST_F(AutoExposureOfCapture, TakesADriversLimitAsItIs) {
  camera_.longest_s = 0.02;
  auto automatic = cli::AutoExposure::make(args_of({"--max-exposure", "0.1", "--mains", "off"}), camera_);
  ASSERT_TRUE(automatic);
  for (int i = 0; i < 120; ++i) {
    auto frame = camera_.next({});
    ASSERT_TRUE((*automatic)->take(*frame));
  }
  EXPECT_TRUE((*automatic)->found());
  EXPECT_EQ((*automatic)->state().exposure_s, 0.02);
  EXPECT_LE(camera_.sets, 5);  // not asked again and again
}

TEST_F(AutoExposureOfCapture, KeepsToTheFrameRateTheMainsAndTheLargestGain) {
  const auto found = [&](const std::vector<std::string>& words) {
    NightCamera camera;
    camera.e_per_s = 5;
    auto automatic = cli::AutoExposure::make(args_of(words), camera);
    EXPECT_TRUE(automatic);
    for (int i = 0; i < 100; ++i) {
      auto frame = camera.next({});
      EXPECT_TRUE((*automatic)->take(*frame));
    }
    return camera.now;
  };
  EXPECT_NEAR(found({"--mains", "off"}).exposure_s, 0.0333, 1e-9);  // the camera's rate, in steps
  EXPECT_NEAR(found({"--mains", "50"}).exposure_s, 0.03, 1e-9);
  EXPECT_NEAR(found({"--mains", "60"}).exposure_s, 0.0333, 1e-9);  // 4/120 s
  EXPECT_NEAR(found({"--mains", "50", "--fps", "60"}).exposure_s, 0.01, 1e-9);
  EXPECT_NEAR(found({}).exposure_s, 3 / 110.0, 0.51e-4);
  EXPECT_EQ(found({"--max-gain", "2.5"}).gain->factor, 2);
}

// Raw files take nothing else of a profile, so `capture` refuses it for them without --auto-exposure.
TEST_F(AutoExposureOfCapture, TakesTheNoiseOfAProfileForRawFilesToo) {
  CameraProfile profile;
  for (const double iso : {100.0, 800.0}) {  // the read noise is the same: no gain is better
    GainProfile gain;
    gain.iso = iso;
    gain.sensor.emplace();
    gain.sensor->bits = 12;
    gain.sensor->white_level_dn = 4095;
    gain.sensor->system_gain_dn_per_e = 4 * iso / 100;  // high enough that rounding to codes adds no noise
    gain.sensor->full_well_e = 4095 / gain.sensor->system_gain_dn_per_e;
    gain.sensor->read_noise_e = 3;
    profile.gains.push_back(gain);
  }
  const std::string file = scratch_.file("camera.json");
  const auto written = cli::write_profile(file, profile, isp::Overwrite::no);
  ASSERT_TRUE(written) << written.error().message;
  const auto gain_of = [&](const std::vector<std::string>& words) {
    NightCamera camera;
    camera.e_per_s = 5;
    auto automatic = cli::AutoExposure::make(args_of(words), camera);
    EXPECT_TRUE(automatic) << automatic.error().message;
    for (int i = 0; i < 100; ++i) {
      auto frame = camera.next({});
      EXPECT_TRUE((*automatic)->take(*frame));
    }
    return camera.now.gain->factor;
  };
  EXPECT_GT(gain_of({"--mains", "off"}), 2);
  EXPECT_EQ(gain_of({"--mains", "off", "--profile", file}), 1);
  const std::string none = scratch_.file("none.json");
  EXPECT_EQ(cli::AutoExposure::make(args_of({"--profile", none}), camera_).error().where, none);
}

// The gain of most V4L2 cameras is neither stated nor set: the noise is that of the gain that the profile was measured
// at.
TEST_F(AutoExposureOfCapture, CamerasThatStateNoGainHaveTheOnlySettingOfAProfile) {
  CameraProfile profile;
  GainProfile& only = profile.gains.emplace_back();
  only.iso = 800;
  only.sensor = SensorModel{
      .system_gain_dn_per_e = 2, .read_noise_e = 3, .full_well_e = 2047, .bits = 12, .white_level_dn = 4095};
  const std::string file = scratch_.file("camera.json");
  const auto written = cli::write_profile(file, profile, isp::Overwrite::no);
  ASSERT_TRUE(written) << written.error().message;
  const auto snr_db_of = [&](const std::vector<std::string>& words) {
    NightCamera camera;
    camera.controls.gains.clear();
    auto automatic = cli::AutoExposure::make(args_of(words), camera);
    EXPECT_TRUE(automatic) << automatic.error().message;
    for (int i = 0; i < 40; ++i) {
      auto frame = camera.next({});
      EXPECT_TRUE((*automatic)->take(*frame));
    }
    return (*automatic)->state().snr_db;
  };
  EXPECT_EQ(snr_db_of({"--profile", file}), snr_db_of({"--profile", file, "--gain", "8"}));
  EXPECT_NE(snr_db_of({"--profile", file}), snr_db_of({"--profile", file, "--gain", "1"}));
}

TEST_F(AutoExposureOfCapture, PassesErrorsOfTheCameraOn) {
  EXPECT_EQ(cli::AutoExposure::make(args_of({"--max-exposure", "0.00001"}), camera_).error().where, "--max-exposure");
  EXPECT_EQ(cli::AutoExposure::make(args_of({"--max-gain", "0.9"}), camera_).error().where, "--max-gain");
  camera_.failing_set = 2;
  auto automatic = cli::AutoExposure::make(args_of({}), camera_);
  ASSERT_TRUE(automatic);
  Result<void> last;
  for (int i = 0; i < 20 && last; ++i) {
    auto frame = camera_.next({});
    last = (*automatic)->take(*frame);
  }
  ASSERT_FALSE(last);
  EXPECT_EQ(last.error().message, "the driver refuses the value 7");
  camera_.error = Error{ErrorCode::unsupported, "no such control", "fake"};
  EXPECT_EQ(cli::AutoExposure::make(args_of({}), camera_).error().message, "no such control");
}

TEST_F(AutoExposureOfCapture, IsReported) {
  cli::CaptureState state;
  EXPECT_EQ(cli::capture_json(state, nullptr).find("auto_exposure"), std::string::npos);
  state.exposure = cli::ExposureState{.exposure_s = 0.04, .gain = 8.0, .snr_db = 12, .changes = 3};
  EXPECT_NE(cli::progress_text(state).find("; exposure 0.04 s, gain 8"), std::string::npos);
  const std::string json = cli::capture_json(state, nullptr);
  for (const char* const part :
       {R"("exposure_s": 0.04)", R"("analogue_gain": 8.0)", R"("limit": "time")", R"("changes": 3)"}) {
    EXPECT_NE(json.find(part), std::string::npos) << json;
  }
}

}  // namespace
}  // namespace lowlux
