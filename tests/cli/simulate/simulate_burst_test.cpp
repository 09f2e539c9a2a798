#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "capture/file/dng_source.h"
#include "isp/codec/pfm.h"
#include "tests/cli/command.h"
#include "tests/cli/simulate/simulate_command.h"
#include "tests/codec/pictures.h"

namespace lowlux {
namespace {

using test::holds;

using Json = nlohmann::json;
using Words = std::vector<std::string>;

class SimulateBurst : public test::SimulateCommand {
 protected:
  RawFrame raw(const std::string& name) {
    auto frame = capture::read_raw(file(name));
    if (!frame) throw std::runtime_error(frame.error().message);
    return *std::move(frame);
  }
  Json truth(const std::string& name) { return Json::parse(scratch_.read(name)); }
  // The mean position of a light in a file, its sites made equal by what R, G and B collect of all of it.
  std::array<double, 2> centroid(const std::string& name, const Json& signal_e) {
    const RawDn dn = raw(name).raw;
    const double black = dn.black_tag->at(0, 0, 0);
    double sum = 0, x = 0, y = 0;
    for (int row = 0; row < dn.dn.height(); ++row) {
      for (int column = 0; column < dn.dn.width(); ++column) {
        const double of_all = signal_e[static_cast<std::size_t>(colour_at(dn.phase, column, row))];
        const double value = (dn.dn.at(column, row) - black) / of_all;
        sum += value, x += value * column, y += value * row;
      }
    }
    return {x / sum, y / sum};
  }
  void expect_refused(const std::string& scene, const Words& options, int exit_code, const std::string& clue) {
    const Words before = scratch_.names();
    const auto result = simulate(scene, "out.dng", options);
    const std::string context = testing::PrintToString(options) + result.err;
    EXPECT_EQ(result.exit_code, exit_code) << context;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << context;
    EXPECT_TRUE(holds(result.err, clue)) << "no '" << clue << "' in " << context;
    EXPECT_EQ(scratch_.names(), before) << context;
  }
};

// R (p - centre) + centre + d, R turning clockwise, as the JSON states it.
std::array<double, 2> moved(const Json& motion, double x, double y) {
  const double angle = motion["rotation_deg"].get<double>() * std::acos(-1.0) / 180;
  const double cx = motion["centre_px"][0], cy = motion["centre_px"][1];
  return {cx + std::cos(angle) * (x - cx) - std::sin(angle) * (y - cy) + motion["dx_px"].get<double>(),
          cy + std::sin(angle) * (x - cx) + std::cos(angle) * (y - cy) + motion["dy_px"].get<double>()};
}

TEST_F(SimulateBurst, FramesAndTheirTruthAreWritten) {
  const auto run = simulated("chart", "night.dng",
                             {"--frames", "3", "--shake", "6", "--roll", "1.5", "--movers", "2", "--mover-size", "12",
                              "--truth-electrons", file("night.e.pfm"), "--json"});
  const Words names{"night.e.pfm",    "night.truth.exr", "night.truth.json",
                    "night_0000.dng", "night_0001.dng",  "night_0002.dng"};
  EXPECT_EQ(scratch_.names(), names);
  EXPECT_EQ(Json::parse(run.out)["files"].size(), names.size());
  const Json json = truth("night.truth.json");
  EXPECT_EQ(json["width"], 64);
  EXPECT_EQ(json["height"], 48);
  EXPECT_EQ(json["reduction"], 2);
  EXPECT_TRUE(json["horizon_px"].is_null());
  ASSERT_EQ(json["frames"].size(), 3U);
  for (int i = 0; i < 3; ++i) {
    const Json& frame = json["frames"][i];
    EXPECT_EQ(frame["file"], "night_000" + std::to_string(i) + ".dng");
    EXPECT_EQ(frame["motion"], frame["camera_motion"]);
    EXPECT_EQ(frame["movers"].size(), 2U);
    const double dx = frame["motion"]["dx_px"], dy = frame["motion"]["dy_px"], roll = frame["motion"]["rotation_deg"];
    EXPECT_LE(std::hypot(dx, dy), 6 + 1e-9);
    EXPECT_LE(std::fabs(roll), 1.5 + 1e-9);
    EXPECT_EQ(i == 0, dx == 0 && dy == 0 && roll == 0);
    EXPECT_EQ(raw(frame["file"]).raw.dn.width(), 64);
  }
}

// A lamp on a dark scene, without noise, is found where the JSON says that its pixel went.
TEST_F(SimulateBurst, ALampIsWhereTheTruthStates) {
  simulated("dark", "lamp.dng",
            {"--size", "96x80", "--lamp", "52.25,37.5,D65,100", "--frames", "4", "--shake", "10", "--roll", "8",
             "--field-rotation", "3", "--field-centre", "30,20", "--drift", "1.25,-0.5", "--effects", "none"});
  const Json json = truth("lamp.truth.json");
  ASSERT_EQ(json["points_of_frame_0"].size(), 1U);
  const Json& point = json["points_of_frame_0"][0];
  EXPECT_NEAR(point["x_px"], 52.25, 1e-12);
  EXPECT_NEAR(point["y_px"], 37.5, 1e-12);
  EXPECT_EQ(point["spread_px"], 0.7);
  for (const Json& frame : json["frames"]) {
    const auto expected = moved(frame["motion"], 52.25, 37.5), found = centroid(frame["file"], point["signal_e"]);
    // Rounding of some hundred codes of thousands, and the aliasing of a star of 0.7 px.
    EXPECT_NEAR(found[0], expected[0], 2e-3) << frame;
    EXPECT_NEAR(found[1], expected[1], 2e-3) << frame;
  }
}

TEST_F(SimulateBurst, ABracketOfFilesStatesItsExposures) {
  simulated("flat", "b.dng", {"--exposure", "0.25", "--bracket", "-2,0,1.5", "--effects", "none"});
  const Json json = truth("b.truth.json");
  ASSERT_EQ(json["frames"].size(), 3U);
  EXPECT_TRUE(json["reduction"].is_null());
  const auto level = [&](const std::string& name) {
    const RawDn dn = raw(name).raw;
    return dn.dn.at(1, 0) - dn.black_tag->at(1, 0, 0);
  };
  const double unit = level("b_0001.dng");
  for (int i = 0; i < 3; ++i) {
    const double factor = std::exp2(std::array{-2.0, 0.0, 1.5}[static_cast<std::size_t>(i)]);
    const std::string name = "b_000" + std::to_string(i) + ".dng";
    EXPECT_DOUBLE_EQ(json["frames"][i]["exposure_s"], 0.25 * factor);
    EXPECT_NEAR(*raw(name).raw.info.exposure_s, 0.25 * factor, 1e-6) << "a rational of the file";
    EXPECT_NEAR(level(name), unit * factor, 1) << "rounding to codes";
  }
  simulated("flat", "six.dng", {"--bracket", "0,1", "--frames", "6", "--no-truth"});
  EXPECT_TRUE(scratch_.holds("six_0005.dng"));
  EXPECT_FALSE(scratch_.holds("six.truth.json"));
}

// Nothing moves and the exposure is the same: the codes are those of the single scene, whatever the frame's number.
TEST_F(SimulateBurst, ABracketOfNothingIsTheSceneItself) {
  const Words noisy{"--effects", "all", "--frames", "2", "--seed", "3", "--stars", "20"};
  Words bracket = noisy;
  bracket.insert(bracket.end(), {"--bracket", "0"});
  simulated("chart", "a.dng", noisy);
  simulated("chart", "b.dng", bracket);
  for (const char* index : {"_0000.dng", "_0001.dng"}) {
    const RawDn a = raw(std::string("a") + index).raw, b = raw(std::string("b") + index).raw;
    EXPECT_TRUE(std::equal(a.dn.data(), a.dn.data() + a.dn.size(), b.dn.data()));
  }
  EXPECT_EQ(scratch_.read("a.truth.exr"), scratch_.read("b.truth.exr"));
}

TEST_F(SimulateBurst, APictureIsReducedAndItsTruthIsThatOfFrame0) {
  SceneLinear scene = test::noisy_linear(120, 90);
  for (auto& plane : scene.plane) {
    for (std::size_t i = 0; i < plane.size(); ++i) plane.data()[i] = std::fabs(plane.data()[i]);
  }
  const auto pfm = test::encoded([&](std::FILE* out) { return isp::encode_pfm(scene, out); });
  test::write_file(file("scene.pfm"), pfm.data(), pfm.size());
  simulated(file("scene.pfm"), "p.dng", {"--frames", "2", "--shake", "4", "--quiet", "--truth", file("t.pfm")});
  EXPECT_EQ(raw("p_0001.dng").raw.dn.width(), 60);
  const std::string bytes = scratch_.read("t.pfm");
  const auto decoded = isp::decode_pfm(std::as_bytes(std::span(bytes)));
  ASSERT_TRUE(decoded);
  const auto& found = std::get<SceneLinear>(decoded->picture);
  ASSERT_EQ(found.width(), 60);
  // Reduction keeps the mean: borders are mirrored.
  for (int c = 0; c < 3; ++c) {
    double before = 0, after = 0;
    for (std::size_t i = 0; i < scene.plane[c].size(); ++i) before += scene.plane[c].data()[i] / 10800.0;
    for (std::size_t i = 0; i < found.plane[c].size(); ++i) after += found.plane[c].data()[i] / 2700.0;
    EXPECT_NEAR(after, before, 1e-5 * before);
  }
  expect_refused(file("scene.pfm"), {"--frames", "2", "--shake", "4", "--reduce", "6"}, 1, "reduced by 6, has 20 x 15");
}

TEST_F(SimulateBurst, TheSameSeedMakesTheSameBytes) {
  const Words options{"--frames", "3", "--shake", "5",       "--field-rotation", "2",
                      "--movers", "1", "--stars", "30",      "--bracket",        "0,1,2",
                      "--roll",   "1", "--drift", "0.5,0.1", "--horizon",        "30"};
  simulated("chart", "a.dng", options);
  Words again = options, other = options;
  again.insert(again.end(), {"--seed", "1"});
  other.insert(other.end(), {"--seed", "2"});
  simulated("chart", "b.dng", again);
  simulated("chart", "c.dng", other);
  for (const char* index : {"_0000.dng", "_0001.dng", "_0002.dng", ".truth.exr"}) {
    EXPECT_EQ(scratch_.read(std::string("a") + index), scratch_.read(std::string("b") + index)) << index;
  }
  EXPECT_NE(truth("a.truth.json")["frames"][1]["motion"], truth("c.truth.json")["frames"][1]["motion"]);
}

TEST_F(SimulateBurst, NoTruthIsOverwrittenWithoutForce) {
  scratch_.write("n.truth.json", "precious");
  const Words options{"--frames", "2", "--shake", "3"};
  const auto refused = simulate("flat", "n.dng", options);
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_TRUE(holds(refused.err, "n.truth.json") && holds(refused.err, "--force")) << refused.err;
  EXPECT_EQ(scratch_.names(), Words{"n.truth.json"});
  Words forced = options;
  forced.emplace_back("--force");
  simulated("flat", "n.dng", forced);
  EXPECT_EQ(truth("n.truth.json")["frames"].size(), 2U);
}

TEST_F(SimulateBurst, OptionsThatWouldDoNothingOrContradictAreRefused) {
  const std::vector<std::pair<Words, std::string>> wrong{
      {{"--shake", "3"}, "--shake has no effect without --frames"},
      {{"--roll", "3", "--frames", "1"}, "--roll has no effect without --frames"},
      {{"--dither", "3"}, "--dither has no effect without --frames"},
      {{"--drift", "1,0"}, "--drift has no effect without --frames"},
      {{"--field-rotation", "1"}, "--field-rotation has no effect without --frames"},
      {{"--frames", "4", "--field-centre", "1,2"}, "--field-centre has no effect without --field-rotation"},
      {{"--frames", "4", "--horizon", "20", "--shake", "2"}, "--horizon has no effect without"},
      {{"--mover-size", "9"}, "--mover-size has no effect without --movers"},
      {{"--mover-speed", "9"}, "--mover-speed has no effect without --movers"},
      {{"--frames", "4", "--bracket", "0,1,2"}, "4 is not a multiple of the 3 exposures"},
      {{"--frames", "2", "--shake", "2", "--sampling", "published"}, "published"}};
  for (const auto& [options, clue] : wrong) expect_refused("chart", options, 2, clue);
  expect_refused("dark", {"--movers", "2", "--stars", "4"}, 2, "has no effect on the scene dark");
}

TEST_F(SimulateBurst, ValuesOutsideTheirRangesAreRefused) {
  const std::vector<std::pair<Words, std::string>> wrong{
      {{"--shake", "-1"}, "hand shake"},
      {{"--shake", "nan"}, "--shake"},
      {{"--shake", "1e9"}, "hand shake"},
      {{"--roll", "-2"}, "roll"},
      {{"--roll", "181"}, "roll"},
      {{"--dither", "-0.5"}, "dithering"},
      {{"--field-rotation", "200"}, "field rotation"},
      {{"--drift", "5"}, "X,Y"},
      {{"--drift", "nan,1"}, "X,Y"},
      {{"--drift", "1,2,3"}, "X,Y"},
      {{"--drift", "1e5,0"}, "drift"},
      {{"--field-rotation", "1", "--field-centre", "1"}, "X,Y"},
      {{"--field-rotation", "1", "--field-centre", "0,1e9"}, "centre"},
      {{"--drift", "1,1", "--horizon", "48"}, "horizon"},
      {{"--drift", "1,1", "--horizon", "0"}, "horizon"},
      {{"--movers", "-1"}, "moving objects"},
      {{"--movers", "1001"}, "moving objects"},
      {{"--movers", "1", "--mover-size", "49"}, "size"},
      {{"--movers", "1", "--mover-size", "0"}, "size"},
      {{"--movers", "1", "--mover-speed", "-1"}, "speed"},
      {{"--bracket", "0,x"}, "EV,EV"},
      {{"--bracket", ""}, "EV,EV"},
      {{"--bracket", "0,30"}, "EV"},
      {{"--bracket", "0,24"}, "exposure time"},
      {{"--reduce", "0"}, "--reduce"},
      {{"--reduce", "9"}, "--reduce"},
      {{"--reduce", "2.5"}, "--reduce"},
      {{"--reduce", "2000000000"}, "--reduce"}};
  for (const auto& [options, clue] : wrong) {
    Words with_frames = options;
    with_frames.insert(with_frames.end(), {"--frames", "2"});
    expect_refused("chart", with_frames, 2, clue);
  }
  expect_refused("chart", {"--size", "16384x16384", "--reduce", "8"}, 2, "2^28");
}

// An address space of 600 MB holds the program (not one with sanitizers) and no scene of 12000 x 12000 samples.
TEST_F(SimulateBurst, WithoutMemoryItSaysSoInOneLine) {
  const auto confined = [](const std::string& words) {
    return test::run_process({"sh", "-c", "ulimit -v 600000; exec " + test::tested_command() + " " + words});
  };
  if (confined("--version").exit_code != 0) GTEST_SKIP() << "a program with sanitizers needs terabytes of addresses";
  const auto result = confined("simulate chart --size 6000x6000 --frames 2 --shake 3 -o " + file("a.dng"));
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.err, "lowlux: not enough memory\n");
  EXPECT_TRUE(scratch_.names().empty());
}

}  // namespace
}  // namespace lowlux
