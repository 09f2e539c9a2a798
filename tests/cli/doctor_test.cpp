#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <string>

#include <nlohmann/json.hpp>

#include "tests/cli/command.h"
#include "tests/support/scratch_directory.h"

namespace lowlux {
namespace {

using test::holds;
using test::lowlux;
using Json = nlohmann::json;

std::map<std::string, Json> parts_of(const std::string& text) {
  std::map<std::string, Json> parts;
  const Json json = Json::parse(text);
  for (const Json& part : json["parts"]) parts[part["name"]] = part;
  return parts;
}

TEST(Doctor, StatesEveryPartOnceInTextAndJson) {
  const auto text = lowlux({"doctor"}), json = lowlux({"doctor", "--json"});
  EXPECT_EQ(text.exit_code, 0) << text.out;
  EXPECT_EQ(json.exit_code, 0);
  const auto parts = parts_of(json.out);
  for (const char* name : {"decoder", "JPEG XL", "kernels", "machine", "charts", "libcamera", "peers of bench",
                           "cameras", "profiles", "cost table", "defaults", "bench images"}) {
    ASSERT_TRUE(parts.contains(name)) << name;
    EXPECT_TRUE(holds(text.out, std::string("\n  ") + name)) << text.out;
    const Json& part = parts.at(name);
    EXPECT_EQ(part["state"] == "works", part["remedy"].is_null()) << part;
    EXPECT_EQ(part["state"] == "works", part["found"].is_string()) << part;
  }
  EXPECT_EQ(parts.at("decoder")["state"], "works");
  EXPECT_TRUE(holds(lowlux({"--version"}).out, parts.at("decoder")["found"].get<std::string>()));
  EXPECT_EQ(lowlux({"doctor", "--xml"}).exit_code, 2);
}

// The command alone in a folder, without the decoder, modules and images that are next to it. It is statically or
// dynamically linked with libraries that its run path still finds.
TEST(Doctor, WithoutTheDecoderItFailsAndStatesTheRemedy) {
  const test::ScratchDirectory scratch;
  const std::filesystem::path alone = scratch.file("lowlux"),
                              build = std::filesystem::path(test::tested_command()).parent_path();
  std::filesystem::copy_file(test::tested_command(), alone);
  for (const auto& entry : std::filesystem::directory_iterator(build)) {
    const std::string name = entry.path().filename();
    if (name.starts_with("liblowlux.so") || name.starts_with("liblowlux_io.so") ||
        name.starts_with("liblowlux_stage.so")) {
      std::filesystem::copy(entry.path(), scratch.file(name), std::filesystem::copy_options::copy_symlinks);
    }
  }
  const auto doctor = test::run_process({"env", "LD_LIBRARY_PATH=" + scratch.path(), alone, "doctor", "--json"});
  EXPECT_EQ(doctor.exit_code, 1) << doctor.out << doctor.err;
  const auto parts = parts_of(doctor.out);
  EXPECT_EQ(parts.at("decoder")["state"], "broken");
  EXPECT_TRUE(holds(parts.at("decoder")["remedy"].get<std::string>(), "install lowlux again"));
  EXPECT_EQ(parts.at("charts")["state"], "missing");
  EXPECT_TRUE(holds(parts.at("charts")["remedy"].get<std::string>(), "libopencv-contrib-dev"));
  EXPECT_EQ(parts.at("bench images")["state"], "missing");
}

TEST(Doctor, WithoutACostTableItNamesTheCommandThatMeasures) {
  const test::ScratchDirectory scratch;
  const auto doctor =
      test::run_process({"env", "XDG_CACHE_HOME=" + scratch.path(), test::tested_command(), "doctor", "--json"});
  const Json cost = parts_of(doctor.out).at("cost table");
  EXPECT_EQ(cost["state"], "missing");
  EXPECT_TRUE(holds(cost["remedy"].get<std::string>(), "lowlux bench --calibrate-cost")) << cost;
}

}  // namespace
}  // namespace lowlux
