#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "tests/cli/command.h"
#include "tests/cli/simulate/simulate_command.h"

namespace lowlux {
namespace {

using test::lowlux;
using Json = nlohmann::json;
using Words = std::vector<std::string>;

constexpr int width = 96, height = 64;

struct Choice {
  std::string option;
  Words values;  // none: the option is a flag
};

const std::vector<Choice>& choices() {
  static const std::vector<Choice> all{
      {"--bits", {"8", "16", "32"}},
      {"--exposure", {"auto", "auto-1", "auto+2", "-3", "0", "5"}},
      {"--wb", {"as-shot", "auto", "daylight", "3200,-20", "1.5,1,2", "pick:8,56,6"}},
      {"--space", {"srgb", "p3", "rec2020", "linear-srgb", "linear-rec2020", "xyz", "camera"}},
      {"--half", {}},
      {"--denoise", {"auto", "off", "draft", "standard", "high", "best"}},
      {"--look", {"camera", "eye", "hunt", "shin", "cao"}},
      {"--tone", {"standard", "none"}},
      {"--demosaic", {"auto", "malvar", "encoded-malvar", "residual", "residual-median"}},
      {"--brightness", {"-0.5", "1"}},
      {"--contrast", {"0.6", "1.4"}},
      {"--saturation", {"0", "0.5", "2"}},
      {"--highlights", {"clip", "reconstruct"}},
      {"--local-tone", {"0.3", "1"}},
      {"--sharpen", {"off", "0.5", "1.5"}},
      {"--max-size", {"1", "17", "50", "1000"}},
      {"--camera-profile", {"embedded", "none"}},
      {"--scene-luminance", {"0.001", "1"}},
      {"--field-of-view", {"5", "120"}},
      {"--light", {"HPS_generic", "D65", "0.5"}},
      {"--adaptation-degree", {"auto", "0.5"}},
      {"--dimming", {"0", "1"}},
      {"--noise-limit", {"off", "1"}},
      {"--display-luminance", {"2", "80"}},
      {"--seeing-map", {}},
      {"--effects", {"auto", "all", "none", "purkinje,acuity"}},
      {"--tolerance", {"0.1", "5"}},
      {"--noise", {"0.5,2"}},
      {"--dark-estimate", {"auto", "off"}},
      {"--repair", {"auto", "off"}},
      {"--line-noise", {"auto", "off"}},
      {"--chroma-bias", {"least-error", "none"}},
      {"--maps", {}},
  };
  return all;
}

/// Develops one frame, a burst by hand, a bracket and a burst on a tripod with dark frames, all of one size.
class OptionCombinations : public test::SimulateCommand {
 protected:
  void SetUp() override {
    const Words usual{"--no-truth", "--luminance", "0.5", "--gain", "ISO 1600"};
    const auto made = [&](const std::string& name, int frames, Words more) {
      more.insert(more.end(), usual.begin(), usual.end());
      simulated("chart:macbeth", name + ".dng", more);
      Words files;
      for (int i = 0; i < frames; ++i) files.push_back(file(fmt::format("{}_{:04}.dng", name, i)));
      return files;
    };
    const std::string size = fmt::format("{}x{}", width, height);
    simulated("chart:macbeth", "one.dng", {"--size", size, "--no-truth", "--luminance", "0.5", "--gain", "ISO 1600"});
    inputs_.push_back({file("one.dng")});
    for (auto [name, frames, more] : {std::tuple<std::string, int, Words>{"hand", 3, {"--frames", "3", "--shake", "3"}},
                                      {"bracket", 2, {"--bracket", "0,-2"}},
                                      {"still", 2, {"--frames", "2"}}}) {
      more.insert(more.end(), {"--size", size});
      Words words = made(name, frames, more);
      words.insert(words.end(), {"--merge"});
      inputs_.push_back(std::move(words));
    }
    simulated("dark", "dark.dng", {"--size", size, "--frames", "2", "--gain", "ISO 1600", "--no-truth"});
    inputs_.back().insert(inputs_.back().end(), {"--dark-frame", file("dark_0000.dng") + "," + file("dark_0001.dng")});
  }

  template <class Engine>
  Words drawn(Engine& engine, bool cropped) {
    Words out;
    std::bernoulli_distribution taken(3.0 / static_cast<double>(choices().size()));
    for (const Choice& choice : choices()) {
      if (!taken(engine)) continue;
      out.push_back(choice.option);
      if (!choice.values.empty()) out.push_back(choice.values[engine() % choice.values.size()]);
    }
    if (cropped) {
      const int x = static_cast<int>(engine() % (width / 2 - 1)), y = static_cast<int>(engine() % (height / 2 - 1));
      const int w = 1 + static_cast<int>(engine() % (width / 2 - x)),
                h = 1 + static_cast<int>(engine() % (height / 2 - y));
      out.insert(out.end(), {"--crop", fmt::format("{},{},{},{}", x, y, w, h)});
    }
    return out;
  }

  std::vector<Words> inputs_;
};

// Whether options fit together depends on them alone, not on how many frames there are, and so does the image's size.
// Under sanitizers this finds what reads or writes beyond its memory.
TEST_F(OptionCombinations, FitOneFrameAndMergesAlike) {
  const unsigned seed = std::random_device()();
  std::mt19937 engine(seed);
  const Words formats{"png", "jpg", "tif", "exr", "pfm"};
  int developed = 0, refused = 0;
  for (int i = 0; i < 16; ++i) {
    const Words options = drawn(engine, engine() % 3 == 0);
    const std::string format = formats[engine() % formats.size()];
    const std::string draw = fmt::format("seed {}, draw {}, {}:", seed, i, format) + testing::PrintToString(options);
    std::vector<std::pair<int, int>> sizes;
    std::vector<int> exits;
    for (const Words& inputs : inputs_) {
      const std::string output = file("out." + format);
      Words words{"develop", "-o", output, "--json", "--no-config"};
      words.insert(words.end(), inputs.begin(), inputs.end());
      words.insert(words.end(), options.begin(), options.end());
      const auto result = lowlux(words);
      exits.push_back(result.exit_code);
      EXPECT_EQ(std::filesystem::exists(output), result.exit_code == 0) << draw << result.err;
      if (result.exit_code == 0) {
        const Json report = Json::parse(result.out)[0];
        sizes.emplace_back(report["width"], report["height"]);
        std::filesystem::remove(output);
      } else {
        EXPECT_TRUE(result.exit_code == 1 || result.exit_code == 2) << draw << result.err;
        const auto lines_with = [&](const std::string& part) {
          int lines = 0;
          for (std::size_t at = 0; (at = result.err.find(part, at)) != std::string::npos; ++at) ++lines;
          return lines;
        };
        const int errors = lines_with("\n") - lines_with(": warning: ");
        EXPECT_EQ(errors, 1) << draw << result.err;
      }
      for (const auto& entry : std::filesystem::directory_iterator(scratch_.path())) {
        if (entry.path().extension() != ".dng") std::filesystem::remove(entry.path());
      }
    }
    EXPECT_TRUE(std::ranges::all_of(exits, [&](int code) { return code == exits[0]; }))
        << draw << testing::PrintToString(exits);
    EXPECT_TRUE(std::ranges::all_of(sizes, [&](const auto& size) { return size == sizes[0]; }))
        << draw << testing::PrintToString(sizes);
    ++(exits[0] == 0 ? developed : refused);
  }
  EXPECT_GT(developed, 0) << "seed " << seed;
  EXPECT_GT(refused, 0) << "seed " << seed;
}

}  // namespace
}  // namespace lowlux
