#include <gtest/gtest.h>
#include <malloc.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "isp/adapter/stage.h"
#include "tests/adapter/stage_frames.h"
#include "tests/support/count_allocations.h"
#include "tests/support/this_process.h"

namespace lowlux::stage_memory_test {
namespace {

using namespace stage_testing;

/// A way of use: settings, and what is known of frames.
struct Mode {
  const char* name;
  int level = LOWLUX_STAGE_LEVEL_NONE;
  int denoise = LOWLUX_STAGE_DENOISE_OFF;
  bool temporal = false;
  bool eye = false;
  bool automatic = false;
  std::uint32_t fourcc = LOWLUX_STAGE_BGR888;
};

constexpr Mode modes[] = {
    {.name = "plain"},
    {.name = "plain, 16 bits", .fourcc = LOWLUX_STAGE_RGB48},
    {.name = "plain mosaic", .fourcc = LOWLUX_STAGE_BAYER16},
    {.name = "draft", .level = LOWLUX_STAGE_LEVEL_DRAFT, .denoise = LOWLUX_STAGE_DENOISE_FAST},
    {.name = "standard", .level = LOWLUX_STAGE_LEVEL_STANDARD, .denoise = LOWLUX_STAGE_DENOISE_HIGH_QUALITY},
    {.name = "high", .level = LOWLUX_STAGE_LEVEL_HIGH, .denoise = LOWLUX_STAGE_DENOISE_HIGH_QUALITY},
    {.name = "frames before",
     .level = LOWLUX_STAGE_LEVEL_NONE,
     .denoise = LOWLUX_STAGE_DENOISE_MINIMAL,
     .temporal = true,
     .fourcc = LOWLUX_STAGE_NV12},
    {.name = "frames before and draft",
     .level = LOWLUX_STAGE_LEVEL_DRAFT,
     .denoise = LOWLUX_STAGE_DENOISE_FAST,
     .temporal = true,
     .fourcc = LOWLUX_STAGE_BAYER16},
    {.name = "eye",
     .level = LOWLUX_STAGE_LEVEL_STANDARD,
     .denoise = LOWLUX_STAGE_DENOISE_HIGH_QUALITY,
     .temporal = true,
     .eye = true},
    {.name = "all automatic",
     .level = LOWLUX_STAGE_LEVEL_HIGH,
     .denoise = LOWLUX_STAGE_DENOISE_AUTO,
     .temporal = true,
     .automatic = true,
     .fourcc = LOWLUX_STAGE_XRGB8888},
    {.name = "eye, all automatic",
     .level = LOWLUX_STAGE_LEVEL_HIGH,
     .denoise = LOWLUX_STAGE_DENOISE_AUTO,
     .temporal = true,
     .eye = true,
     .automatic = true,
     .fourcc = LOWLUX_STAGE_RGB48},
};

lowlux_stage_settings settings_of(const Mode& mode, int threads) {
  auto out = plain_settings(threads);
  out.most_denoise = mode.level;
  out.temporal = mode.temporal ? 1 : 0;
  out.look = mode.eye ? LOWLUX_STAGE_LOOK_EYE : LOWLUX_STAGE_LOOK_CAMERA;
  return out;
}

lowlux_stage_params params_of(const Mode& mode, const RawFormat& format, std::uint32_t sequence) {
  auto out = fixed_params(format);
  out.denoise = mode.denoise;
  if (mode.automatic) out.valid = LOWLUX_STAGE_HAS_DENOISE;
  if (mode.eye) out.valid |= LOWLUX_STAGE_HAS_SCENE_LUMINANCE;
  out.scene_luminance_cd_m2 = 0.02;
  out.valid |= LOWLUX_STAGE_HAS_SEQUENCE | LOWLUX_STAGE_HAS_EXPOSURE;
  out.sequence = sequence;
  out.exposure_s = 0.04 + 0.01 * (sequence % 3);
  return out;
}

constexpr int width = 270, height = 200;

TEST(StageMemory, OfFramesIsNoneFromTheFirstOneOnInEveryMode) {
  const RawFormatNames& names = names_of_bayer(10, BayerPhase::gbrg, RawPacking::csi2);
  const std::size_t stride = row_bytes(names.format, width);
  std::vector<std::vector<std::byte>> frames;
  for (std::uint32_t i = 0; i < 6; ++i) {
    Codes codes = scene(names.format, width, height, i);
    if (i == 4) std::ranges::fill(codes, std::uint16_t{1023});  // saturated: nothing can be measured
    if (i == 5) std::ranges::fill(codes, std::uint16_t{0});
    frames.push_back(packed_frame(names.format, codes, width, stride));
  }
  for (const Mode& mode : modes) {
    const long at_first = test::allocations;
    Rig rig(settings_of(mode, 3), names, width, height, mode.fourcc);
    ASSERT_EQ(rig.configured, LOWLUX_STAGE_OK) << mode.name << rig.error();
    EXPECT_GT(test::allocations, at_first);
    const long before = test::allocations;
    for (std::uint32_t i = 0; i < 12; ++i) {
      auto params = params_of(mode, names.format, i < 8 ? i : i + 5);  // with a gap
      if (i == 2) params.scene_luminance_cd_m2 = 1e4;                  // nothing to see for eyes in the dark
      if (i >= 5) params.valid |= LOWLUX_STAGE_HAS_BUDGET;
      if (i % 3 != 1) {
        params.valid |= LOWLUX_STAGE_HAS_EXPOSURE_LIMITS | LOWLUX_STAGE_HAS_EXPOSURE | LOWLUX_STAGE_HAS_ANALOGUE_GAIN;
        params.exposure_s = 0.01;
        params.analogue_gain = 2;
        params.max_exposure_s = 0.05F;
      }
      params.budget_ms = i % 2 == 0 ? 0.01F : 1e6F;  // down and up again
      if (i == 3 || i == 10) params.denoise = LOWLUX_STAGE_DENOISE_OFF;
      const int code = rig.process(frames[i % 6], stride, params);
      const long after = test::allocations;
      ASSERT_EQ(code, LOWLUX_STAGE_OK) << mode.name << ' ' << i << rig.error();
      ASSERT_EQ(after, before) << mode.name << ' ' << i;
      if (i == 9) lowlux_stage_reset(rig.stage.get());
    }
    EXPECT_EQ(test::allocations, before) << mode.name;
  }
}

TEST(StageThreads, GiveTheSameBytesInEveryMode) {
  const RawFormatNames& names = names_of_bayer(12, BayerPhase::bggr);
  for (const Mode& mode : modes) {
    std::vector<std::vector<std::vector<std::uint8_t>>> first;
    std::vector<lowlux_stage_statistics> counted;
    for (const int threads : {1, 2, 3, 7}) {
      Rig rig(settings_of(mode, threads), names, width, height, mode.fourcc);
      for (std::uint32_t i = 0; i < 3; ++i) {
        ASSERT_EQ(rig.process(scene(names.format, width, height, i), params_of(mode, names.format, i)), LOWLUX_STAGE_OK)
            << mode.name << rig.error();
        if (threads == 1) {
          first.push_back(rig.planes);
          counted.push_back(rig.statistics);
        }
        EXPECT_EQ(rig.planes, first[i]) << mode.name << ", threads " << threads;
        // NOLINTNEXTLINE(bugprone-suspicious-memory-comparison): the same bits, not only the same values
        EXPECT_EQ(std::memcmp(&rig.statistics, &counted[i], sizeof rig.statistics), 0) << mode.name;
      }
    }
  }
}

TEST(StageThreads, AreAsManyAsAskedForAndGoneAfterRelease) {
  const int before = test::threads_at_rest();
  const RawFormatNames& names = names_of_bayer(10);
  for (const int threads : {0, 1, 2, 8}) {
    {
      Rig rig(plain_settings(threads), names, width, height, LOWLUX_STAGE_NV12);
      ASSERT_EQ(rig.process(scene(names.format, width, height), no_params()), LOWLUX_STAGE_OK);
      EXPECT_EQ(test::threads_now(), before + (threads == 0 ? 2 : threads) - 1) << "the caller's is among them";
    }
    EXPECT_EQ(test::settled_threads(before), before);
  }
}

#ifdef LOWLUX_COUNTS_MALLOC

/// What a stage's setup is, as far as its memory goes.
isp::LiveSetup setup_of(const Mode& mode, const RawFormat& format, int w, int h) {
  isp::LiveSetup setup{.format = format, .width = w, .height = h, .active = {0, 0, w, h}};
  setup.levels = mode.level != LOWLUX_STAGE_LEVEL_NONE;
  setup.temporal = mode.temporal;
  if (mode.eye) setup.look.look = isp::Look::eye;
  return setup;
}

TEST(StageMemory, IsWhatTheLimitTakesItFor) {
  mallopt(M_MMAP_THRESHOLD, 64 << 10);  // large blocks come from the system and go back to it
  constexpr int w = 1920, h = 1080;
  const RawFormatNames& names = names_of_bayer(10, BayerPhase::rggb, RawPacking::csi2);
  const std::size_t stride = row_bytes(names.format, w);
  const std::vector<std::byte> bytes(stride * h, std::byte{0x21});
  for (const Mode& mode : modes) {
    malloc_trim(0);
    const auto settings = settings_of(mode, 2);
    Rig rig(settings, names_of_bayer(8), 16, 16, mode.fourcc);  // the stage, its threads and the pictures' memory
    std::vector<std::uint8_t> picture(std::size_t{w} * h * 6);
    const double before = test::resident_bytes();
    rig.in = input_of(names, w, h);
    rig.out = {.size = sizeof rig.out, .fourcc = mode.fourcc};
    ASSERT_EQ(lowlux_stage_configure(rig.stage.get(), &rig.in, &rig.out), LOWLUX_STAGE_OK) << rig.error();
    const double configured = test::resident_bytes() - before;
    for (int p = 0; p < rig.out.planes; ++p) {
      rig.picture.plane[p] = {picture.data() + (p == 0 ? 0 : rig.out.bytes[0]), rig.out.bytes[p], rig.out.stride[p]};
    }
    ASSERT_EQ(rig.process(bytes, stride, params_of(mode, names.format, 0)), LOWLUX_STAGE_OK) << rig.error();
    const double used = test::resident_bytes() - before;
    const auto said = static_cast<double>(isp::stage_memory_bytes(setup_of(mode, names.format, w, h), 2));
    RecordProperty(mode.name, std::to_string(configured / said));
    if (const char* const prints = std::getenv("LOWLUX_PRINT"); prints != nullptr) {
      std::printf("%-24s %.1f MiB configured, %.1f used, %.1f said\n", mode.name, configured / (1 << 20),
                  used / (1 << 20), said / (1 << 20));
    }
    EXPECT_LT(used, said) << mode.name;
    EXPECT_GT(configured, said / 3) << mode.name;
    // A frame allocates nothing. It touches pages of the denoiser that the warm-up frame's light does not reach, where
    // chroma starts on another level: 0.5 MiB measured, twice that.
    EXPECT_LT(used - configured, 1 << 20) << mode.name << ": a frame takes more than pages of one level";
  }
}

#endif

}  // namespace
}  // namespace lowlux::stage_memory_test
