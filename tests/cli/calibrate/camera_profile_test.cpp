// The tables of a DNG's profile: what `develop` makes of a file that has them.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/cli/command.h"
#include "tests/support/dng/dng_builder.h"
#include "tests/support/scratch_directory.h"

namespace lowlux {
namespace {

using test::DngBuilder;
using test::lowlux;
using test::Tag;
using test::TagType;

const std::vector<double> identity{0, 1, 1, 0, 1, 1}, stronger{0, 1, 1, 30, 1.5, 0.7};

class CameraProfileCommand : public testing::Test {
 protected:
  /// Writes a DNG of coloured ramps with a map, a look table, or none where the values are empty.
  void write(const std::string& name, const std::vector<double>& map, const std::vector<double>& look) {
    DngBuilder dng;
    dng.width = 192, dng.height = 128;
    const auto set = [&](std::uint16_t dims, std::uint16_t data, const std::vector<double>& values) {
      if (values.empty()) return;
      dng.set(dims, Tag::numbers(TagType::u32, {1, 2, 1}));
      dng.set(data, Tag::numbers(TagType::f32, values));
    };
    set(50937, 50938, map);
    set(50981, 50982, look);
    const auto bytes = dng.build();
    std::ofstream out(folder_.file(name), std::ios::binary);
    out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }

  /// Develops a file, and returns the bytes of the image.
  std::string developed(const std::string& raw, const std::vector<std::string>& more = {},
                        const std::string& image = "out.png") {
    std::vector<std::string> words{"develop", folder_.file(raw), "-o", folder_.file(image), "--force", "--json"};
    words.insert(words.end(), more.begin(), more.end());
    const auto result = lowlux(words);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    report_ = nlohmann::json::parse(result.out)[0];
    std::ifstream in(folder_.file(image), std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  test::ScratchDirectory folder_;
  nlohmann::json report_;
};

TEST_F(CameraProfileCommand, TablesAreAppliedUnlessToldNotTo) {
  write("plain.dng", {}, {});
  write("map.dng", stronger, {});
  write("look.dng", {}, stronger);
  const std::string plain = developed("plain.dng");
  EXPECT_TRUE(report_["camera_profile"].is_null());
  const std::string map = developed("map.dng");
  EXPECT_EQ(report_["camera_profile"]["hue_sat_map"], (std::vector<int>{1, 2, 1}));
  EXPECT_TRUE(report_["camera_profile"]["look_table"].is_null());
  EXPECT_NE(map, plain);
  // Without divisions of value a table is homogeneous: its place before or after exposure makes no difference but
  // rounding, so both images may differ by a code and are not compared.
  EXPECT_NE(developed("look.dng"), plain);
  EXPECT_EQ(report_["camera_profile"]["look_table"], (std::vector<int>{1, 2, 1}));
  for (const std::string raw : {"map.dng", "look.dng"}) {
    EXPECT_EQ(developed(raw, {"--camera-profile", "none"}), plain);
    EXPECT_TRUE(report_["camera_profile"].is_null());
  }
  const auto explained = lowlux({"develop", folder_.file("map.dng"), "-o", folder_.file("e.png"), "--explain"});
  EXPECT_NE((explained.out + explained.err).find("embedded, map of 1 hues, 2 saturations and 1 values"),
            std::string::npos);
}

TEST_F(CameraProfileCommand, TheToneCurveReplacesTheStandardOne) {
  const auto with_curve = [&](const std::string& name, const std::vector<double>& points) {
    DngBuilder dng;
    dng.width = 192, dng.height = 128;
    if (!points.empty()) dng.set(50940, Tag::numbers(TagType::f32, points));
    const auto bytes = dng.build();
    std::ofstream out(folder_.file(name), std::ios::binary);
    out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  };
  with_curve("plain.dng", {});
  with_curve("line.dng", {0, 0, 1, 1});
  with_curve("bright.dng", {0, 0, 0.2, 0.4, 1, 1});
  with_curve("wrong.dng", {0, 0, 0.2, 0.4, 1, 0.9});
  const std::vector<std::string> at_0{"--exposure", "0"}, none{"--exposure", "0", "--camera-profile", "none"},
      standard{"--exposure", "0", "--tone", "standard"}, linear{"--exposure", "0", "--tone", "none"};
  const std::string plain = developed("plain.dng", at_0), bright = developed("bright.dng", at_0);
  EXPECT_EQ(report_["camera_profile"]["tone_curve_points"], 3);
  EXPECT_NE(bright, plain);
  EXPECT_EQ(developed("bright.dng", none), plain);
  EXPECT_EQ(developed("bright.dng", standard), plain) << "a curve that is named comes before";
  EXPECT_EQ(developed("bright.dng", linear), developed("plain.dng", linear));
  for (const char* const shape : {"--brightness", "--contrast"}) {
    const std::vector<std::string> shaped{"--exposure", "0", shape, "0.8"};
    EXPECT_NE(developed("plain.dng", shaped), plain) << shape;
    EXPECT_EQ(developed("bright.dng", shaped), developed("plain.dng", shaped)) << shape << " is of the standard curve";
  }
  EXPECT_EQ(developed("wrong.dng", at_0), plain);
  EXPECT_NE(report_["warnings"].dump().find("tone curve is not valid"), std::string::npos);
  // The automatic exposure places mid-grey where the curve shows it as mid-grey.
  developed("plain.dng");
  const double ev = report_["exposure"]["ev"];
  developed("line.dng");
  EXPECT_NEAR(report_["exposure"]["ev"], ev, 0.01);
  developed("bright.dng");
  EXPECT_LT(report_["exposure"]["ev"], ev - 0.5);
}

TEST_F(CameraProfileCommand, IdentityChangesNoByte) {
  write("plain.dng", {}, {});
  write("identity.dng", identity, identity);
  EXPECT_EQ(developed("identity.dng"), developed("plain.dng"));
}

TEST_F(CameraProfileCommand, LinearSpacesAndLooksDoWithout) {
  write("plain.dng", {}, {});
  write("both.dng", stronger, stronger);
  for (const std::vector<std::string>& more :
       {std::vector<std::string>{"--space", "linear-srgb"}, {"--look", "eye", "--scene-luminance", "1"}}) {
    const std::string image = more[0] == "--space" ? "out.tif" : "out.png";
    const std::string both = developed("both.dng", more, image);
    EXPECT_TRUE(report_["camera_profile"].is_null());
    EXPECT_EQ(both, developed("plain.dng", more, image)) << more[1];
  }
}

TEST_F(CameraProfileCommand, AHostileTableIsLeftOutWithOneWarning) {
  write("plain.dng", {}, {});
  write("hostile.dng", {0, 1, 1, 0, -1, 1}, {});
  const std::string plain = developed("plain.dng");
  const std::size_t warnings = report_["warnings"].size();
  EXPECT_EQ(developed("hostile.dng"), plain);
  EXPECT_EQ(report_["warnings"].size(), warnings + 1);
}

}  // namespace
}  // namespace lowlux
