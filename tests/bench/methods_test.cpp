#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "isp/bench/methods/method_frame.h"
#include "isp/bench/methods/method_scenes.h"
#include "isp/bench/methods/method_score.h"
#include "isp/bench/stages/methods_bench.h"
#include "tests/support/scratch_directory.h"

namespace lowlux::isp::methods_test {
namespace {

constexpr std::uint64_t first_seed = 20261125;
constexpr SceneSize small{96, 64};

SceneLinear copy_of(const SceneLinear& image) {
  SceneLinear out;
  for (std::size_t c = 0; c < 3; ++c) out.plane[c] = image.plane[c].clone();
  return out;
}

bool same(const SceneLinear& a, const SceneLinear& b) {
  return std::ranges::all_of(std::array{0, 1, 2}, [&](std::size_t c) {
    return std::equal(a.plane[c].data(), a.plane[c].data() + a.plane[c].size(), b.plane[c].data());
  });
}

std::string error_of(const std::string& text) {
  const auto method = method_of(text);
  return method ? "" : method.error().message;
}

TEST(Methods, CommandsNameTheirFiles) {
  const auto dng = expand_command("p {in} -o {out}", "/tmp/a b");
  ASSERT_TRUE(dng);
  EXPECT_EQ(dng->line, "p '/tmp/a b/noisy.dng' -o '/tmp/a b/clean.dng'");
  EXPECT_EQ(dng->output, "/tmp/a b/clean.dng");
  const auto ppm = expand_command("p {in} > {out.ppm} && check {out.ppm}", "/x");
  ASSERT_TRUE(ppm);
  EXPECT_EQ(ppm->line, "p /x/noisy.dng > /x/clean.ppm && check /x/clean.ppm");
  for (const ReadyMethod& ready : ready_methods()) EXPECT_TRUE(expand_command(std::string(ready.command), "/x"));
}

TEST(Methods, WrongCommandsAreRefusedWithAReason) {
  const std::map<std::string, std::string> reasons{{"a=p {out}", "does not contain {in}"},
                                                   {"a=p {in}", "does not contain {out}"},
                                                   {"a=p {in} {out.gif}", "does not contain {out}"},
                                                   {"a=p {in} {out} {out.png}", "two kinds"},
                                                   {"=p {in} {out}", "not a name"},
                                                   {"a b=p {in} {out}", "not a name"},
                                                   {"../x=p {in} {out}", "not a name"},
                                                   {"dcrow", "did you mean dcraw?"},
                                                   {"", "known methods are dcraw"}};
  for (const auto& [text, reason] : reasons) {
    EXPECT_NE(error_of(text).find(reason), std::string::npos) << text << ": " << error_of(text);
  }
}

TEST(Methods, ScenesArePureFunctionsOfTheSeed) {
  for (const bool stars : {false, true}) {
    const auto make = [stars](std::uint64_t seed) {
      return stars ? stars_scene(small, seed) : leaves_scene(small, seed);
    };
    const MethodScene a = make(1), again = make(1), other = make(2);
    EXPECT_TRUE(same(a.picture.linear, again.picture.linear));
    EXPECT_FALSE(same(a.picture.linear, other.picture.linear));
    for (const Plane<float>& plane : a.picture.linear.plane) {
      const auto [least, most] = std::minmax_element(plane.data(), plane.data() + plane.size());
      EXPECT_GE(*least, 0);
      EXPECT_LE(*most, 1);
      EXPECT_GT(*most, 4 * *least);  // it has contrast
    }
  }
  EXPECT_EQ(stars_scene({600, 400}, 3).stars.size(), 400u);
}

DenoiseShot shot_of(const MethodScene& scene, const DenoiseLight& light, std::uint64_t seed) {
  return take(scene.picture, light, seed);
}

TEST(Methods, TheFrameHasTheNoiseThatItStates) {
  constexpr int rounds = 6;
  std::mt19937_64 random(first_seed);
  for (int round = 0; round < rounds; ++round) {
    std::uniform_real_distribution<double> log_light(0, 3), dark(0, 200), read(0.5, 6);
    const DenoiseLight light{std::pow(10, log_light(random)), dark(random), read(random)};
    const std::uint64_t seed = random();
    SCOPED_TRACE(testing::Message() << "seed " << seed << ", " << name_of(light) << ", read noise "
                                    << light.read_noise_e);
    MethodScene grey{{"grey", SceneLinear(128, 128)}, {}};
    for (Plane<float>& plane : grey.picture.linear.plane) std::fill_n(plane.data(), plane.size(), 0.5F);
    const DenoiseShot shot = shot_of(grey, light, seed);
    const RawFrame frame = noisy_frame(shot);
    const double black = frame.raw.black_tag->pattern_dn[0], range = frame.raw.white_dn[1] - black;
    std::map<std::size_t, std::pair<double, double>> sums;  // of the differences to the stated mean, and their squares
    std::map<std::size_t, int> count;
    for (int y = 0; y < 128; ++y) {
      for (int x = 0; x < 128; ++x) {
        const auto c = static_cast<std::size_t>(colour_at(BayerPhase::rggb, x, y));
        const double expected = 0.5 / bench_white_gain[c] * shot.white_e * gain_dn_per_e(shot) / range;
        const double x01 = (frame.raw.dn.at(x, y) - black) / range;
        sums[c].first += x01 - expected;
        sums[c].second += std::pow(x01 - expected, 2);
        ++count[c];
        EXPECT_GT(frame.raw.dn.at(x, y), 0);
        EXPECT_LT(frame.raw.dn.at(x, y), 65535);
      }
    }
    for (std::size_t c = 0; c < 3; ++c) {
      const double mean = 0.5 / bench_white_gain[c] * shot.white_e * gain_dn_per_e(shot) / range;
      const double variance = frame.noise->scale[c] * mean + frame.noise->offset[c] + 1 / (12 * range * range);
      EXPECT_NEAR(sums[c].first / count[c], 0, 5 * std::sqrt(variance / count[c]));
      // Var of a sampled variance: (kurtosis - 1) / n; of Poisson and normal noise 2 + 1 / mean at most.
      const double kurtosis_term = 2 + 1 / (0.5 / bench_white_gain[c] * shot.white_e + light.dark_e);
      EXPECT_NEAR(sums[c].second / count[c], variance, 5 * variance * std::sqrt(kurtosis_term / count[c]));
    }
  }
}

TEST(Methods, ARawOutputIsRenderedAsTheMosaicItHolds) {
  InlineExecutor executor;
  const MethodScene scene = leaves_scene(small, 4);
  const DenoiseShot shot = shot_of(scene, {20, 2, 1.5}, 5);
  BenchRenderer renderer(small.width, executor);
  const auto got = rendered(noisy_frame(shot), shot, scene.picture.linear, renderer);
  ASSERT_TRUE(got) << got.error().message;
  Plane<float> signed_e = shot.raw_e.clone();
  for (std::size_t i = 0; i < signed_e.size(); ++i) signed_e.data()[i] -= static_cast<float>(shot.light.dark_e);
  const RenderedPicture expected = renderer.render(signed_e.view(), shot, NoiseLeft::reduced);
  for (std::size_t c = 0; c < 3; ++c) {
    double squares = 0;
    for (std::size_t i = 0; i < got->light.plane[c].size(); ++i) {
      squares += std::pow(got->light.plane[c].data()[i] - expected.light.plane[c].data()[i], 2);
    }
    EXPECT_LT(std::sqrt(squares / static_cast<double>(signed_e.size())), 1e-3);  // codes of 1/64 e- of 20 e-
  }
}

TEST(Methods, OutputsOfAnotherFormAreRefused) {
  InlineExecutor executor;
  const MethodScene scene = leaves_scene(small, 4);
  const DenoiseShot shot = shot_of(scene, {20, 2, 1.5}, 5);
  BenchRenderer renderer(small.width, executor);
  const auto message = [&](const MethodImage& image) {
    const auto got = rendered(image, shot, scene.picture.linear, renderer);
    return got ? std::string() : got.error().message;
  };
  RawFrame narrow = noisy_frame(shot), other_phase = noisy_frame(shot);
  narrow.raw.active.width -= 2;
  other_phase.raw.phase = BayerPhase::bggr;
  EXPECT_EQ(message(std::move(narrow)), "its output has 94 x 64 pixels, expected 96 x 64");
  EXPECT_NE(message(std::move(other_phase)).find("expected RGGB"), std::string::npos);
  EXPECT_EQ(message(SceneLinear(64, 96)), "its output has 64 x 96 pixels, expected 96 x 64");
  SceneLinear black(96, 64);
  for (Plane<float>& plane : black.plane) std::fill_n(plane.data(), plane.size(), 0.0F);
  EXPECT_EQ(message(std::move(black)), "its output is black");
}

TEST(Methods, TextureAndStarsKeptAreSlopesThatNoiseDoesNotChange) {
  std::mt19937_64 random(first_seed);
  for (int round = 0; round < 5; ++round) {
    const std::uint64_t seed = random();
    const double kept = std::uniform_real_distribution<double>(0.2, 1)(random);
    SCOPED_TRACE(testing::Message() << "seed " << seed << ", kept " << kept);
    const MethodScene leaves = leaves_scene({256, 192}, seed), sky = stars_scene({256, 192}, seed);
    std::normal_distribution<double> noise(0, 0.02);
    const auto changed = [&](const SceneLinear& truth) {
      SceneLinear out = copy_of(truth);
      for (Plane<float>& plane : out.plane) {
        for (std::size_t i = 0; i < plane.size(); ++i) {
          plane.data()[i] = static_cast<float>(kept * plane.data()[i] + noise(random));
        }
      }
      return out;
    };
    EXPECT_DOUBLE_EQ(texture_kept(leaves.picture.linear, leaves.picture.linear), 1);
    EXPECT_DOUBLE_EQ(stars_kept(sky.picture.linear, sky.picture.linear, sky.stars), 1);
    // Texture: 49152 pixels of deviation about 0.1 under noise of 0.015: a standard error of 7e-4; stars: 81, of light
    // 0.5 and more in sum 40, under noise of 0.02 sqrt(25 + 25^2 / 68) sqrt(81) = 1.1.
    EXPECT_NEAR(texture_kept(changed(leaves.picture.linear), leaves.picture.linear), kept, 5 * 1.5e-3);
    EXPECT_NEAR(stars_kept(changed(sky.picture.linear), sky.picture.linear, sky.stars), kept, 5 * 0.03);
  }
  EXPECT_TRUE(std::isnan(stars_kept(leaves_scene(small, 1).picture.linear, leaves_scene(small, 1).picture.linear, {})));
}

TEST(Methods, ATintIsAChromaBias) {
  InlineExecutor executor;
  const MethodScene scene = leaves_scene(small, 9);
  const PictureTruth truth(scene.picture.linear.view(), executor);
  RenderedPicture picture{copy_of(scene.picture.linear), copy_of(scene.picture.linear)};
  EXPECT_NEAR(score_of(picture, truth, scene, executor).chroma_bias, 0, 1e-9);
  for (std::size_t i = 0; i < picture.display.plane[0].size(); ++i) picture.display.plane[0].data()[i] *= 1.1F;
  EXPECT_GT(score_of(picture, truth, scene, executor).chroma_bias, 1);
}

BenchOptions quick() {
  return {.pictures_folder = LOWLUX_TESTDATA "/pictures",
          .quick = true,
          .threads = 2,
          .advance = [](double, const std::string&) {}};
}

std::map<std::string, double> column(const BenchOutcome& outcome, const std::string& name) {
  const auto& columns = outcome.table.columns;
  const auto at = static_cast<std::size_t>(std::ranges::find(columns, name) - columns.begin());
  std::map<std::string, double> out;
  for (const auto& row : outcome.table.rows) out[std::get<std::string>(row[2])] = std::get<double>(row.at(at));
  return out;
}

TEST(Methods, GoodOnesAreRankedAndFailuresLeaveTheOthersAlone) {
  const test::ScratchDirectory scratch;
  BenchOptions options = quick();
  options.command_limits.max_wall_s = 5;
  const std::string seen = shell_word(scratch.file("seen"));
  options.methods = {
      {.name = "copy", .command = "ls -A \"$TMPDIR\" >> " + seen + "; cp {in} {out}"},
      {.name = "silent", .command = ": {in} {out.png}"},
      {.name = "pipe", .command = ": {in}; mkfifo {out}"},
      {.name = "garbage", .command = "head -c 5000 {in} > {out}"},
      {.name = "as-text", .command = ": {in}; echo hello > {out.tif}"},
      {.name = "hang", .command = "sleep 600; : {in} {out}"},
      {.name = "small", .command = ": {in}; printf 'P6 2 2 255 aaaaaaaaaaaa' > {out.ppm}"},
      {.name = "throws", .call = [](const RawFrame&) { return fail(ErrorCode::malformed, "it raised X: no"); }},
      {.name = "grey", .call = [](const RawFrame& noisy) -> Result<MethodImage> {
         SceneLinear xyz(noisy.raw.dn.width(), noisy.raw.dn.height());
         for (std::size_t c = 0; c < 3; ++c) std::fill_n(xyz.plane[c].data(), xyz.plane[c].size(), 0.2F);
         return MethodImage(std::move(xyz));
       }}};
  const auto outcome = run_methods_bench(options);
  ASSERT_TRUE(outcome) << outcome.error().message;
  const auto psnr = column(*outcome, "PSNR [dB]"), texture = column(*outcome, "texture kept");
  EXPECT_EQ(psnr.size(), 4u);  // noise-free, noisy, copy, grey
  EXPECT_EQ(psnr.at("copy"), psnr.at("noisy"));
  EXPECT_GT(psnr.at("noise-free"), psnr.at("noisy"));
  EXPECT_NEAR(texture.at("grey"), 0, 1e-6);
  EXPECT_NEAR(texture.at("noise-free"), 1, 0.02);
  std::vector<std::string> failed;
  for (const Error& error : outcome->failures) failed.push_back(error.where);
  EXPECT_EQ(failed, (std::vector<std::string>{"method silent", "method pipe", "method garbage", "method as-text",
                                              "method hang", "method small", "method throws"}));
  EXPECT_EQ(scratch.read("seen").substr(0, 22), "noisy.dng\nprinted.txt\n");  // and nothing else
  EXPECT_EQ(scratch.read("seen").size() % 22, 0u);
}

TEST(Methods, AShardHasTheRowsOfItsLights) {
  BenchOptions options = quick();
  options.quick = false;
  options.pictures = PictureSet::tuning;
  options.methods.clear();
  const auto rows_of = [&](const Shard& shard) {
    options.shard = shard;
    auto outcome = run_methods_bench(options);
    EXPECT_TRUE(outcome) << outcome.error().message;
    return outcome ? table_of(outcome->table, 17).rows : std::vector<std::vector<std::string>>();
  };
  auto whole = rows_of({});
  ASSERT_EQ(whole.size(), 2 * methods_lights(false).size());
  const std::string light = name_of(methods_lights(false)[1]);
  std::erase_if(whole, [&](const std::vector<std::string>& row) { return row.front() != light; });
  EXPECT_EQ(whole.size(), 2U);
  EXPECT_EQ(rows_of({2, 3}), whole);
  options.shard = {methods_lights(false).size() + 1, 9};
  const auto none = run_methods_bench(options);
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().where, "--shard");
}

TEST(Methods, ASeedRepeatsARunAndAnotherDoesNot) {
  const auto psnr = [](std::uint64_t seed) {
    BenchOptions options = quick();
    options.seed = seed;
    const auto outcome = run_methods_bench(options);
    EXPECT_TRUE(outcome);
    return outcome ? column(*outcome, "PSNR [dB]") : std::map<std::string, double>();
  };
  const auto first = psnr(1);
  EXPECT_EQ(first, psnr(1));
  EXPECT_NE(first, psnr(2));
}

}  // namespace
}  // namespace lowlux::isp::methods_test
