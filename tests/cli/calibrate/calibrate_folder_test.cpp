#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/cli/command.h"
#include "tests/cli/simulate/simulate_command.h"

namespace lowlux {
namespace {

using test::lowlux;

using Json = nlohmann::json;
using Words = std::vector<std::string>;

/// Frames in folders, as the examples of `calibrate --help` name them.
class CalibrateFolder : public test::SimulateCommand {
 protected:
  void shoot(const std::string& scene, const std::string& name, const Words& more) {
    std::filesystem::create_directories(std::filesystem::path(file(name)).parent_path());
    Words words{"--no-truth", "--effects", "all", "--dark-current", "20", "--full-well", "20000", "--iso", "100"};
    words.insert(words.end(), more.begin(), more.end());
    simulated(scene, name, words);
  }
  Json profile_of(const Words& inputs) {
    Words words{"calibrate"};
    words.insert(words.end(), inputs.begin(), inputs.end());
    words.insert(words.end(), {"-o", file("p.json"), "--force", "--json"});
    const auto result = lowlux(words);
    EXPECT_EQ(result.exit_code, 0) << testing::PrintToString(words) << result.err;
    return Json::parse(result.out, nullptr, false)["profile"];
  }
};

TEST_F(CalibrateFolder, AFolderOfDarksIsWhatItsFilesAre) {
  shoot("dark", "darks/short.dng", {"--exposure", "0.1", "--frames", "2"});
  shoot("dark", "darks/long.dng", {"--exposure", "4", "--frames", "2", "--seed", "2"});
  const Words files{file("darks/long_0000.dng"), file("darks/long_0001.dng"), file("darks/short_0000.dng"),
                    file("darks/short_0001.dng")};
  const Json by_folder = profile_of({"black", file("darks/")});
  EXPECT_EQ(by_folder, profile_of({"black", files[0], files[1], files[2], files[3]}));
  EXPECT_EQ(by_folder, profile_of({"black", file("darks/*.dng")}));
}

TEST_F(CalibrateFolder, AFolderOfFlatsIsWhatItsFilesAre) {
  Words files;
  for (const char* luminance : {"1", "4", "12", "30"}) {
    const std::string name = std::string("flats/") + luminance;
    shoot("flat", name + ".dng", {"--luminance", luminance, "--frames", "2", "--seed", luminance, "--size", "128x128"});
    files.insert(files.end(), {file(name + "_0000.dng"), file(name + "_0001.dng")});
  }
  shoot("dark", "bias/d.dng", {"--frames", "2", "--seed", "99", "--size", "128x128"});
  std::ranges::sort(files);
  Words words{"noise", "--darks", file("bias/")};
  words.insert(words.end(), files.begin(), files.end());
  EXPECT_EQ(profile_of({"noise", file("flats/"), "--darks", file("bias/")}), profile_of(words));
}

TEST_F(CalibrateFolder, AnEmptyFolderIsOneError) {
  std::filesystem::create_directories(file("empty"));
  for (const char* kind : {"black", "noise"}) {
    const auto result = lowlux({"calibrate", kind, file("empty"), "-o", file("p.json")});
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_EQ(result.err, "lowlux: " + file("empty") + ": the folder contains no raw files\n");
  }
}

}  // namespace
}  // namespace lowlux
