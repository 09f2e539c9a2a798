#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstddef>
#include <cstring>
#include <string>

#include "tests/adapter/stage_frames.h"
#include "tests/support/scratch_directory.h"

namespace lowlux::lowlux_stage_test {
namespace {

using namespace stage_testing;

constexpr int width = 32, height = 20;

const RawFormatNames& words10() { return names_of_bayer(10); }

/// Opens a stage, and says what became of it.
int opening(const lowlux_stage_settings& settings, std::string* message = nullptr) {
  lowlux_stage* stage = nullptr;
  char said[100] = "before";
  const int code = lowlux_stage_open(&settings, &stage, said, sizeof said);
  EXPECT_EQ(stage != nullptr, code == LOWLUX_STAGE_OK);
  EXPECT_EQ(said[0] == '\0', code == LOWLUX_STAGE_OK) << said;
  if (message != nullptr) *message = said;
  lowlux_stage_release(stage);
  return code;
}

TEST(LowluxStage, HasAVersionAndTakesNullWhereItSaysSo) {
  EXPECT_EQ(lowlux_stage_version(), LOWLUX_STAGE_VERSION);
  lowlux_stage_release(nullptr);
  EXPECT_STREQ(lowlux_stage_last_error(nullptr), "");
  EXPECT_EQ(lowlux_stage_open(nullptr, nullptr, nullptr, 0), LOWLUX_STAGE_BAD_ARGUMENT);
  EXPECT_EQ(lowlux_stage_reset(nullptr), LOWLUX_STAGE_BAD_ARGUMENT);
  EXPECT_EQ(lowlux_stage_query(0, 0, 0, nullptr), LOWLUX_STAGE_BAD_ARGUMENT);
  EXPECT_EQ(lowlux_stage_configure(nullptr, nullptr, nullptr), LOWLUX_STAGE_BAD_ARGUMENT);
  EXPECT_EQ(lowlux_stage_process(nullptr, nullptr, nullptr, nullptr, nullptr, nullptr), LOWLUX_STAGE_BAD_ARGUMENT);
  lowlux_stage* stage = nullptr;
  ASSERT_EQ(lowlux_stage_open(nullptr, &stage, nullptr, 0), LOWLUX_STAGE_OK);
  const StagePtr owned(stage);
  EXPECT_STREQ(lowlux_stage_last_error(stage), "");
  EXPECT_EQ(lowlux_stage_configure(stage, nullptr, nullptr), LOWLUX_STAGE_BAD_ARGUMENT);
  EXPECT_STRNE(lowlux_stage_last_error(stage), "");
  EXPECT_EQ(lowlux_stage_reset(stage), LOWLUX_STAGE_OK);
}

TEST(LowluxStage, NamesSettingsThatCannotBe) {
  const auto with = [](void (*change)(lowlux_stage_settings&)) {
    auto settings = plain_settings();
    change(settings);
    return opening(settings);
  };
  using S = lowlux_stage_settings;
  EXPECT_EQ(with([](S& s) { s.threads = 8; }), LOWLUX_STAGE_OK);
  EXPECT_EQ(with([](S& s) { s.threads = 9; }), LOWLUX_STAGE_BAD_ARGUMENT);
  EXPECT_EQ(with([](S& s) { s.threads = -1; }), LOWLUX_STAGE_BAD_ARGUMENT);
  EXPECT_EQ(with([](S& s) { s.most_denoise = LOWLUX_STAGE_LEVEL_HIGH; }), LOWLUX_STAGE_OK);
  EXPECT_EQ(with([](S& s) { s.most_denoise = 4; }), LOWLUX_STAGE_BAD_ARGUMENT);
  EXPECT_EQ(with([](S& s) { s.most_denoise = -1; }), LOWLUX_STAGE_BAD_ARGUMENT);
  EXPECT_EQ(with([](S& s) { s.demosaic = LOWLUX_STAGE_DEMOSAIC_RESIDUAL_MEDIAN; }), LOWLUX_STAGE_OK);
  EXPECT_EQ(with([](S& s) { s.demosaic = 5; }), LOWLUX_STAGE_BAD_ARGUMENT);
  EXPECT_EQ(with([](S& s) { s.demosaic = -1; }), LOWLUX_STAGE_BAD_ARGUMENT);
  EXPECT_EQ(with([](S& s) { s.look = 2; }), LOWLUX_STAGE_BAD_ARGUMENT);
  EXPECT_EQ(with([](S& s) { s.tone = 2; }), LOWLUX_STAGE_BAD_ARGUMENT);
  EXPECT_EQ(with([](S& s) { s.temporal = 2; }), LOWLUX_STAGE_BAD_ARGUMENT);
  EXPECT_EQ(with([](S& s) { s.field_of_view_deg = 180; }), LOWLUX_STAGE_OK);
  EXPECT_EQ(with([](S& s) { s.field_of_view_deg = 181; }), LOWLUX_STAGE_BAD_ARGUMENT);
  EXPECT_EQ(with([](S& s) { s.field_of_view_deg = NAN; }), LOWLUX_STAGE_BAD_ARGUMENT);
  EXPECT_EQ(with([](S& s) { s.size -= 1; }), LOWLUX_STAGE_BAD_ARGUMENT);
  EXPECT_EQ(with([](S& s) { s.size = 0; }), LOWLUX_STAGE_BAD_ARGUMENT);
  EXPECT_EQ(with([](S& s) { s.size = 65537; }), LOWLUX_STAGE_BAD_ARGUMENT);
}

// Callers that were compiled before the method of demosaicing could be chosen.
TEST(LowluxStage, TakesTheSettingsOfEarlierCallers) {
  auto settings = plain_settings();
  settings.size = offsetof(lowlux_stage_settings, demosaic);
  settings.demosaic = -1;  // not of the caller: it is not read
  EXPECT_EQ(opening(settings), LOWLUX_STAGE_OK);
  settings.size += 4;
  EXPECT_EQ(opening(settings), LOWLUX_STAGE_BAD_ARGUMENT) << "no version ends within its padding";
}

TEST(LowluxStage, NamesProfilesThatCannotBeRead) {
  const test::ScratchDirectory scratch;
  scratch.write("broken.json", "{");
  for (const std::string& file :
       {scratch.file("absent.json"), scratch.file("broken.json"), scratch.path(), std::string()}) {
    auto settings = plain_settings();
    settings.profile_file = file.c_str();
    std::string message;
    EXPECT_EQ(opening(settings, &message), LOWLUX_STAGE_BAD_PROFILE);
    EXPECT_EQ(message.compare(0, std::min<std::size_t>(20, file.size()), file, 0, 20), 0) << message;
  }
  lowlux_stage* stage = nullptr;
  auto settings = plain_settings();
  settings.profile_file = "/absent";
  char none = 'x', five[5] = "";
  EXPECT_EQ(lowlux_stage_open(&settings, &stage, &none, 0), LOWLUX_STAGE_BAD_PROFILE);
  EXPECT_EQ(none, 'x') << "no room, nothing written";
  EXPECT_EQ(lowlux_stage_open(&settings, &stage, five, sizeof five), LOWLUX_STAGE_BAD_PROFILE);
  EXPECT_STREQ(five, "/abs");
}

// A caller that was compiled with a later header has more members at the end of its structs.
template <class T>
struct Later {
  T known{};
  unsigned char more[32];
  Later() {
    known.size = sizeof *this;
    std::memset(more, 0x77, sizeof more);
  }
  bool is_untouched() const {
    return known.size == sizeof *this && std::all_of(std::begin(more), std::end(more), [](int b) { return b == 0x77; });
  }
};

TEST(LowluxStage, TakesTheStructsOfLaterCallersAndLeavesWhatItDoesNotKnow) {
  Later<lowlux_stage_settings> settings;
  lowlux_stage* stage = nullptr;
  ASSERT_EQ(lowlux_stage_open(&settings.known, &stage, nullptr, 0), LOWLUX_STAGE_OK);
  const StagePtr owned(stage);
  Later<lowlux_stage_format_info> info;
  ASSERT_EQ(lowlux_stage_query(LOWLUX_STAGE_V4L2, words10().v4l2_fourcc, 0, &info.known), LOWLUX_STAGE_OK);
  Later<lowlux_stage_input> in;
  Later<lowlux_stage_output> out;
  const auto size = in.known.size;
  in.known = input_of(words10(), width, height);
  in.known.size = size;
  out.known.fourcc = LOWLUX_STAGE_BGR888;
  ASSERT_EQ(lowlux_stage_configure(stage, &in.known, &out.known), LOWLUX_STAGE_OK);
  Later<lowlux_stage_picture> picture;
  std::vector<std::uint8_t> rgb(out.known.bytes[0]);
  picture.known.planes = 1;
  picture.known.plane[0] = {rgb.data(), rgb.size(), out.known.stride[0]};
  Later<lowlux_stage_params> params;
  Later<lowlux_stage_result> result;
  Later<lowlux_stage_statistics> statistics;
  const auto bytes = packed_frame(words10().format, scene(words10().format, width, height), width, 2 * width);
  const auto source = source_of(bytes, 2 * width);
  ASSERT_EQ(lowlux_stage_process(stage, &source, &picture.known, &params.known, &result.known, &statistics.known),
            LOWLUX_STAGE_OK);
  EXPECT_TRUE(settings.is_untouched() && info.is_untouched() && in.is_untouched() && out.is_untouched() &&
              picture.is_untouched() && params.is_untouched() && result.is_untouched() && statistics.is_untouched());
}

// Callers that were compiled before there were budgets: what lies behind their structs is neither read nor written.
TEST(LowluxStage, TakesTheStructsOfEarlierCallersAndWritesNoMoreThanTheyHave) {
  Rig rig(plain_settings(), words10(), width, height, LOWLUX_STAGE_BGR888);
  const Codes codes = scene(words10().format, width, height);
  auto params = fixed_params(words10().format);
  ASSERT_EQ(rig.process(codes, params), LOWLUX_STAGE_OK);
  const auto picture = rig.planes[0];
  const auto whole = rig.result;
  params.size = offsetof(lowlux_stage_params, budget_ms);
  params.budget_ms = NAN;
  std::memset(&rig.result, 0x77, sizeof rig.result);
  rig.result.size = offsetof(lowlux_stage_result, step);
  ASSERT_EQ(rig.process(codes, params), LOWLUX_STAGE_OK) << rig.error();
  EXPECT_EQ(rig.planes[0], picture);
  EXPECT_EQ(rig.result.size, offsetof(lowlux_stage_result, step));
  const auto members = offsetof(lowlux_stage_result, applied);
  EXPECT_EQ(std::memcmp(&rig.result.applied, &whole.applied, offsetof(lowlux_stage_result, step) - members), 0);
  EXPECT_EQ(rig.result.step, 0x77777777);
  params.valid |= LOWLUX_STAGE_HAS_BUDGET;
  EXPECT_EQ(rig.process(codes, params), LOWLUX_STAGE_BAD_PARAMETER) << "a bit whose member is not there";
  // Of no version: half a member.
  params.valid &= ~static_cast<std::uint32_t>(LOWLUX_STAGE_HAS_BUDGET);
  params.size += 1;
  EXPECT_EQ(rig.process(codes, params), LOWLUX_STAGE_BAD_ARGUMENT);
  params.size -= 1;
  rig.result.size += 4;
  EXPECT_EQ(rig.process(codes, params), LOWLUX_STAGE_BAD_ARGUMENT);
}

TEST(LowluxStage, RefusesStructsOfASizeThatNoVersionHas) {
  Rig rig(plain_settings(), words10(), width, height, LOWLUX_STAGE_BGR888);
  const auto bytes = packed_frame(words10().format, scene(words10().format, width, height), width, 2 * width);
  const auto source = source_of(bytes, 2 * width);
  auto params = no_params();
  std::size_t* const sizes[] = {&rig.picture.size,    &params.size, &rig.result.size,
                                &rig.statistics.size, &rig.in.size, &rig.out.size};
  for (std::size_t* const size : sizes) {
    const std::size_t right = *size;
    for (const std::size_t wrong : {std::size_t{0}, right - 1, std::size_t{65537}, SIZE_MAX}) {
      *size = wrong;
      const bool configures = size == &rig.in.size || size == &rig.out.size;
      EXPECT_EQ(configures ? lowlux_stage_configure(rig.stage.get(), &rig.in, &rig.out)
                           : lowlux_stage_process(rig.stage.get(), &source, &rig.picture, &params, &rig.result,
                                                  &rig.statistics),
                LOWLUX_STAGE_BAD_ARGUMENT);
    }
    *size = right;
    EXPECT_EQ(rig.process(bytes, 2 * width, params), LOWLUX_STAGE_OK) << "the stage goes on";
  }
  EXPECT_EQ(lowlux_stage_process(rig.stage.get(), nullptr, &rig.picture, nullptr, nullptr, nullptr),
            LOWLUX_STAGE_BAD_ARGUMENT);
  EXPECT_EQ(lowlux_stage_process(rig.stage.get(), &source, nullptr, nullptr, nullptr, nullptr),
            LOWLUX_STAGE_BAD_ARGUMENT);
  EXPECT_EQ(lowlux_stage_process(rig.stage.get(), &source, &rig.picture, nullptr, nullptr, nullptr), LOWLUX_STAGE_OK);
}

TEST(LowluxStage, QueriesRefuseWhatIsNoRawFormat) {
  lowlux_stage_format_info info{};
  info.size = sizeof info;
  EXPECT_EQ(lowlux_stage_query(LOWLUX_STAGE_V4L2, LOWLUX_STAGE_NV12, 0, &info), LOWLUX_STAGE_UNSUPPORTED);
  EXPECT_EQ(lowlux_stage_query(LOWLUX_STAGE_DRM, LOWLUX_STAGE_FOURCC('R', 'G', '1', '0'), 77, &info),
            LOWLUX_STAGE_UNSUPPORTED)
      << "a modifier that is not known";
  EXPECT_EQ(lowlux_stage_query(2, words10().v4l2_fourcc, 0, &info), LOWLUX_STAGE_UNSUPPORTED);
  info.size = 8;
  EXPECT_EQ(lowlux_stage_query(LOWLUX_STAGE_V4L2, words10().v4l2_fourcc, 0, &info), LOWLUX_STAGE_BAD_ARGUMENT);
}

TEST(LowluxStage, NamesConfigurationsThatCannotBeAndIsThenUnconfigured) {
  struct Case {
    int code;
    void (*change)(lowlux_stage_input&, lowlux_stage_output&);
  };
  using I = lowlux_stage_input;
  using O = lowlux_stage_output;
  const Case cases[] = {
      {LOWLUX_STAGE_UNSUPPORTED, [](I& i, O&) { i.fourcc = LOWLUX_STAGE_NV12; }},
      {LOWLUX_STAGE_UNSUPPORTED, [](I& i, O&) { i.api = 7; }},
      {LOWLUX_STAGE_UNSUPPORTED, [](I&, O& o) { o.fourcc = LOWLUX_STAGE_FOURCC('Y', 'U', 'Y', 'V'); }},
      {LOWLUX_STAGE_BAD_ARGUMENT, [](I&, O& o) { o.yuv_matrix = 2020; }},
      {LOWLUX_STAGE_BAD_ARGUMENT, [](I& i, O&) { i.width = 1; }},
      {LOWLUX_STAGE_BAD_ARGUMENT, [](I& i, O&) { i.height = -5; }},
      {LOWLUX_STAGE_BAD_ARGUMENT, [](I& i, O&) { i.width = 65537; }},
      {LOWLUX_STAGE_BAD_ARGUMENT, [](I& i, O&) { i.width = INT32_MIN; }},
      {LOWLUX_STAGE_BAD_ARGUMENT,
       [](I& i, O&) {
         i.crop = {0, 0, 1, 10};
       }},
      {LOWLUX_STAGE_BAD_ARGUMENT,
       [](I& i, O&) {
         i.crop = {-2, 0, 10, 10};
       }},
      {LOWLUX_STAGE_BAD_ARGUMENT,
       [](I& i, O&) {
         i.crop = {INT32_MAX, 0, 10, 10};
       }},
      {LOWLUX_STAGE_BAD_ARGUMENT,
       [](I& i, O&) {
         i.crop = {2, 0, INT32_MAX, INT32_MAX};
       }},
      {LOWLUX_STAGE_BAD_ARGUMENT,
       [](I& i, O&) {
         i.crop = {0, 0, width + 1, height};
       }},
      {LOWLUX_STAGE_BAD_ARGUMENT,
       [](I& i, O&) {
         i.masked = {0, height, 4, 1};
       }},
      {LOWLUX_STAGE_BAD_ARGUMENT,
       [](I& i, O&) {
         i.masked = {0, 0, -4, 1};
       }},
      {LOWLUX_STAGE_BAD_ARGUMENT, [](I& i, O&) { i.white_level = NAN; }},
      {LOWLUX_STAGE_BAD_ARGUMENT, [](I& i, O&) { i.white_level = 65536; }},
      {LOWLUX_STAGE_BAD_ARGUMENT, [](I& i, O&) { i.white_level = -1; }},
      {LOWLUX_STAGE_TOO_LARGE, [](I& i, O&) { i.width = i.height = 65536; }},
  };
  Rig rig(plain_settings(), words10(), width, height, LOWLUX_STAGE_BGR888);
  const Codes codes = scene(words10().format, width, height);
  for (const Case& one : cases) {
    lowlux_stage_input in = rig.in;
    lowlux_stage_output out = rig.out;
    one.change(in, out);
    const auto n = &one - cases;
    EXPECT_EQ(lowlux_stage_configure(rig.stage.get(), &in, &out), one.code) << n << ' ' << rig.error();
    EXPECT_STRNE(rig.error(), "");
    EXPECT_EQ(std::string(rig.error()).find('\n'), std::string::npos);
    EXPECT_EQ(rig.process(codes, no_params()), LOWLUX_STAGE_NOT_CONFIGURED) << n;
    ASSERT_EQ(lowlux_stage_configure(rig.stage.get(), &rig.in, &rig.out), LOWLUX_STAGE_OK) << rig.error();
    ASSERT_EQ(rig.process(codes, no_params()), LOWLUX_STAGE_OK);
  }
}

TEST(LowluxStage, WhiteLevelsOfAnySizeCanBeConfigured) {
  for (const double white : {0.001, 1.0, 40.0, 1022.0, 65535.0}) {
    auto in = input_of(words10(), width, height);
    in.white_level = white;
    Rig rig(plain_settings(), words10(), in, LOWLUX_STAGE_BGR888);
    ASSERT_EQ(rig.configured, LOWLUX_STAGE_OK) << white << ' ' << rig.error();
    EXPECT_EQ(rig.process(scene(words10().format, width, height), no_params()), LOWLUX_STAGE_OK) << rig.error();
  }
}

TEST(LowluxStage, FramesTooLargeForTheLimitOfMemoryAreRefusedBeforeAnyIsTaken) {
  auto settings = plain_settings();
  settings.memory_limit = 64 << 20;
  const Rig small(settings, words10(), 640, 480, LOWLUX_STAGE_NV12);
  EXPECT_EQ(small.configured, LOWLUX_STAGE_OK) << small.error();
  const Rig large(settings, words10(), 4096, 3072, LOWLUX_STAGE_NV12);
  EXPECT_EQ(large.configured, LOWLUX_STAGE_TOO_LARGE);
  EXPECT_NE(std::string(large.error()).find("more than the limit of 64"), std::string::npos) << large.error();
}

TEST(LowluxStage, FillsInStridesAndAdjustsThoseThatAreTooSmall) {
  for (const std::uint32_t fourcc : {LOWLUX_STAGE_NV12, LOWLUX_STAGE_RGB48}) {
    Rig rig(plain_settings(), words10(), 33, 21, fourcc);
    const std::size_t least = fourcc == LOWLUX_STAGE_NV12 ? 33 : 6 * 33;
    EXPECT_EQ(rig.out.stride[0], least);
    EXPECT_EQ(rig.out.bytes[0], 21 * least);
    EXPECT_EQ(rig.out.planes, fourcc == LOWLUX_STAGE_NV12 ? 2 : 1);
    EXPECT_EQ(rig.out.stride[1], fourcc == LOWLUX_STAGE_NV12 ? 34U : 0U);
    EXPECT_EQ(rig.out.bytes[1], fourcc == LOWLUX_STAGE_NV12 ? 11U * 34 : 0U);
    auto out = rig.out;
    out.stride[0] = least + 30;
    EXPECT_EQ(lowlux_stage_configure(rig.stage.get(), &rig.in, &out), LOWLUX_STAGE_OK);
    EXPECT_EQ(out.stride[0], least + 30);
    EXPECT_EQ(out.bytes[0], 20 * (least + 30) + least);
    out.stride[0] = least - 2;
    EXPECT_EQ(lowlux_stage_configure(rig.stage.get(), &rig.in, &out), LOWLUX_STAGE_ADJUSTED);
    EXPECT_EQ(out.stride[0], least);
    out.stride[0] = least + 1;
    EXPECT_EQ(lowlux_stage_configure(rig.stage.get(), &rig.in, &out),
              fourcc == LOWLUX_STAGE_RGB48 ? LOWLUX_STAGE_ADJUSTED : LOWLUX_STAGE_OK);
  }
}

TEST(LowluxStage, NamesBuffersThatCannotHoldAFrame) {
  const RawFormatNames& names = names_of_bayer(10, BayerPhase::rggb, RawPacking::csi2);
  for (const std::uint32_t fourcc : {LOWLUX_STAGE_BGR888, LOWLUX_STAGE_NV12, LOWLUX_STAGE_RGB48}) {
    Rig rig(plain_settings(), names, width, height, fourcc);
    const std::size_t row = row_bytes(names.format, width), stride = row + 7;
    const auto bytes = packed_frame(names.format, scene(names.format, width, height), width, stride);
    const lowlux_stage_source whole{bytes.data(), stride * (height - 1) + row, stride, -1};
    const auto code_of = [&](const lowlux_stage_source& source, const lowlux_stage_picture& picture) {
      return lowlux_stage_process(rig.stage.get(), &source, &picture, nullptr, nullptr, nullptr);
    };
    EXPECT_EQ(code_of(whole, rig.picture), LOWLUX_STAGE_OK) << rig.error();
    const auto with_source = [&](auto change) {
      auto source = whole;
      change(source);
      return code_of(source, rig.picture);
    };
    EXPECT_EQ(with_source([](auto& s) { s.length -= 1; }), LOWLUX_STAGE_SHORT_BUFFER);
    EXPECT_EQ(with_source([](auto& s) { s.length = 0; }), LOWLUX_STAGE_SHORT_BUFFER);
    EXPECT_EQ(with_source([](auto& s) { s.data = nullptr; }), LOWLUX_STAGE_MISSING_PLANE);
    EXPECT_EQ(with_source([&](auto& s) { s.stride = row - 1; }), LOWLUX_STAGE_BAD_STRIDE);
    EXPECT_EQ(with_source([](auto& s) { s.stride = 0; }), LOWLUX_STAGE_BAD_STRIDE);
    EXPECT_EQ(with_source([](auto& s) { s.stride = SIZE_MAX; }), LOWLUX_STAGE_BAD_STRIDE);
    EXPECT_EQ(with_source([](auto& s) { s.stride = SIZE_MAX / 16; }), LOWLUX_STAGE_BAD_STRIDE);
    EXPECT_EQ(with_source([](auto& s) { s.stride += 1; }), LOWLUX_STAGE_SHORT_BUFFER) << "the stride lies";
    for (int p = 0; p < rig.out.planes; ++p) {
      const auto with_plane = [&](auto change) {
        auto picture = rig.picture;
        change(picture.plane[p]);
        return code_of(whole, picture);
      };
      EXPECT_EQ(with_plane([&](auto& q) { q.length = rig.out.bytes[p]; }), LOWLUX_STAGE_OK);
      EXPECT_EQ(with_plane([&](auto& q) { q.length = rig.out.bytes[p] - 1; }), LOWLUX_STAGE_SHORT_BUFFER);
      EXPECT_EQ(with_plane([](auto& q) { q.data = nullptr; }), LOWLUX_STAGE_MISSING_PLANE);
      EXPECT_EQ(with_plane([](auto& q) { q.stride -= 2; }), LOWLUX_STAGE_BAD_STRIDE);
      EXPECT_EQ(with_plane([](auto& q) { q.stride = SIZE_MAX - 1; }), LOWLUX_STAGE_BAD_STRIDE);
      EXPECT_EQ(with_plane([](auto& q) { q.stride += 2; }), LOWLUX_STAGE_SHORT_BUFFER);
      if (fourcc == LOWLUX_STAGE_RGB48) {
        EXPECT_EQ(with_plane([](auto& q) { q.stride += 1; }), LOWLUX_STAGE_BAD_STRIDE) << "odd";
        EXPECT_EQ(with_plane([](auto& q) { q.data = static_cast<std::uint8_t*>(q.data) + 1; }),
                  LOWLUX_STAGE_BAD_STRIDE);
      }
    }
    auto picture = rig.picture;
    picture.planes = rig.out.planes - 1;
    EXPECT_EQ(code_of(whole, picture), LOWLUX_STAGE_MISSING_PLANE);
    picture.planes = 3;  // more than there have to be
    EXPECT_EQ(code_of(whole, picture), LOWLUX_STAGE_OK);
  }
}

TEST(LowluxStage, BracketsOnlyWhatIsADmaBufAndTakesAnyOtherDescriptor) {
  Rig rig(plain_settings(), words10(), width, height, LOWLUX_STAGE_BGR888);
  const auto bytes = packed_frame(words10().format, scene(words10().format, width, height), width, 2 * width);
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  close(ends[1]);
  for (const int fd : {-1, -100, ends[0], 99999}) {
    const lowlux_stage_source source{bytes.data(), bytes.size(), 2 * width, fd};
    EXPECT_EQ(lowlux_stage_process(rig.stage.get(), &source, &rig.picture, nullptr, nullptr, nullptr), LOWLUX_STAGE_OK);
  }
  close(ends[0]);
}

TEST(LowluxStage, LooksOfTheEyeNeedTheLightOfTheScene) {
  auto settings = plain_settings();
  settings.look = LOWLUX_STAGE_LOOK_EYE;
  Rig rig(settings, words10(), width, height, LOWLUX_STAGE_BGR888);
  ASSERT_EQ(rig.configured, LOWLUX_STAGE_OK);
  const Codes codes = scene(words10().format, width, height);
  EXPECT_EQ(rig.process(codes, no_params()), LOWLUX_STAGE_UNKNOWN_LIGHT);
  auto params = no_params();
  params.valid = LOWLUX_STAGE_HAS_SCENE_LUMINANCE;
  params.scene_luminance_cd_m2 = 0.01;
  EXPECT_EQ(rig.process(codes, params), LOWLUX_STAGE_OK) << rig.error();
  EXPECT_GT(rig.result.scene_luminance_cd_m2, 0);
}

}  // namespace
}  // namespace lowlux::lowlux_stage_test
