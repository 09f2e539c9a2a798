#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <string>

#include "tests/cli/command.h"
#include "tests/support/dng/dng_builder.h"
#include "tests/support/process.h"
#include "tests/support/scratch_directory.h"

namespace lowlux {
namespace {

using test::DngBuilder;
using test::Tag;
using test::TagType;

constexpr std::uint16_t black_level = 50714, white_level = 50717, colour_matrix_1 = 50721, image_width = 256,
                        image_length = 257;

DngBuilder small_dng() {
  DngBuilder dng;
  dng.width = 64;
  dng.height = 48;
  dng.bits = 12;
  return dng;
}

class BadInput : public testing::Test {
 protected:
  // Writes the bytes as a raw file and develops it.
  test::ProcessResult develop(const std::vector<std::byte>& bytes) {
    test::write_file(raw_, bytes.data(), bytes.size());
    return test::run_process({test::tested_command(), "develop", raw_, "-o", scratch_.file("out.png")});
  }

  // Exit code 1, one line that names the file and holds `clue`, and no file but the raw.
  void expect_refused(const test::ProcessResult& result, const std::string& clue) {
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_NE(result.err.find(raw_), std::string::npos) << result.err;
    EXPECT_NE(result.err.find(clue), std::string::npos) << result.err;
    EXPECT_EQ(result.out, "");
    EXPECT_EQ(scratch_.names(), (std::vector<std::string>{"in.dng"}));
  }

  test::ScratchDirectory scratch_;
  std::string raw_ = scratch_.file("in.dng");
};

TEST_F(BadInput, SoundFilesAreDeveloped) {
  const test::ProcessResult result = develop(small_dng().build());
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(scratch_.names(), (std::vector<std::string>{"in.dng", "out.png"}));
}

TEST_F(BadInput, TruncatedFiles) {
  const std::vector<std::byte> whole = small_dng().build();
  for (const std::size_t length :
       {std::size_t{3}, std::size_t{8}, std::size_t{100}, whole.size() / 2, whole.size() - 200}) {
    expect_refused(develop({whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(length)}), "");
  }
}

TEST_F(BadInput, BitFlippedFilesEitherDevelopOrSayWhyNot) {
  const std::vector<std::byte> whole = small_dng().build();
  std::mt19937 random(1);
  for (int i = 0; i < 40; ++i) {
    std::vector<std::byte> flipped = whole;
    for (int bit = 0; bit < 8; ++bit) flipped[random() % 900] ^= std::byte{1} << (random() % 8);
    const test::ProcessResult result = develop(flipped);
    ASSERT_TRUE(result.exit_code == 0 || result.exit_code == 1) << result.exit_code << result.err;
    if (result.exit_code == 1) {
      expect_refused(result, "");
    } else {
      std::filesystem::remove(scratch_.file("out.png"));
    }
  }
}

TEST_F(BadInput, EmptyFiles) { expect_refused(develop({}), "empty"); }

TEST_F(BadInput, TextWithTheNameOfARawFile) {
  const std::string text = "These are my holiday notes, not a raw file.\n";
  const auto* bytes = reinterpret_cast<const std::byte*>(text.data());
  expect_refused(develop({bytes, bytes + text.size()}), "not");
}

TEST_F(BadInput, AbsurdDimensions) {
  for (const double size : {65535.0, 2147483647.0, 4294967295.0}) {
    DngBuilder dng = small_dng();
    dng.set(image_width, Tag::numbers(TagType::u32, {size})).set(image_length, Tag::numbers(TagType::u32, {size}));
    expect_refused(develop(dng.build()), "");
  }
  DngBuilder none = small_dng();
  none.set(image_width, Tag::numbers(TagType::u32, {0}));
  expect_refused(develop(none.build()), "");
}

TEST_F(BadInput, WhiteNotAboveBlack) {
  DngBuilder dng = small_dng();
  dng.set(white_level, Tag::numbers(TagType::u32, {200})).set(black_level, Tag::numbers(TagType::u32, {200}));
  expect_refused(develop(dng.build()), "200");
}

TEST_F(BadInput, MatricesThatAreNotNumbers) {
  DngBuilder dng = small_dng();
  dng.set(colour_matrix_1, Tag::rationals(TagType::srational, std::vector<std::pair<double, double>>(9, {0, 0})));
  expect_refused(develop(dng.build()), "ColorMatrix1");
}

TEST_F(BadInput, SingularMatrices) {
  DngBuilder dng = small_dng();
  dng.set(colour_matrix_1, Tag::numbers(TagType::srational, std::vector<double>(9, 1.0)));
  expect_refused(develop(dng.build()), "ColorMatrix1");
}

TEST_F(BadInput, DamagedTagsThatThePictureCanDoWithoutAreWarningsThatHelp) {
  const std::pair<DngBuilder, std::string> cases[] = {
      {small_dng().set(50728, Tag::numbers(TagType::rational, {1, 0.01, 1})), "--wb sets another"},
      {small_dng().set(51041, Tag::numbers(TagType::f64, {std::nan(""), 0})), "NoiseProfile"},
      {small_dng().set(51009, Tag::opaque(std::vector<std::byte>(9, std::byte{255}))), "OpcodeList2"},
      {small_dng().set(34853, Tag::numbers(TagType::u32, {4e9})), ""}};
  for (const auto& [dng, clue] : cases) {
    const test::ProcessResult result = develop(dng.build());
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_NE(result.err.find(clue), std::string::npos) << result.err;
    EXPECT_TRUE(scratch_.holds("out.png"));
    std::filesystem::remove(scratch_.file("out.png"));
  }
}

// A mosaic without a black level is developed as with a level of 0, and a warning names the option that sets another.
// A level that the user gives is used without a warning.
TEST_F(BadInput, AMissingBlackLevelIsTheDefaultOfDng) {
  const auto picture_and_warnings = [&](const DngBuilder& dng, const std::vector<std::string>& options) {
    const std::vector<std::byte> bytes = dng.build();
    test::write_file(raw_, bytes.data(), bytes.size());
    std::vector<std::string> words{test::tested_command(), "develop", raw_, "-o", scratch_.file("out.png"), "--force"};
    words.insert(words.end(), options.begin(), options.end());
    const test::ProcessResult result = test::run_process(words);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return std::pair(test::read_file(scratch_.file("out.png")), result.err);
  };
  DngBuilder none = small_dng(), zero = small_dng();
  const auto expected = picture_and_warnings(zero.set(black_level, Tag::numbers(TagType::u16, {0})), {});
  const auto found = picture_and_warnings(none.remove(black_level), {});
  EXPECT_EQ(found.first, expected.first);
  EXPECT_EQ(expected.second.find("black level"), std::string::npos) << expected.second;
  EXPECT_NE(found.second.find("states no black level, so 0 is used"), std::string::npos) << found.second;
  EXPECT_NE(found.second.find("--black DN"), std::string::npos) << found.second;
  const auto given = picture_and_warnings(none, {"--black", "0"});
  EXPECT_EQ(given.first, expected.first);
  EXPECT_EQ(given.second.find("black level"), std::string::npos) << given.second;
  const test::ProcessResult calibrated =
      test::run_process({test::tested_command(), "calibrate", "noise", raw_, "-o", scratch_.file("p.json")});
  EXPECT_EQ(calibrated.exit_code, 1);
  EXPECT_NE(calibrated.err.find("states no black level"), std::string::npos) << calibrated.err;
  EXPECT_FALSE(scratch_.holds("p.json"));
}

TEST_F(BadInput, MissingMatricesGiveAnImageWithOneWarning) {
  DngBuilder dng = small_dng();
  dng.remove(colour_matrix_1).remove(50728);
  const test::ProcessResult result = develop(dng.build());
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.err.find("the colours of the camera are unknown"), std::string::npos) << result.err;
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 2) << "the other is about noise: " << result.err;
  EXPECT_NE(result.err.find("the noise is estimated"), std::string::npos) << result.err;
  const auto linear = test::run_process({test::tested_command(), "develop", raw_, "-o", scratch_.file("out.exr")});
  EXPECT_EQ(linear.exit_code, 1);
  EXPECT_NE(linear.err.find("--space camera"), std::string::npos) << linear.err;
  const auto camera =
      test::run_process({test::tested_command(), "develop", raw_, "-o", scratch_.file("out.tif"), "--space", "camera"});
  EXPECT_EQ(camera.exit_code, 0) << camera.err;
}

TEST_F(BadInput, MissingFilesAndFolders) {
  expect_refused(develop({}), "");
  for (const std::string& name : {scratch_.file("absent.dng"), std::string("/")}) {
    const auto result = test::run_process({test::tested_command(), "develop", name, "-o", scratch_.file("out.png")});
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_NE(result.err.find(name), std::string::npos);
    EXPECT_EQ(scratch_.names(), (std::vector<std::string>{"in.dng"}));
  }
}

TEST_F(BadInput, OutputsThatCannotBeWritten) {
  ASSERT_EQ(develop(small_dng().build()).exit_code, 0);
  for (const std::string& out :
       {scratch_.file("no/such/folder/out.png"), std::string("/proc/out.png"), scratch_.file("in.dng/out.png")}) {
    const auto result = test::run_process({test::tested_command(), "develop", raw_, "-o", out});
    EXPECT_EQ(result.exit_code, 1) << out;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_NE(result.err.find(out), std::string::npos) << result.err;
  }
  EXPECT_EQ(scratch_.names(), (std::vector<std::string>{"in.dng", "out.png"}));
}

TEST_F(BadInput, ExistingOutputsAreKeptWithoutForce) {
  test::write_file(scratch_.file("out.png"), "precious", 8);
  const auto refused = develop(small_dng().build());
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_NE(refused.err.find("--force"), std::string::npos);
  EXPECT_EQ(test::read_file(scratch_.file("out.png")), "precious");
  const auto forced =
      test::run_process({test::tested_command(), "develop", raw_, "-o", scratch_.file("out.png"), "--force"});
  EXPECT_EQ(forced.exit_code, 0);
  EXPECT_NE(test::read_file(scratch_.file("out.png")), "precious");
}

TEST_F(BadInput, AFailedFileLeavesTheForcedOutputAsItWas) {
  test::write_file(scratch_.file("out.png"), "precious", 8);
  test::write_file(raw_, "II", 2);
  EXPECT_EQ(
      test::run_process({test::tested_command(), "develop", raw_, "-o", scratch_.file("out.png"), "--force"}).exit_code,
      1);
  EXPECT_EQ(test::read_file(scratch_.file("out.png")), "precious");
}

}  // namespace
}  // namespace lowlux
