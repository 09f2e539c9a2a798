// Opcode lists through the command: a flat scene whose codes are such that its opcodes make it flat again.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "tests/cli/command.h"
#include "tests/support/dng/dng_builder.h"
#include "tests/support/dng/drawn_opcodes.h"
#include "tests/support/scratch_directory.h"

namespace lowlux {
namespace {

using test::DngBuilder;
using test::DrawnOpcode;
using test::lowlux;
using test::Tag;
using test::TagType;

constexpr int width = 96, height = 64;
constexpr double black = 512, white = 15000;

Tag list_of(const std::vector<DrawnOpcode>& opcodes) {
  std::vector<test::Opcode> encoded;
  for (const DrawnOpcode& opcode : opcodes) encoded.push_back(opcode.encoded);
  return test::opcode_list(encoded);
}

/// The fraction of white of a pixel after all opcodes.
double made_of(double code, int x, int y, const std::vector<DrawnOpcode>& first,
               const std::vector<DrawnOpcode>& second) {
  for (const DrawnOpcode& opcode : first) code = std::round(std::clamp(opcode.truth(code, x, y, 0), 0.0, 65535.0));
  double value = (code - black) / (white - black);
  for (const DrawnOpcode& opcode : second) value = opcode.truth(value, x, y, 0);
  return value;
}

/// The code of which rising opcodes make the nearest to a fraction of white.
std::uint16_t code_for(double fraction, int x, int y, const std::vector<DrawnOpcode>& first,
                       const std::vector<DrawnOpcode>& second) {
  int below = 0, above = 65535;
  while (above - below > 1) {
    const int middle = (below + above) / 2;
    (made_of(middle, x, y, first, second) <= fraction ? below : above) = middle;
  }
  const bool nearer = fraction - made_of(below, x, y, first, second) < made_of(above, x, y, first, second) - fraction;
  return static_cast<std::uint16_t>(nearer ? below : above);
}

DngBuilder flat_dng(double light, bool monochrome, const std::vector<DrawnOpcode>& first = {},
                    const std::vector<DrawnOpcode>& second = {}) {
  DngBuilder dng;
  dng.width = width, dng.height = height, dng.monochrome = monochrome;
  dng.set(50714, Tag::numbers(TagType::u16, {black}));
  dng.set(50717, Tag::numbers(TagType::u16, {white}));
  dng.set(51041, Tag::numbers(TagType::f64, {1e-8, 1e-9}));  // hardly any noise
  if (!first.empty()) dng.set(test::opcode_list1, list_of(first));
  if (!second.empty()) dng.set(test::opcode_list2, list_of(second));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) dng.pixels.push_back(code_for(light, x, y, first, second));
  }
  return dng;
}

class OpcodeLists : public testing::Test {
 protected:
  std::string file(const std::string& name) const { return folder_.file(name); }
  void write(const std::string& name, const DngBuilder& dng) {
    const auto bytes = dng.build();
    std::ofstream(file(name), std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }
  static void run(std::vector<std::string> words) {
    for (const char* word : {"--force", "--line-noise", "off", "--repair", "off"}) words.emplace_back(word);
    const auto result = lowlux(words);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(result.err.find("not applied"), std::string::npos) << result.err;
  }
  /// Camera RGB of a raw file, without noise reduction.
  std::vector<float> developed(const std::string& raw) {
    run({"develop", file(raw), "-o", file("out.pfm"), "--tone", "none", "--exposure", "0", "--space", "camera",
         "--denoise", "off"});
    std::ifstream pfm(file("out.pfm"), std::ios::binary);
    std::string line;
    for (int i = 0; i < 3; ++i) std::getline(pfm, line);
    std::vector<float> values(std::size_t{width} * height * 3);
    pfm.read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(values.size() * sizeof(float)));
    EXPECT_TRUE(pfm.good());
    return values;
  }
  void expect_like(const std::vector<float>& flat, const std::string& raw, double tolerance) {
    const std::vector<float> values = developed(raw);
    double worst = 0;
    for (std::size_t i = 0; i < values.size(); ++i) {
      worst = std::max(worst, static_cast<double>(std::fabs(values[i] - flat[i])));
    }
    EXPECT_LE(worst, tolerance) << raw;
  }

  test::ScratchDirectory folder_;
};

TEST_F(OpcodeLists, MakeAFlatSceneFlatWhenItIsDevelopedDenoisedAndMerged) {
  for (unsigned seed = 0; seed < 12; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 draw(seed);
    const bool monochrome = seed % 4 == 3;
    std::vector<DrawnOpcode> first, second;
    for (unsigned i = draw() % 3; i > 0; --i) {
      first.push_back(test::draw_opcode(8 + draw() % 6, {.list = 1, .width = width, .height = height}, draw));
    }
    for (unsigned i = 1 + draw() % 4; i > 0; --i) {
      const std::uint32_t id = seed % 2 == 0 ? 9 + draw() % 5 : 7 + draw() % 7;  // even seeds: without maps
      second.push_back(test::draw_opcode(id, {.list = 2, .width = width, .height = height}, draw));
    }
    const double light = 0.1 + 0.02 * seed;
    write("flat.dng", flat_dng(light, monochrome));
    const DngBuilder source = flat_dng(light, monochrome, first, second);
    write("a.dng", source);
    const std::vector<float> flat = developed("flat.dng");
    // A code is 1 / 14,488 of white. Rounding leaves half of one in the flat scene; one that opcodes raise by 1.2 at
    // most in the other, because the first list rounds too; and a quarter of one in the 16 bits of clean and merged
    // raws. White balance doubles them all.
    constexpr double tolerance = 2 * (0.5 + 1.2 + 0.3) / (white - black);
    expect_like(flat, "a.dng", tolerance);
    run({"denoise", file("a.dng"), "-o", file("clean.dng")});
    expect_like(flat, "clean.dng", tolerance);
    if (monochrome) continue;
    write("b.dng", source);
    run({"merge", file("a.dng"), file("b.dng"), "-o", file("merged.dng"), "--align", "none"});
    expect_like(flat, "merged.dng", tolerance);
  }
}

TEST_F(OpcodeLists, ThatAreNotAppliedReachTheWrittenRaw) {
  test::Opcode unknown = test::words(99, {1, 2, 3});
  unknown.version = 0x01060000, unknown.flags = 0;
  test::Opcode absent = test::words(8, {0, 0, height, width, 1, 1, 1, 1, 1});  // of a plane that the mosaic lacks
  test::append_f64(absent.parameters, 0);
  test::append_f64(absent.parameters, 1);
  DngBuilder dng = flat_dng(0.2, false);
  dng.set(test::opcode_list2, test::opcode_list({absent, unknown}));
  dng.set(test::opcode_list3, test::opcode_list({unknown}));
  write("a.dng", dng);
  write("b.dng", dng);
  const auto warnings = [&](const std::vector<std::string>& words) {
    const auto result = lowlux(words);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    std::string found = result.err;
    for (const char* expected : {"MapPolynomial (OpcodeList2) is not applied: the image has no colour of its number",
                                 "opcode 99 (OpcodeList2) is not applied", "opcode 99 (OpcodeList3) is not applied"}) {
      EXPECT_NE(found.find(expected), std::string::npos) << found;
    }
  };
  warnings({"denoise", file("a.dng"), "-o", file("clean.dng")});
  warnings({"merge", file("a.dng"), file("b.dng"), "-o", file("merged.dng")});
  for (const char* written : {"clean.dng", "merged.dng"}) {
    warnings({"develop", file(written), "-o", file("out.png"), "--force"});
    std::ifstream in(file(written), std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(in), {}};
    const auto stated = test::opcode_list({absent, unknown});
    EXPECT_NE(bytes.find(std::string(reinterpret_cast<const char*>(stated.bytes.data()), stated.bytes.size())),
              std::string::npos);
    // DNGVersion and DNGBackwardVersion: an opcode of DNG 1.6 must not be skipped.
    for (const char tag : {'\x12', '\x13'}) {
      EXPECT_NE(bytes.find(std::string{tag, '\xC6', 1, 0, 4, 0, 0, 0, 1, 6, 0, 0}), std::string::npos);
    }
  }
}

}  // namespace
}  // namespace lowlux
