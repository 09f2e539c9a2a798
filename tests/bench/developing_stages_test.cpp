#include "isp/bench/stages/developing_stages.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numeric>
#include <set>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "isp/base/executor.h"
#include "isp/bench/accuracy_time.h"
#include "isp/bench/scenes/develop_scene.h"
#include "isp/model/vision/scene_light.h"
#include "isp/pipeline/develop.h"

namespace lowlux::isp {
namespace {

BenchOptions quick() {
  return {.pictures_folder = LOWLUX_TESTDATA "/pictures",
          .quick = true,
          .threads = 2,
          .advance = [](double, const std::string&) {}};
}

/// Rows of an accuracy table by case and level.
using Rows = std::map<std::pair<std::string, std::string>, std::map<std::string, double>>;

Rows rows_of(const BenchTable& table) {
  Rows out;
  for (const auto& cells : table.rows) {
    EXPECT_EQ(cells.size(), table.columns.size());
    auto& row = out[{std::get<std::string>(cells[0]), std::get<std::string>(cells[1])}];
    for (std::size_t c = 2; c < cells.size(); ++c) {
      if (const double* figure = std::get_if<double>(&cells[c])) row[table.columns[c]] = *figure;
    }
    EXPECT_TRUE(std::isfinite(row["error"]) && row["error"] >= 0) << std::get<std::string>(cells[1]);
    EXPECT_GT(row["time [ms/MP]"], 0) << std::get<std::string>(cells[1]);
    EXPECT_GT(row["x memcpy"], 0);
    EXPECT_GE(row["largest error"], row["error"]) << std::get<std::string>(cells[1]);
  }
  EXPECT_EQ(out.size(), table.rows.size()) << "two rows have one name";
  return out;
}

double error_of(const Rows& rows, const std::string& group, const std::string& level) {
  return rows.at({group, level}).at("error");
}

TEST(DevelopingStages, DemosaicingFallsBehindTheTruthAsItDoesLess) {
  const auto outcome = run_demosaic_bench(quick());
  ASSERT_TRUE(outcome.has_value());
  const Rows rows = rows_of(outcome->table);
  const auto error = [&](const char* group, const char* method) { return error_of(rows, group, method); };
  EXPECT_LT(error("no noise", "malvar"), error("no noise", "bilinear, double"));
  EXPECT_LT(error("no noise", "bilinear, double"), error("no noise", "half (2x2 means)"));
  for (const char* group : {"no noise", "200 e-, denoised by standard", "20 e-, denoised by standard"}) {
    EXPECT_LT(error(group, "encoded-malvar"), error(group, "malvar")) << group;
    EXPECT_LT(error(group, "residual"), error(group, "encoded-malvar")) << group;
  }
  EXPECT_LT(error("20 e-, denoised by standard", "residual-median"), error("20 e-, denoised by standard", "residual"));
  EXPECT_LT(error("no noise", "residual"), 0.75 * error("no noise", "malvar"));
  // CIEDE2000: float planes of values up to 1
  EXPECT_NEAR(error("no noise", "malvar"), error("no noise", "malvar, double"), 1e-4);
  EXPECT_GT(error("20 e-, noise left in", "malvar"), error("no noise", "malvar"));
  EXPECT_EQ(error("rounding of malvar", "malvar, double"), 0);
  EXPECT_GT(error("rounding of malvar", "malvar"), 0);
  // Nine products of float, values up to 1 / the least gain: some 1e-7 each.
  EXPECT_LT(rows.at({"rounding of malvar", "malvar"}).at("largest error"), 3);
  EXPECT_EQ(outcome->plots.size(), 5u);
}

TEST(DevelopingStages, GeneratedScenesGainByNoiseReductionAndShowTheirMarks) {
  const auto outcome = run_scenes_bench(quick());
  ASSERT_TRUE(outcome.has_value());
  const Rows rows = rows_of(outcome->table);
  EXPECT_EQ(rows.size(), 11 * 9u);
  for (const auto& [name, row] : rows) EXPECT_GT(row.at("PSNR [dB]"), 10) << name.first << name.second;
  for (const char* set : {"text, 200 e-", "text, lens, 200 e-", "lamps, 200 e-", "lamps, lens, 200 e-"}) {
    EXPECT_LT(error_of(rows, set, "standard"), error_of(rows, set, "none")) << set;
  }
  EXPECT_EQ(outcome->findings.size(), 11 + 8 * 8u);
  const auto text = std::ranges::find(outcome->findings, "scenes/gain/text, 200 e-", &Finding::id);
  ASSERT_TRUE(text != outcome->findings.end());
  EXPECT_TRUE(text->holds) << text->ours;
  EXPECT_TRUE(outcome->failures.empty());
}

TEST(DevelopingStages, ChromaFromWhereTheSignalSaysIsAsGoodAsTheBetterStart) {
  const auto outcome = run_chroma_start_bench(quick());
  ASSERT_TRUE(outcome.has_value());
  const Rows rows = rows_of(outcome->table);
  for (const char* level : {"draft", "standard", "high"}) {
    for (const char* light : {"20/2", "4/200"}) {
      const auto error = [&](const char* start) { return error_of(rows, light, std::string(level) + ", " + start); };
      // CIEDE2000: starts between levels are blended.
      EXPECT_LE(error("auto"), std::min({error("0"), error("1"), error("2")}) + 0.02) << level << light;
    }
    EXPECT_GT(error_of(rows, "4/200", std::string(level) + ", 0"), error_of(rows, "4/200", std::string(level) + ", 2"));
    EXPECT_LT(error_of(rows, "20/2", std::string(level) + ", 0"), error_of(rows, "20/2", std::string(level) + ", 2"));
  }
  EXPECT_TRUE(rows.contains({"20/2, best, on crops", "best, auto"}));
  EXPECT_FALSE(rows.contains({"20/2, best, on crops", "best, 1"}));
}

TEST(DevelopingStages, TablesOfMesopicVisionAreNoBetterThanWhatTheyAreMadeOf) {
  const auto outcome = run_mesopic_bench(quick());
  ASSERT_TRUE(outcome.has_value());
  const Rows rows = rows_of(outcome->table);
  for (const auto& [name, row] : rows) {
    if (name.second == "exact") {
      EXPECT_EQ(row.at("largest error"), 0) << name.first;
    } else {
      EXPECT_GT(row.at("error"), 0) << name.first << name.second;
    }
  }
  for (const char* white : {"100", "1", "0.01"}) {
    const std::string group = std::string("state of the eye, white ") + white + " cd/m2";
    EXPECT_LT(rows.at({group, "table"}).at("largest error"), 0.05) << white;  // CIEDE2000: not to be seen
    EXPECT_GT(error_of(rows, group, "one for the frame"), 10 * error_of(rows, group, "table")) << white;
  }
}

// The estimates from the exact chromaticity were recomputed from the tables by other means, to 0.1 %.
TEST(DevelopingStages, StatingTheLightGivesRodsTheirLuminanceUnderEveryLamp) {
  const auto outcome = run_scene_light_bench(quick());
  ASSERT_TRUE(outcome.has_value()) << outcome.error().message;
  std::map<std::string, std::vector<double>> rows;
  for (const auto& row : outcome->table.rows) {
    for (std::size_t i = 1; i < row.size(); ++i)
      rows[std::get<std::string>(row[0])].push_back(std::get<double>(row[i]));
  }
  ASSERT_EQ(rows.size(), lamp_names().size());
  EXPECT_NEAR(rows["HPS_generic"][2], 49.8, 0.06);
  EXPECT_NEAR(rows["LPS"][2], 200.0, 0.06);
  EXPECT_NEAR(rows["mercury_generic"][2], 69.1, 0.06);
  for (const auto& [name, row] : rows) {
    EXPECT_LT(row[6], 6) << name << ": percent; what three channels leave of V' on pigments";
  }
}

TEST(DevelopingStages, RetargetingTablesGainByTheirSize) {
  const auto outcome = run_retarget_bench(quick());
  ASSERT_TRUE(outcome.has_value());
  const Rows rows = rows_of(outcome->table);
  EXPECT_EQ(rows.size(), 9u);
  for (const auto& [name, row] : rows) {
    if (name.second != "exact") continue;
    EXPECT_EQ(row.at("largest error"), 0) << name.first;
    EXPECT_LT(error_of(rows, name.first, "table of 33"), error_of(rows, name.first, "table of 17")) << name.first;
    EXPECT_GT(error_of(rows, name.first, "table of 33"), 0) << name.first;
    EXPECT_GT(row.at("time [ms/MP]"), rows.at({name.first, "table of 33"}).at("time [ms/MP]")) << name.first;
  }
}

/// Of the pixels of a picture, those that are not as in the other; not a number if that has another size.
double fraction_of_other_pixels(const Encoded8& a, const Encoded8& b) {
  if (a.width() != b.width() || a.height() != b.height()) return std::nan("");
  int others = 0;
  for (int y = 0; y < a.height(); ++y) {
    for (int x = 0; x < a.width(); ++x) {
      others += !std::equal(a.codes.row(y) + 3 * x, a.codes.row(y) + 3 * x + 3, b.codes.row(y) + 3 * x);
    }
  }
  return others / (1.0 * a.width() * a.height());
}

/// Every picture is in a pair, and the two of a pair differ.
void expect_pairs(const BenchOutcome& outcome, const std::vector<std::string>& expected) {
  std::vector<std::string> pairs;
  std::set<std::string> used;
  for (const BenchComparison& c : outcome.comparisons) {
    pairs.push_back(c.before_id + " " + c.after_id);
    used.insert({c.before_id, c.after_id});
    const auto picture = [&](const std::string& id) { return std::ranges::find(outcome.images, id, &BenchImage::id); };
    ASSERT_TRUE(picture(c.before_id) != outcome.images.end() && picture(c.after_id) != outcome.images.end());
    // Noise is everywhere, and so is what each plan makes of it.
    EXPECT_GT(fraction_of_other_pixels(picture(c.before_id)->codes, picture(c.after_id)->codes), 0.5) << c.title;
  }
  EXPECT_EQ(pairs, expected);
  EXPECT_EQ(used.size(), outcome.images.size()) << "a picture is in no pair";
}

TEST(DevelopingStages, PlansOfDevelopGainByWhatTheyDoAndAreShownInPairs) {
  const auto outcome = run_develop_bench(quick());
  ASSERT_TRUE(outcome.has_value()) << outcome.error().message;
  const Rows rows = rows_of(outcome->table);
  for (const char* group : {"20 e-, camera", "20 e-, eye"}) {
    const auto error = [&](const char* plan) { return error_of(rows, group, plan); };
    EXPECT_LT(error("best"), error("standard")) << group;
    EXPECT_LT(error("standard"), error("draft")) << group;
    EXPECT_LT(error("draft"), 0.5 * error("off")) << group;
    EXPECT_LT(error("standard"), error("standard, no repairs")) << group;
    EXPECT_LT(error("off, half"), error("off")) << group;
    EXPECT_LT(error("standard"), error("standard, malvar")) << group;
    EXPECT_GT(rows.at({group, "best"}).at("one thread [ms/MP]"), 0);
    const auto noise_free = [&](const char* plan) { return error_of(rows, std::string(group) + ", no noise", plan); };
    EXPECT_LT(noise_free("off, no repairs, residual"), 0.75 * noise_free("off, no repairs, malvar")) << group;
    EXPECT_LT(noise_free("off, no repairs, malvar"), noise_free("off, no repairs, half")) << group;
    EXPECT_LT(noise_free("off, no repairs, malvar"), error("standard"))
        << group << ": the noise has a share of its own";
  }
  expect_pairs(*outcome,
               {"develop-plain develop-standard", "develop-draft develop-best", "develop-standard develop-eye"});
  EXPECT_TRUE(outcome->findings.empty());  // parts of pictures are too small to tell of times
}

TEST(DevelopingStages, NoiseIsMostOfTheErrorAtLittleLight) {
  const auto outcome = run_error_sources_bench(quick());
  ASSERT_TRUE(outcome.has_value()) << outcome.error().message;
  const BenchTable& table = outcome->table;
  ASSERT_EQ(table.rows.size(), 4u);
  std::map<std::string, double> squared;  // of the error [codes^2]
  for (const auto& row : table.rows) {
    ASSERT_EQ(row.size(), table.columns.size());
    const std::string name = std::get<std::string>(row[0]) + ", " + std::get<std::string>(row[1]);
    const auto figure = [&](std::size_t column) { return std::get<double>(row[column]); };
    const double demosaicing = figure(3), noise = figure(4), black = figure(5), rendering = figure(6);
    squared[name] = figure(2);
    EXPECT_NEAR(demosaicing + noise + black + rendering, 100, 1e-9) << name;
    EXPECT_GT(demosaicing, 0) << name;
    EXPECT_LT(demosaicing, 5) << name;
    EXPECT_GT(noise, 90) << name;
    EXPECT_LT(noise, 100) << name;
    EXPECT_NEAR(black, 0, 3) << name
                             << ": the measured level of a site is uncertain by 0.07 e-, and either sign is possible";
    // Errors of rounding are uniform: their variance is 1/12.
    EXPECT_NEAR(rendering / 100 * squared[name], 1.0 / 12, 0.01) << name;
  }
  EXPECT_LT(squared.at("20 e-, camera, best"), squared.at("20 e-, camera, default"));
  EXPECT_LT(squared.at("20 e-, eye, best"), squared.at("20 e-, eye, default"));
}

TEST(ErrorSources, NoiseIsZeroWithoutNoiseAndBlackIsNotWhereItsLevelIsWrong) {
  InlineExecutor one;
  const auto picture = read_bench_picture(LOWLUX_TESTDATA "/pictures/kodim23.png", 192, 128, one);
  ASSERT_TRUE(picture.has_value());
  DevelopLight light = develop_lights(true).front();
  light.dark_e = 0;
  auto raws = simulated_raws(*picture, light, 1, one);
  auto again = simulated_raws(*picture, light, 1, one);
  ASSERT_TRUE(raws.has_value() && again.has_value());
  raws->noisy = std::move(again->mean);
  const DevelopOptions options{.exposure_ev = 3, .find_defects = false};
  const auto exact = error_sources(*raws, light, options, one);
  ASSERT_TRUE(exact.has_value()) << exact.error().message;
  EXPECT_EQ(exact->noise, 0);
  EXPECT_EQ(exact->black, 0);
  EXPECT_GT(exact->demosaicing, 0);
  EXPECT_GT(exact->rendering, 0);

  RawDn& raw = raws->noisy.raw;
  const Rect& masked = raw.masked.front();
  // About 0.2 e- at 64 codes for each electron; constant pixels would be refused as padding.
  for (int y = 0; y < masked.height; ++y) {
    for (int x = 0; x < masked.width; ++x) {
      raw.dn.at(masked.x + x, masked.y + y) += static_cast<std::uint16_t>(13 + (x + y) % 3);
    }
  }
  const auto wrong = error_sources(*raws, light, options, one);
  ASSERT_TRUE(wrong.has_value()) << wrong.error().message;
  EXPECT_EQ(wrong->noise, 0);
  EXPECT_GT(wrong->black, exact->sum());
  EXPECT_EQ(wrong->demosaicing, exact->demosaicing);
  EXPECT_EQ(wrong->rendering, exact->rendering);
}

TEST(DevelopingStages, ScalingTellsTimeAndMemoryOfEachSizeAndPlan) {
  BenchOptions options = quick();
  options.threads = 1;  // the others take as long again
  const auto outcome = run_scaling_bench(options);
  ASSERT_TRUE(outcome.has_value()) << outcome.error().message;
  const BenchTable& table = outcome->table;
  const auto figure = [&](std::size_t row, std::size_t column) { return std::get<double>(table.rows[row][column]); };
  constexpr std::size_t sizes_and_plans = 9, jobs = 2;
  ASSERT_EQ(table.rows.size(), sizes_and_plans + jobs);
  for (std::size_t row = 0; row < table.rows.size(); ++row) {
    ASSERT_EQ(table.rows[row].size(), table.columns.size());
    EXPECT_GT(figure(row, 1), 0.29);  // MP
    EXPECT_GT(figure(row, 4), 0);     // ms/MP
    const bool of_files = row >= sizes_and_plans;
    EXPECT_EQ(std::isfinite(figure(row, 7)), !of_files) << row;
    EXPECT_EQ(std::isfinite(figure(row, 8)), of_files) << row;
    // 3 bytes of the picture at least; `standard` has two mosaics of float beside them
    if (!of_files) {
      EXPECT_GT(figure(row, 7), row % 3 == 2 ? 11 : 3) << row;
    }
  }
  ASSERT_EQ(outcome->plots.size(), 2u);
  for (const Plot& plot : outcome->plots) {
    ASSERT_EQ(plot.series.size(), 3u);
    for (const Series& series : plot.series) EXPECT_EQ(series.x.size(), 3u);
  }
}

TEST(DevelopingStages, WithoutPicturesEachSaysWhichIsMissing) {
  BenchOptions options = quick();
  options.pictures_folder = "/nowhere";
  for (const auto run : {run_chroma_start_bench, run_demosaic_bench, run_mesopic_bench, run_develop_bench,
                         run_error_sources_bench, run_scaling_bench, run_retarget_bench}) {
    const auto outcome = run(options);
    ASSERT_FALSE(outcome.has_value());
    EXPECT_NE((outcome.error().where + outcome.error().message).find("/nowhere"), std::string::npos);
  }
}

TEST(DevelopScene, TheMeanIsThatOfTheNoisyFrameWithoutItsDark) {
  InlineExecutor one;
  const auto picture = read_bench_picture(LOWLUX_TESTDATA "/pictures/kodim23.png", 192, 128, one);
  ASSERT_TRUE(picture.has_value());
  const DevelopLight light = develop_lights(false).back();
  const auto raws = simulated_raws(*picture, light, 1, one);
  ASSERT_TRUE(raws.has_value());
  const auto mean_e = [&](const RawFrame& frame) {
    const Rect& area = frame.raw.active;
    double sum = 0;
    for (int y = 0; y < area.height; ++y) {
      for (int x = 0; x < area.width; ++x) {
        sum += frame.raw.dn.at(area.x + x, area.y + y) - frame.raw.black_tag->at(x, y);
      }
    }
    const double range = frame.raw.white_dn[0] - frame.raw.black_tag->at(0, 0);
    return sum / (area.width * area.height) / range * (15871 / light.gain_dn_per_e);
  };
  EXPECT_NEAR(mean_e(raws->mean), light.mean_e, 0.01);  // e-: codes of a 48th of one
  // 5 standard errors: photons, read noise, DSNU, 128 rows, hot pixels of 320 e- at 2e-4 of the pixels
  const double pixels = 192 * 128, rows_e = 0.2 * light.read_noise_e;
  const double variance_e2 =
      (light.mean_e + light.dark_e + 16 + 4 + 2e-4 * 2 * 320 * 320) / pixels + rows_e * rows_e / 128;
  EXPECT_NEAR(mean_e(raws->noisy), light.mean_e + light.dark_e + 2e-4 * 320, 5 * std::sqrt(variance_e2));
  EXPECT_EQ(raws->noisy.raw.masked.size(), 1u);
  EXPECT_TRUE(raws->noisy.noise.has_value());
}

TEST(DevelopScene, DarkChargeDoesNotBrightenTheNoisyFrame) {
  InlineExecutor one;
  const auto picture = read_bench_picture(LOWLUX_TESTDATA "/pictures/kodim23.png", 192, 128, one);
  ASSERT_TRUE(picture.has_value());
  DevelopLight light = develop_lights(false).back();  // 200 e- of dark charge of 992 e- at white
  light.mean_e = 100;
  const auto raws = simulated_raws(*picture, light, 1, one);
  ASSERT_TRUE(raws.has_value());
  const auto mean_green = [&](const RawFrame& frame, double exposure_ev) {
    DevelopOptions options{.exposure_ev = exposure_ev, .tone = ToneCurve::none, .find_defects = false};
    options.space = OutputSpace::camera;
    options.samples = SampleType::f32;
    const auto developed = develop(frame, options, one);
    EXPECT_TRUE(developed.has_value());
    const Plane<float>& green = std::get<SceneLinear>(developed->picture).plane[1];
    return std::accumulate(green.data(), green.data() + green.size(), 0.0) / static_cast<double>(green.size());
  };
  const double expected = mean_green(raws->mean, 0);
  const double got = mean_green(raws->noisy, noisy_exposure_ev(raws->noisy, light, 0));
  // Hot pixels of 4160 e- are 0.8 e- of the mean. 5 standard errors: hot pixels 0.5 e-, black 0.2 e-, photons 0.1 e-
  EXPECT_NEAR(got / expected, 1.008, 5 * 0.006);
}

TEST(DevelopScene, TheTruthHasTheColourOfEachSiteOfTheMean) {
  InlineExecutor one;
  const auto picture = read_bench_picture(LOWLUX_TESTDATA "/pictures/kodim19.png", 96, 64, one);
  ASSERT_TRUE(picture.has_value());
  const auto raws = simulated_raws(*picture, develop_lights(false).front(), 1, one);
  ASSERT_TRUE(raws.has_value());
  const RawDn &mean = raws->mean.raw, &truth = raws->truth.raw;
  ASSERT_EQ(truth.dn.width(), 3 * mean.active.width);
  const auto fraction = [](const RawDn& raw, double dn) {
    const double black = raw.black_tag->pattern_dn[0];
    return (dn - black) / (raw.white_dn[0] - black);
  };
  for (int y = 0; y < mean.active.height; ++y) {
    for (int x = 0; x < mean.active.width; ++x) {
      const int c = static_cast<int>(colour_at(mean.phase, x, y));
      // A code of each, rounded.
      EXPECT_NEAR(fraction(truth, truth.dn.at(3 * x + c, y)),
                  fraction(mean, mean.dn.at(mean.active.x + x, mean.active.y + y)), 1.1e-4);
    }
  }
}

TEST(DevelopScene, TilesRepeatTheActiveArea) {
  RawFrame frame;
  frame.raw.dn = Plane<std::uint16_t>(6, 4);
  for (int i = 0; i < 24; ++i) frame.raw.dn.data()[i] = static_cast<std::uint16_t>(i);
  frame.raw.active = {2, 0, 4, 4};
  const RawFrame tiles = tiled(frame, 10, 6);
  EXPECT_EQ(tiles.raw.active, (Rect{0, 0, 10, 6}));
  for (int y = 0; y < 6; ++y) {
    for (int x = 0; x < 10; ++x) EXPECT_EQ(tiles.raw.dn.at(x, y), frame.raw.dn.at(2 + x % 4, y % 4));
  }
}

TEST(PeakMemory, IsWhatTheWorkTouchesAndNotWhatWasFreedBefore) {
  constexpr std::size_t bytes = 32 << 20;
  { const std::vector<char> freed(2 * bytes, 1); }
  const auto touch = [] {
    std::vector<char> memory(bytes, 1);
    return memory[bytes / 2] == 1;
  };
  const auto peak = peak_bytes_of(touch);
  ASSERT_TRUE(peak.has_value());
  EXPECT_GE(*peak, 0.98 * bytes);  // pages that were there already, of the allocator's own
#if !defined(__SANITIZE_ADDRESS__)
  EXPECT_LE(*peak, 1.25 * bytes);  // and what else a process touches
#endif
  EXPECT_FALSE(peak_bytes_of([] { return false; }).has_value());
}

TEST(AccuracyTime, OutcomeHoldsTableAndAPlotForEachCase) {
  AccuracyRow fast{.group = "a", .error_of = "e", .level = "fast", .error = 2, .ms_per_mp = 1, .largest = 5};
  AccuracyRow slow{.group = "a", .error_of = "e", .level = "slow", .error = 3, .ms_per_mp = 2};
  std::vector<AccuracyRow> rows{fast, slow};
  rows.push_back(slow);
  rows.back().group = "b";
  mark_undominated(rows);
  const BenchOutcome out = accuracy_outcome("stage", rows, {.rounds = 3}, 1);
  EXPECT_EQ(out.plots.size(), 2u);
  const Table table = table_of(out.table, 4);
  EXPECT_EQ(table.columns.back(), "largest error");
  EXPECT_EQ(table.rows[0].back(), "5");
  EXPECT_EQ(table.rows[1].back(), "");  // errors that are no means
  EXPECT_EQ(table.rows[1][7], "no");
  EXPECT_EQ(table.rows[2][7], "yes");
  EXPECT_NE(out.remarks.front().find("3 rounds"), std::string::npos);
}

}  // namespace
}  // namespace lowlux::isp
