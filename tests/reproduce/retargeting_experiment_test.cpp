#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "isp/reproduce/reproduce.h"
#include "isp/reproduce/retargeting_scores.h"
#include "tests/support/scratch_directory.h"

namespace lowlux::isp {
namespace {

const std::string pictures_folder = LOWLUX_TESTDATA "/pictures";

RunOptions quick_options() {
  RunOptions options;
  options.quick = true;
  options.pictures_folder = pictures_folder;
  return options;
}

RetargetTable identity_table() {
  InlineExecutor executor;
  return tabulated([](const Vector3& code) { return code; }, 2, executor);
}

std::vector<PictureColours> one_picture() {
  PictureColours out{"ramp", {}};
  for (int r = 0; r < 8; ++r) {
    for (int g = 0; g < 8; ++g) {
      for (int i = 0; i < 8; ++i) out.codes.push_back({r / 7.0, g / 7.0, 0.5});  // each often enough for its bin
    }
  }
  return {out};
}

TEST(RetargetScores, APictureIsItselfOnItsOwnDisplay) {
  InlineExecutor executor;
  const RetargetTable table = identity_table();
  const auto scores = retarget_scores(one_picture(), {250, 250, &table}, {"shin"}, executor);
  ASSERT_TRUE(scores) << scores.error().message;
  ASSERT_EQ(scores->size(), 1u);
  EXPECT_NEAR(scores->front().delta_e_94c, 0, 1e-3);     // Delta E: codes of 16 bits
  EXPECT_NEAR(scores->front().gamut_percent, 100, 1.0);  // %: a bin's edge is crossed by a code's rounding
}

TEST(RetargetScores, ADimDisplayCostsColour) {
  InlineExecutor executor;
  const RetargetTable table = identity_table();
  const Showing dim{250, 2, &table};
  const auto scores = retarget_scores(one_picture(), dim, {"shin"}, executor);
  ASSERT_TRUE(scores);
  EXPECT_GT(scores->front().delta_e_94c, 1);
  EXPECT_LT(scores->front().gamut_percent, 50);
  EXPECT_FALSE(retarget_scores(one_picture(), dim, {"hume"}, executor));
}

TEST(Icam06Forward, KeepsWhiteAndGreysNeutralAndFadesColours) {
  const CodeMap map = icam06_forward(2);
  for (const double code : {0.0, 0.2, 0.7, 1.0}) {
    const Vector3 grey = map({code, code, code});
    // Codes: Bradford's matrix and sRGB's are rounded to four digits.
    EXPECT_NEAR(grey[0], grey[1], 1e-3) << code;
    EXPECT_NEAR(grey[2], grey[1], 1e-3) << code;
  }
  EXPECT_NEAR(map({1, 1, 1})[1], 1, 1e-3);
  const Vector3 red = map({0.8, 0.2, 0.2});
  EXPECT_GT(red[0], red[1]);
  EXPECT_LT(red[0] - red[1], 0.6);
}

// 1.27 by an independent program, on the same five pictures at all pixels; here every n-th one.
TEST(Icam06Forward, LeavesPicturesFartherByTheFactorOfAnIndependentProgram) {
  InlineExecutor executor;
  auto pictures = retargeting_pictures(pictures_folder, {.crop_px = 0, .colours = 20000}, executor);
  ASSERT_TRUE(pictures) << pictures.error().message;
  std::erase_if(*pictures, [](const PictureColours& picture) { return !picture.name.starts_with("kodim"); });
  ASSERT_EQ(pictures->size(), 5u);
  const RunOptions options;
  const RetargetingWork work{*pictures, 33, options, executor};
  constexpr std::array methods{RetargetMethod::none, RetargetMethod::icam06};
  const auto at = scores_on(2, ShinUnits::luminance_as_is, methods, work);
  ASSERT_TRUE(at) << at.error().message;
  const double factor = mean_delta_e(at->of(RetargetMethod::icam06)) / mean_delta_e(at->of(RetargetMethod::none));
  EXPECT_NEAR(factor, 1.27, 0.005 + 0.01);  // print, and pixels that are left out
}

TEST(RetargetingPictures, AreEightOfAtMostSoManyColours) {
  InlineExecutor executor;
  const auto pictures = retargeting_pictures(pictures_folder, {.crop_px = 64, .colours = 1000}, executor);
  ASSERT_TRUE(pictures) << pictures.error().message;
  ASSERT_EQ(pictures->size(), 8u);
  for (const PictureColours& picture : *pictures) {
    EXPECT_EQ(picture.codes.size(), 22u * 22u) << picture.name;  // every third pixel: 32 x 32 would be too many
    for (const Vector3& code : picture.codes) {
      EXPECT_TRUE(std::ranges::all_of(code, [](double c) { return c >= 0 && c <= 1; }));
    }
  }
}

TEST(RetargetingExperiment, MissingPicturesAreOneErrorWithTheirFolder) {
  const test::ScratchDirectory scratch;
  for (const std::string& folder : {scratch.file("none"), std::string()}) {
    RunOptions options = quick_options();
    options.pictures_folder = folder;
    const auto outcome = run_retargeting(options);
    ASSERT_FALSE(outcome);
    EXPECT_EQ(outcome.error().code, ErrorCode::not_found);
    EXPECT_EQ(outcome.error().where, folder);
    EXPECT_NE(outcome.error().message.find("--pictures-folder"), std::string::npos);
  }
  RunOptions options = quick_options();
  options.pictures_folder = scratch.path();  // without the files
  const auto outcome = run_retargeting(options);
  ASSERT_FALSE(outcome);
  EXPECT_NE(outcome.error().where.find("kodim05.png"), std::string::npos) << outcome.error().where;
}

TEST(RetargetingExperiment, FindingsHoldOrAreKnownNotTo) {
  const auto outcome = run_retargeting(quick_options());
  ASSERT_TRUE(outcome) << outcome.error().message;
  // The rods' share of iCAM06's response greys all colours; other judges find both inverses too colourful.
  const std::set<std::string> known_not_to_hold{"retargeting/icam06-gamut", "retargeting/closer-by-others"};
  EXPECT_EQ(outcome->plots.size(), 4u);
  std::set<std::string> ids;
  for (const Finding& f : outcome->findings) {
    EXPECT_EQ(f.holds, !known_not_to_hold.contains(f.id)) << f.id << ": " << f.ours << " (" << f.note << ")";
    EXPECT_TRUE(f.id.starts_with("retargeting/") && ids.insert(f.id).second) << f.id;
    const bool of_thesis = std::set<std::string>{"retargeting/closer", "retargeting/gamut", "retargeting/cao",
                                                 "retargeting/icam06-farther", "retargeting/icam06-gamut"}
                               .contains(f.id);
    EXPECT_EQ(f.kind == Finding::Kind::published, of_thesis) << f.id;
  }
}

}  // namespace
}  // namespace lowlux::isp
