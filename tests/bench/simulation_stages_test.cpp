#include "isp/bench/stages/simulation_stages.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <ctime>

#include "isp/bench/accuracy_time.h"
#include "isp/bench/scenes/simulated_camera.h"
#include "isp/raw/measure/masked_black.h"

namespace lowlux::isp {
namespace {

TEST(SimulatedCamera, BoxesHaveTheMeanAndVarianceOfEachColour) {
  Plane<float> mosaic(10, 9);  // a box, and what is left over
  for (int y = 0; y < 9; ++y) {
    for (int x = 0; x < 10; ++x) {
      const auto colour = colour_at(BayerPhase::rggb, x, y);
      mosaic.at(x, y) = colour == CfaColour::red     ? 5.0F
                        : colour == CfaColour::green ? (y % 2 == 0 ? 1.0F : 3.0F)
                                                     : -2.0F;
    }
  }
  const auto boxes = box_statistics(std::as_const(mosaic).view(), BayerPhase::rggb, 8);
  ASSERT_EQ(boxes.size(), 1u);
  EXPECT_EQ(boxes[0].mean, (Vector3{5, 2, -2}));
  EXPECT_EQ(boxes[0].variance[0], 0);
  EXPECT_NEAR(boxes[0].variance[1], 32.0 / 31, 1e-12);
}

TEST(SimulatedCamera, WhiteIsDevelopedToWhiteAndItsCellsToGrey) {
  const Developing developing{rgb_to_xyz(primaries_rec709).value(), {50, 100, 80}};
  const Lab white = developed_lab(developing, {50, 100, 80});
  EXPECT_NEAR(white.l, 100, 1e-3);  // the primaries' white has four digits
  EXPECT_NEAR(std::hypot(white.a, white.b), 0, 0.02);
  Plane<float> charge_e(4, 2);
  for (int y = 0; y < 2; ++y) {
    for (int x = 0; x < 4; ++x) {
      const auto k = static_cast<std::size_t>(colour_at(BayerPhase::rggb, x, y));
      charge_e.at(x, y) = static_cast<float>(developing.white_e[k] / 4);
    }
  }
  const SceneLinear picture = binned_picture(std::as_const(charge_e).view(), developing);
  EXPECT_EQ(picture.width(), 2);
  for (const auto& plane : picture.plane) EXPECT_NEAR(plane.at(1, 0), 0.25, 1e-6);  // float
}

TEST(SimulatedCamera, EvenLightHasTheMeanAndTheVarianceOfItsSensor) {
  EvenLight light{.sensor = bench_camera().model, .exposure = {.time_s = 0.5, .temperature_c = 20}};
  SensorModel& s = light.sensor;
  s.prnu = s.dsnu = s.hot_pixel_fraction = s.row_noise_e = s.column_noise_e = 0;
  light.rate_e_per_s = {100, 200, 60};
  light.width = light.height = 200;
  light.masked_columns = 40;
  InlineExecutor one;
  const RawDn raw = even_frame(light, 3, one);
  EXPECT_EQ(raw.active, (Rect{40, 0, 200, 200}));
  for (const bool dark : {true, false}) {
    double sum = 0, square = 0, n = 0;
    const double mean_e = (dark ? 0 : 50) + 0.5 * s.dark_current_e_per_s[0];
    const double k = s.system_gain_dn_per_e, mean_dn = s.black_level_dn + k * mean_e;
    for (int y = 0; y < 200; y += 2) {
      for (int x = dark ? 0 : 40; x < (dark ? 40 : 240); x += 2) {
        sum += raw.dn.at(x, y) - mean_dn;
        square += std::pow(raw.dn.at(x, y) - mean_dn, 2);
        ++n;
      }
    }
    const double variance = variance_dn2(s, {dark ? 0.0 : 50.0, 0.5 * s.dark_current_e_per_s[0]});
    EXPECT_NEAR(sum / n, 0, 5 * std::sqrt(variance / n));
    const double excess = k * k * k * k * mean_e / (variance * variance);  // fourth cumulant: Poisson's
    EXPECT_NEAR(square / n, variance, 5 * variance * std::sqrt((2 + excess) / n));
  }
}

DarkCase two_electrons() {
  DarkCase dark{"", bench_camera().model, 2};
  dark.sensor.prnu = dark.sensor.dsnu = dark.sensor.hot_pixel_fraction = 0;
  dark.sensor.row_noise_e = dark.sensor.column_noise_e = 0;
  return dark;
}

TEST(BlackPointBench, TheClosedFormIsThatOfAMean) {
  DarkCase dark = two_electrons();
  dark.sensor.system_gain_dn_per_e = 0.5;
  dark.sensor.read_noise_e = 3;
  EXPECT_NEAR(black_error_e(dark, 100), std::sqrt((2 + 9 + 1 / 3.0) / 100), 1e-12);
  EXPECT_NEAR(black_error_e(dark, 10'000), black_error_e(dark, 100) / 10, 1e-12);
}

TEST(BlackPointBench, TheProductMeasuresThePixelsThatArePlainlyAveraged) {
  const RawDn raw = masked_frame(two_electrons(), 1000, 5);
  const MaskedBlack measured = measure_masked_black(raw);
  ASSERT_TRUE(measured.black) << measured.refusal;
  EXPECT_EQ(measured.region, (Rect{4, 0, 40, 100}));
  const PerSite<double> mean = mean_black_dn(raw);
  const double k = bench_camera().model.system_gain_dn_per_e, deviation_dn = k * black_error_e(two_electrons(), 1);
  for (std::size_t site = 0; site < 4; ++site) {
    // One pixel in a million is beyond the cut: at most one here, of 5 to 7 standard deviations.
    EXPECT_NEAR(measured.black->pedestal_dn[site], mean[site], 7 * deviation_dn / 1000);
  }
  EXPECT_FALSE(measure_masked_black(masked_frame(two_electrons(), 100, 5)).black);
}

TEST(BlackPointBench, ThePlainMeanIsOfEachSiteBetweenTheTrims) {
  RawDn raw = masked_frame(two_electrons(), 100, 1);
  for (int y = 0; y < raw.dn.height(); ++y) {
    for (int x = 0; x < raw.dn.width(); ++x) {
      const bool measured = x >= 4 && x < 44;
      raw.dn.at(x, y) = static_cast<std::uint16_t>(measured ? 100 + 10 * site_of(x, y) + (x < 24 ? 1 : 0) : 60'000);
    }
  }
  EXPECT_EQ(mean_black_dn(raw), (PerSite<double>{100.5, 110.5, 120.5, 130.5}));
}

TEST(EffectChange, EqualFramesDoNotDifferAndAVarianceIsRelativeToNoLessThanTheFloor) {
  const SensorModel sensor = bench_camera().model;
  const Developing developing{rgb_to_xyz(primaries_rec709).value(), {100, 100, 100}};
  const ChangedFrame frame{sensor, {}, developing};
  Plane<float> flat(64, 40), other(64, 40);  // two whole blocks
  std::fill_n(flat.data(), flat.size(), static_cast<float>(sensor.black_level_dn) + 64.0F);
  std::copy_n(flat.data(), flat.size(), other.data());
  const PredictedChange none = measured_change(frame, other, flat);
  EXPECT_EQ(none.delta_e, 0);
  EXPECT_EQ(none.relative_variance, 0);
  for (int y = 32; y < 40; ++y) std::fill_n(other.row(y), 64, 0.0F);  // beyond the whole blocks
  EXPECT_EQ(measured_change(frame, other, flat).delta_e, 0);
  for (int y = 0; y < 32; y += 2) {
    for (int x = 32; x < 64; x += 2) other.at(x, y) += (x + y) % 4 == 0 ? 0.5F : -0.5F;  // red of the second block
  }
  const PredictedChange noisy = measured_change(frame, other, flat);
  EXPECT_EQ(noisy.delta_e, 0);
  EXPECT_NEAR(noisy.relative_variance, 0.25 * 256 / 255 / variance_floor_dn2, 1e-3);  // floats of charge
  EXPECT_NEAR(measured_change(frame, flat, other).relative_variance, 1, 1e-5);
  for (int y = 0; y < 32; ++y) std::fill_n(other.row(y), 32, flat.at(0, 0) + 1);
  EXPECT_GT(measured_change(frame, other, flat).delta_e, 0.01);
}

TEST(EffectChange, NothingIsPredictedOfAllEffectsAndThePlansBlocksAreLookedAt) {
  const SensorModel sensor = bench_camera().model;
  const Developing developing{rgb_to_xyz(primaries_rec709).value(), {100, 100, 100}};
  const ChangedFrame frame{sensor, {}, developing};
  const std::vector<BlockLevel> blocks{{{50, 60, 40}, {50, 60, 40}, 60}, {{5, 6, 4}, {5, 6, 4}, 6}};
  NoiseSourcePlan plan = plan_keeping(NoiseSourceSet::all(), 64, 32);
  EXPECT_EQ(predicted_change(frame, blocks, plan).delta_e, 0);
  plan.regions.push_back({.kept = NoiseSourceSet::all().without(Effect::read_noise)});
  plan.region_of_block = {0, 1};
  const PredictedChange expected =
      predict_change(sensor, {}, developing, blocks[1], NoiseSourceSet::all().without(Effect::read_noise));
  EXPECT_GT(expected.delta_e, 0);
  EXPECT_EQ(predicted_change(frame, blocks, plan).delta_e, expected.delta_e);
  EXPECT_EQ(predicted_change(frame, blocks, plan).relative_variance, expected.relative_variance);
}

TEST(StageRows, FurtherFiguresFollowTheTimesWhoseNameSaysWhatTheyAreOf) {
  StageRows rows{.further = {"more"}};
  rows.add({"g", "e", {{"a", 1, [] {}, 1}, {"b", 0, [] {}, 1}}}, {{7}, {8}}, {.rounds = 1});
  for (const TimeOf time_of : {TimeOf::megapixel, TimeOf::whole}) {
    const BenchOutcome out = outcome_of("s", rows, time_of);
    EXPECT_EQ(out.table.columns.back(), "more");
    EXPECT_EQ(std::get<double>(out.table.rows[1].back()), 8);
    const std::string time = time_of == TimeOf::whole ? "time [ms]" : "time [ms/MP]";
    EXPECT_EQ(std::ranges::count(out.table.columns, time), 1);
    EXPECT_EQ(out.plots.at(0).x_label, time);
  }
}

double process_cpu_s() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// What `bench --quick` may take of each stage, in a build that is as fast as the released one.
#if defined(NDEBUG) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
constexpr double max_cpu_s = 4;
#else
constexpr double max_cpu_s = 60;
#endif

BenchOutcome quickly(Result<BenchOutcome> (*run)(const BenchOptions&)) {
  BenchOptions options{.pictures_folder = LOWLUX_TESTDATA "/pictures", .quick = true, .threads = 2};
  double share = 0;
  options.advance = [&](double more, const std::string&) { share += more; };
  const double start_s = process_cpu_s();
  auto out = run(options);
  EXPECT_LT(process_cpu_s() - start_s, max_cpu_s);
  EXPECT_TRUE(out) << out.error().message;
  if (!out) return {};
  EXPECT_NEAR(share, 1, 1e-9);
  EXPECT_FALSE(out->table.rows.empty());
  for (const auto& cells : out->table.rows) {
    EXPECT_EQ(cells.size(), out->table.columns.size());
    for (const BenchCell& cell : cells) {
      if (const auto* figure = std::get_if<double>(&cell)) {
        EXPECT_TRUE(std::isfinite(*figure)) << std::get<std::string>(cells[1]);
      }
    }
  }
  for (const Finding& finding : out->findings) {
    EXPECT_TRUE(finding.holds) << finding.id << ": " << finding.ours << ", expected " << finding.published;
    EXPECT_EQ(finding.kind, Finding::Kind::check);
  }
  return *std::move(out);
}

/// Returns the largest figure of a level over its cases.
double largest_figure_of(const BenchOutcome& out, const std::string& level, const std::string& column) {
  const auto at = std::ranges::find(out.table.columns, column) - out.table.columns.begin();
  double largest = 0;
  for (const auto& cells : out.table.rows) {
    if (std::get<std::string>(cells[1]) != level) continue;
    largest = std::max(largest, std::get<double>(cells.at(static_cast<std::size_t>(at))));
  }
  return largest;
}

/// A figure of the first row of a level, whatever the case.
double figure_of(const BenchOutcome& out, const std::string& level, const std::string& column) {
  const auto at = std::ranges::find(out.table.columns, column) - out.table.columns.begin();
  for (const auto& cells : out.table.rows) {
    if (std::get<std::string>(cells[1]) == level) return std::get<double>(cells.at(static_cast<std::size_t>(at)));
  }
  ADD_FAILURE() << "no level " << level;
  return 0;
}

TEST(SimulationStages, PhotonSamplingTellsTheSamplersApart) {
  const BenchOutcome out = quickly(run_photon_sampling_bench);
  EXPECT_EQ(out.findings.size(), 6u);
  const double published = figure_of(out, "published", "relative error of the variance");
  EXPECT_GT(published, -1);
  EXPECT_LT(published, -0.5);  // 1 - Qe, which is nowhere above a half
  EXPECT_GT(figure_of(out, "rounded normal", "error"), 1e-3);
}

TEST(SimulationStages, EffectsAreWithinWhatIsPredictedAndAllChangeNothing) {
  const BenchOutcome out = quickly(run_simulation_effects_bench);
  EXPECT_EQ(out.table.rows.size(), bench_lights.size() * (1 + effect_count + 3 + 1));
  EXPECT_EQ(figure_of(out, "all", "error"), 0);
  EXPECT_GT(figure_of(out, "without photon-noise", "error"), 0);
  EXPECT_GT(figure_of(out, "none", "relative variance"), 0.5);
  for (const std::string_view effect : effect_names()) {
    if (effect == "clipping") continue;  // nothing saturates in these lights
    EXPECT_GT(largest_figure_of(out, "without " + std::string(effect), "error"), 0) << effect;
    EXPECT_GT(largest_figure_of(out, "without " + std::string(effect), "predicted CIEDE2000"), 0) << effect;
  }
  ASSERT_EQ(out.images.size(), bench_lights.size());
  EXPECT_EQ(out.images[2].id, "simulation-effects-very-dark");
  EXPECT_EQ(out.images[2].codes.width(), 5 * 192 / 2);
}

TEST(SimulationStages, BlackIsAsGoodAsItsClosedForm) {
  const BenchOutcome out = quickly(run_black_point_bench);
  EXPECT_EQ(out.findings.size(), 10u);
  EXPECT_GT(figure_of(out, "100, mean", "CIEDE2000 of a grey"), figure_of(out, "10000, mean", "CIEDE2000 of a grey"));
}

TEST(SimulationStages, NoiseIsFittedToItsTruth) {
  const BenchOutcome out = quickly(run_noise_fit_bench);
  EXPECT_LT(figure_of(out, "128 x 128 px, 4 pairs", "error"), 0.01);
  EXPECT_LT(figure_of(out, "blocks, all", "error"), 0.2);
}

TEST(SimulationStages, WholeFilesDifferByTheirNoiseAndPublishedPhotonsHaveTooLittle) {
  const BenchOutcome out = quickly(run_simulate_bench);
  EXPECT_EQ(figure_of(out, "physical, all", "error"), 0);
  EXPECT_GT(figure_of(out, "physical, all, another frame", "error"), 0);
  EXPECT_NEAR(figure_of(out, "physical, none", "relative error of the noise variance"), -1, 1e-12);
  EXPECT_LT(figure_of(out, "published, all", "relative error of the noise variance"), -0.01);
}

TEST(SimulationStages, WithoutPicturesThoseThatLookAtThemSaySo) {
  BenchOptions options{.pictures_folder = "/nowhere", .quick = true};
  options.advance = [](double, const std::string&) {};
  for (const auto run : {run_simulation_effects_bench, run_noise_fit_bench, run_simulate_bench}) {
    const auto out = run(options);
    ASSERT_FALSE(out);
    EXPECT_NE(out.error().where.find("/nowhere"), std::string::npos);
  }
}

}  // namespace
}  // namespace lowlux::isp
