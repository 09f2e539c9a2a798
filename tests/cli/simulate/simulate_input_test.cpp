#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>

#include <fmt/format.h>

#include "isp/codec/exr.h"
#include "isp/codec/pfm.h"
#include "tests/cli/simulate/simulate_command.h"
#include "tests/codec/pictures.h"

namespace lowlux {
namespace {

using test::lowlux;

using Words = std::vector<std::string>;

/// What is wrong with a command line, and what its one line on stderr holds.
struct ArgumentError {
  Words options;
  std::string clue;
};

class SimulateInput : public test::SimulateCommand {
 protected:
  // The exit code, one line that holds `clue` and no final stop, nothing on stdout, no file but those there were.
  void expect_refused(const std::string& scene, const Words& options, int exit_code, const std::string& clue) {
    const Words before = scratch_.names();
    const auto result = simulate(scene, "out.dng", options);
    const std::string said = scene + testing::PrintToString(options) + result.err;
    EXPECT_EQ(result.exit_code, exit_code) << said;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << said;
    EXPECT_FALSE(result.err.ends_with(".\n")) << said;
    EXPECT_NE(result.err.find(clue), std::string::npos) << "no '" << clue << "' in " << said;
    EXPECT_EQ(result.out, "") << said;
    EXPECT_EQ(scratch_.names(), before) << said;
  }
  void expect_usage(const std::vector<ArgumentError>& all, const std::string& scene = "flat") {
    for (const ArgumentError& wrong : all) expect_refused(scene, wrong.options, 2, wrong.clue);
  }

  // A table of spectra as the file NAME.csv.
  std::string table(const std::string& name, const std::string& text) {
    scratch_.write(name + ".csv", text);
    return file(name + ".csv");
  }
  std::string picture(const std::string& name, const std::vector<std::byte>& bytes) {
    test::write_file(file(name), bytes.data(), bytes.size());
    return file(name);
  }
};

SceneLinear grey(float value) {
  SceneLinear picture(32, 24);
  for (auto& plane : picture.plane) std::fill_n(plane.data(), plane.size(), value);
  return picture;
}

std::vector<std::byte> pfm_of(const SceneLinear& picture) {
  return test::encoded([&](std::FILE* file) { return isp::encode_pfm(picture, file); });
}

TEST_F(SimulateInput, CommandLinesWithoutSceneOrOutputAreRefused) {
  for (const Words& args : std::vector<Words>{{"simulate"},
                                              {"simulate", "flat"},
                                              {"simulate", "-o", file("a.dng")},
                                              {"simulate", "flat", "chart", "-o", file("a.dng")}}) {
    const auto result = lowlux(args);
    EXPECT_EQ(result.exit_code, 2) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  }
  EXPECT_TRUE(scratch_.names().empty());
}

TEST_F(SimulateInput, ImpossibleSensorsAreRefused) {
  expect_usage({{{"--read-noise", "-1"}, "read noise"},
                {{"--full-well", "0"}, "full well"},
                {{"--full-well", "1e9"}, "full well"},
                {{"--black-level", "5000", "--white-level", "4000"}, "5000 and 4000"},
                {{"--black-level", "-1"}, "black"},
                {{"--white-level", "70000", "--bits", "16"}, "70000"},
                {{"--system-gain", "0"}, "gain"},
                {{"--bits", "0"}, "1 to 16 bits"},
                {{"--bits", "17"}, "1 to 16 bits"},
                {{"--bits", "4.5"}, "--bits"},
                {{"--dark-current", "-1"}, "dark current of red"},
                {{"--dark-current", "1,2,-3"}, "dark current of blue"},
                {{"--dark-current", "1,2"}, "neither one number nor three"},
                {{"--dark-current", "1", "--dark-doubling", "0"}, "double"},
                {{"--dark-current", "1", "--dark-activation", "3"}, "0.01 and 2 eV, found 3"},
                {{"--dark-current", "1", "--dark-floor", "1.5"}, "1 e-/s, found 1.5"},
                {{"--prnu", "-0.1"}, "photo response"},
                {{"--prnu", "1.1"}, "between 0 and 1, found"},
                {{"--dsnu", "nan"}, "--dsnu"},
                {{"--hot-pixels", "2"}, "hot pixels"},
                {{"--hot-current", "-1"}, "hot pixels"},
                {{"--telegraph-pixels", "2", "--telegraph-noise", "1"}, "between 0 and 1, found 2"},
                {{"--telegraph-noise", "-1"}, "telegraph noise"},
                {{"--crosstalk", "0.25"}, "between 0 and 0.2 of a pixel's light for each neighbour, found 0.25"},
                {{"--crosstalk", "0.01", "--sampling", "published"}, "crosstalk: leave it out of the effects"},
                {{"--lens-blur", "11"}, "between 0 and 10 px, found 11"},
                {{"--lens-blur", "1", "--sampling", "published"}, "lens-blur: leave it out of the effects"},
                {{"--glow", "2e6"}, "between 0 and 1e6 e-/s, found 2e+06"},
                {{"--glow", "1", "--glow-position", "1,3"}, "between -1 and 2 widths and heights, found 3"},
                {{"--glow", "1", "--glow-position", "1"}, "is not two numbers"},
                {{"--glow", "1", "--glow-length", "0"}, "between 0.001 and 10 diagonals, found 0"},
                {{"--row-noise", "-1"}, "row noise"},
                {{"--column-noise", "inf"}, "--column-noise"},
                {{"--pixel-pitch", "-4"}, "pixel pitch"},
                {{"--read-noise", "2e6"}, "between 0 and 1e6 e-"},
                {{"--white-level", "4000.5"}, "whole number"},
                {{"--peak-qe", "1.5"}, "quantum efficiency"},
                {{"--iso", "0"}, "ISO"},
                {{"--iso", "1e-300"}, "ISO"},
                {{"--white-luminance", "0"}, "reaches full well"},
                {{"--quantise", "up"}, "round, floor"}});
}

TEST_F(SimulateInput, OptionsThatWouldDoNothingNameTheOneThatIsMissing) {
  expect_usage({{{"--hot-pixels", "0.001"}, "--hot-pixels does nothing without --hot-current"},
                {{"--hot-current", "100"}, "--hot-current does nothing without --hot-pixels"},
                {{"--telegraph-pixels", "0.1"}, "--telegraph-pixels does nothing without --telegraph-noise"},
                {{"--telegraph-noise", "3"}, "--telegraph-noise does nothing without --telegraph-pixels"},
                {{"--dsnu", "0.1"}, "--dsnu does nothing without --dark-current"},
                {{"--dark-temperature", "5"}, "--dark-temperature does nothing without --dark-current"},
                {{"--dark-doubling", "6"}, "--dark-doubling does nothing without --dark-current"},
                {{"--pixel-pitch", "4"}, "--pixel-pitch does nothing without --peak-qe"},
                {{"--tolerance", "1", "--effects", "all"}, "--tolerance: it is for --effects auto"},
                {{"--effects", "none", "--tolerance", "1"}, "--tolerance: it is for --effects auto"}});
  simulate("flat", "a.dng", {"--tolerance", "1", "--effects", "auto"});
  EXPECT_TRUE(scratch_.holds("a.dng"));
}

TEST_F(SimulateInput, PicturesHaveTheirOwnSizeAndLight) {
  const std::string scene = picture("scene.pfm", pfm_of(grey(0.5F)));
  expect_refused(scene, {"--size", "32x24"}, 2, "own size (--size)");
  expect_refused("dark", {"--light", "A"}, 2, "the scene dark has no light");
  expect_refused(scene, {"--light", "D65"}, 2, "own light (--light)");
  EXPECT_EQ(simulate(scene, "a.dng").exit_code, 0);
}

TEST_F(SimulateInput, ListsOfEffectsThatContradictThemselvesAreRefused) {
  expect_usage({{{"--effects", "auto,-prnu"}, "cannot be combined"},
                {{"--effects", "prnu,auto"}, "cannot be combined"},
                {{"--effects", "photon-noise,dsnu"}, "dsnu multiplies the dark current"},
                {{"--effects", "all,-dark-current,dsnu"}, "dsnu multiplies the dark current"},
                {{"--effects", "dsnu,dark-current,-dark-current"}, "dsnu multiplies the dark current"}});
}

TEST_F(SimulateInput, ImpossibleExposuresAndScenesAreRefused) {
  expect_usage({{{"--exposure", "-1"}, "exposure time"},
                {{"--exposure", "nan"}, "not a finite number"},
                {{"--exposure", "1e7"}, "exposure time"},
                {{"--luminance", "-1"}, "luminance"},
                {{"--luminance", "nan"}, "not a finite number"},
                {{"--luminance", "1e13"}, "luminance"},
                {{"--f-number", "0"}, "f-number"},
                {{"--temperature", "-300"}, "temperature"},
                {{"--size", "0x5"}, "WIDTHxHEIGHT"},
                {{"--size", "64"}, "WIDTHxHEIGHT"},
                {{"--size", "64000x64000"}, "2^28"},
                {{"--size", "64001x22"}, "22 to 64000 pixels"},
                {{"--masked-columns", "3"}, "even"},
                {{"--masked-columns", "-2"}, "even"},
                {{"--stars", "-1"}, "--stars"},
                {{"--stars", "5", "--star-luminance", "-1"}, "luminance"},
                {{"--lamp", "1,2,D65"}, "X,Y,LIGHT,LUMINANCE"},
                {{"--lamp", "1,2,D65,-1"}, "X,Y,LIGHT,LUMINANCE"},
                {{"--lamp", "1,2,D65,1e13"}, "1e12"},
                {{"--sampling", "published", "--stars", "3"}, "stars"},
                {{"--effects", "photon-noise", "--luminance", "1e9"}, "clipping"},
                {{"--tolerance", "0"}, "positive"},
                {{"--tolerance", "1,2,3"}, "positive"},
                {{"--seed", "-1"}, "whole number"},
                {{"--seed", "18446744073709551616"}, "whole number"},
                {{"--frames", "0"}, "--frames"}});
}

TEST_F(SimulateInput, UnknownNamesAreRefusedWithTheNearest) {
  expect_usage({{{"--sensor", "ELD_NikonD85O"}, "near it: ELD_NikonD850"},
                {{"--sensor", "qqqqqqqq"}, "there are thesis, "},
                {{"--gain", "12345"}, "ISO 100, ISO 400"},
                {{"--sensor", "thesis", "--gain", "99"}, "but for G=141.67"},
                {{"--light", "D66"}, "near it: D65 (--light)"},
                {{"--light", "qqqqqqqq"}, "--list"},
                {{"--lamp", "3,3,D66,1"}, "near it: D65 (--lamp)"},
                {{"--camera", "Nikon_D851"}, "near it: Nikon_D850"},
                {{"--camera", "qqqqqqqq"}, "--list"},
                {{"--effects", "photon-nois"}, "near it: photon-noise"},
                {{"--effects", "all,-prun"}, "near it: prnu"},
                {{"--effects", ""}, "none of auto"},
                {{"--cfa", "rgbg"}, "rggb, grbg, gbrg, bggr"},
                {{"--sampling", "poisson"}, "physical, published"},
                {{"--exposuer", "1"}, "--exposuer"}});
  expect_usage({{{}, "colorchecker, macbeth, munsell"}}, "chart:macbet");
  expect_refused("flatt", {}, 1, "near it: flat");
  expect_refused("unlike_any.png", {}, 1, "no such file\n");
}

TEST_F(SimulateInput, SensorsWithoutSourcedFiguresSayWhatToGive) {
  expect_refused("flat", {"--sensor", "ZWO_ASI290MM"}, 1, "--read-noise");
  expect_refused("flat", {"--sensor", "ZWO_ASI290MM", "--read-noise", "3"}, 1, "--white-luminance");
  expect_refused("flat", {"--sensor", "RaspberryPi_HQ"}, 1, "give --peak-qe, or --iso");
}

TEST_F(SimulateInput, TablesThatAreNoneAreRefusedByLine) {
  const std::vector<std::pair<std::string, std::string>> tables{
      {"nm,a\n380,1\n370,1\n", "line 3 goes from 380"},
      {"nm,a\n380,1\n380,1\n", "must rise"},
      {"nm,a\n380,dark\n780,1\n", "line 2 holds 'dark'"},
      {"nm,a\n380,nan\n780,1\n", "line 2 holds 'nan'"},
      {"nm,a\n380,1\n780\n", "line 3 has 1 cells"},
      {"nm,a\n380,1\n", "at least two wavelengths"},
      {"nm,a\n", "at least two wavelengths"},
      {"nm\n380\n780\n", "1 columns"},
      {"", "no row of names"},
  };
  for (const auto& [text, clue] : tables) {
    const std::string csv = table("spectra", text);
    expect_refused("chart:" + csv, {}, 1, clue);
    expect_refused("flat", {"--light", csv}, 1, clue);
    expect_refused("flat", {"--lamp", "3,3," + csv + ",1"}, 1, clue);
  }
  const std::string missing = file("absent.csv");
  expect_refused("chart:" + missing, {}, 1, missing);
}

TEST_F(SimulateInput, LightsThatCannotBeAreRefused) {
  const std::string two = table("two", "nm,a,b\n380,1,1\n780,1,1\n");
  const std::string negative = table("negative", "nm,a\n380,-1\n500,3\n780,1\n");
  const std::string dark = table("dark", "nm,a\n380,0\n780,0\n");
  const std::string invisible = table("invisible", "nm,a\n900,1\n1000,1\n");
  const std::string endless = table("endless", "nm,a\n380,1e308\n780,1e308\n");
  for (const Words& options : std::vector<Words>{{"--light", two}, {"--lamp", "3,3," + two + ",1"}}) {
    expect_refused("flat", options, 1, "one spectrum");
  }
  for (const Words& options : std::vector<Words>{{"--light", negative}, {"--lamp", "3,3," + negative + ",1"}}) {
    expect_refused("flat", options, 1, "must not be negative");
  }
  for (const std::string& light : {dark, invisible, endless}) {
    expect_refused("chart", {"--light", light}, 2, "finite number");
    expect_refused("flat", {"--lamp", "3,3," + light + ",1"}, 2, "no luminance");
  }
}

TEST_F(SimulateInput, LightOfAnyNarrowBandGivesRawFilesThatCanBeDeveloped) {
  for (int peak_nm = 400; peak_nm <= 700; peak_nm += 20) {
    std::string rows = "wavelength_nm,power\n";
    for (int nm = 380; nm <= 780; nm += 5) {
      rows += fmt::format("{},{:.6g}\n", nm, std::exp(-std::pow((nm - peak_nm) / 8.0, 2)));
    }
    const std::string raw = fmt::format("band{}.dng", peak_nm);
    simulated("chart", raw, {"--light", table("band", rows), "--luminance", "1", "--no-truth", "--quiet"});
    const auto developed = lowlux({"develop", file(raw), "-o", file("band.png"), "--force", "--quiet"});
    EXPECT_EQ(developed.exit_code, 0) << peak_nm << developed.err;
  }
}

TEST_F(SimulateInput, ReflectancesBelowZeroOrAboveTwoAreRefused) {
  expect_refused("chart:" + table("negative", "nm,a\n380,1\n780,-0.1\n"), {}, 2, "never negative");
  expect_refused("chart:" + table("percent", "nm,a,b\n380,0.1,5\n780,2,90\n"), {}, 1, "reflectance of b is 90");
  expect_refused("chart:" + table("above", "nm,a\n380,2.001\n780,1\n"), {}, 1, "is the table in percent?");
  EXPECT_EQ(simulate("chart:" + table("largest", "nm,a\n380,2\n780,2\n"), "a.dng").exit_code, 0);
}

TEST_F(SimulateInput, PicturesThatAreNoLightAreRefused) {
  SceneLinear nan = grey(0.5F), negative = grey(0.5F), infinite = grey(0.5F);
  nan.plane[1].at(3, 2) = std::numeric_limits<float>::quiet_NaN();
  std::fill_n(negative.plane[0].data(), negative.plane[0].size(), -0.5F);
  infinite.plane[2].at(1, 1) = std::numeric_limits<float>::infinity();
  for (const auto& [scene, clue] : {std::pair{&nan, "green of the pixel at column 3, row 2"},
                                    {&negative, "33.3 % of its light"},
                                    {&infinite, "blue of the pixel at column 1, row 1"}}) {
    expect_refused(picture("in.pfm", pfm_of(*scene)), {}, 1, clue);
    const auto exr = test::encoded([&, from = scene](std::FILE* out) { return isp::encode_exr(*from, {}, {}, out); });
    if (scene != &infinite) expect_refused(picture("in.exr", exr), {}, 1, clue);  // half floats hold 65504 instead
  }
  const std::string text = "no picture";
  expect_refused(picture("in.png", {reinterpret_cast<const std::byte*>(text.data()),
                                    reinterpret_cast<const std::byte*>(text.data()) + text.size()}),
                 {}, 1, "PNG, JPEG, TIFF, OpenEXR, PFM or PPM");
  expect_refused(picture("bright.pfm", pfm_of(grey(1e10F))), {"--luminance", "1e6"}, 2, "1e12 cd/m2");
}

TEST_F(SimulateInput, FilesThatCannotBeWrittenAreRefusedBeforeAnyIs) {
  std::filesystem::create_directory(file("folder.exr"));
  expect_usage({{{"--truth", file("t.png")}, "PNG"},
                {{"--truth", file("t.jpg")}, "JPEG"},
                {{"--truth", file("t")}, ".exr"},
                {{"--truth-electrons", file("t.png")}, "PNG"},
                {{"--truth", file("t.exr"), "--no-truth"}, "--no-truth"},
                {{"--truth", file("t.exr"), "--truth-electrons", file("t.exr")}, "t.exr"},
                {{"--truth-electrons",
                  file("../" + std::filesystem::path(scratch_.path()).filename().string() + "/out.truth.exr")},
                 "out.truth.exr"}});
  expect_refused("flat", {"--truth", file("absent/t.exr")}, 1, "no directory");
  expect_refused("flat", {"--truth-electrons", file("absent/t.exr")}, 1, "no directory");
  expect_refused("flat", {"--truth", file("folder.exr"), "--force"}, 1, "is a directory");
  for (const char* name : {"absent/a.dng", "a.tif", "a.dng.tif", "a"}) {
    const auto result = simulate("flat", name);
    EXPECT_EQ(result.exit_code, std::string(name).starts_with("absent") ? 1 : 2) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  }
  EXPECT_EQ(scratch_.names(), Words{"folder.exr"});
}

TEST_F(SimulateInput, TheExtensionMayBeInCapitals) {
  simulated("flat", "A.DNG");
  simulated("flat", "B.DNG", {"--frames", "2", "--no-truth"});
  EXPECT_EQ(scratch_.names(), (Words{"A.DNG", "A.truth.exr", "B_0000.DNG", "B_0001.DNG"}));
}

TEST_F(SimulateInput, ATruthNeverReplacesItsScene) {
  const std::string scene = picture("scene.pfm", pfm_of(grey(0.5F)));
  const std::string before = test::read_file(scene);
  expect_refused(scene, {"--truth", scene, "--force"}, 1, "would replace the scene");
  EXPECT_EQ(test::read_file(scene), before);
}

}  // namespace
}  // namespace lowlux
