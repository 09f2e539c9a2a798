#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "isp/bench/stages/denoise_bench.h"

namespace lowlux::isp::denoise_rows_test {
namespace {

DenoiseRow row(const char* method, MethodKind kind, const DenoiseLight& light, double s_per_mp, double psnr_db,
               double ciede2000) {
  DenoiseRow out{.method = method, .kind = kind, .light = light, .s_per_mp = s_per_mp};
  out.error.psnr_db = psnr_db;
  out.error.ciede2000 = ciede2000;
  out.error.saturation_ratio = 1;
  out.speed_of_nlm = 1 / s_per_mp;
  return out;
}

constexpr DenoiseLight dim{20, 2, 1.5}, dark{20, 200, 4}, bright{2000, 2, 1.5};

const Finding* find(const std::vector<Finding>& findings, const std::string& id) {
  for (const Finding& finding : findings) {
    if (finding.id == "denoise/" + id) return &finding;
  }
  return nullptr;
}

TEST(DenoiseRows, ARowIsDominatedByOneThatIsAsGoodAndFasterInItsOwnLight) {
  std::vector<DenoiseRow> rows{
      row("noise-free", MethodKind::ceiling, dim, 0, 40, 0.5), row("none", MethodKind::other, dim, 0.001, 20, 10),
      row("slow", MethodKind::other, dim, 1.0, 25, 4),         row("fast", MethodKind::ours, dim, 0.5, 25, 4),
      row("worse", MethodKind::ours, dim, 0.6, 24, 5),         row("other light", MethodKind::ours, dark, 0.9, 24, 9)};
  mark_undominated(rows);
  const std::vector<bool> expected{false, true, false, true, false, true};
  for (std::size_t i = 0; i < rows.size(); ++i) EXPECT_EQ(rows[i].undominated, expected[i]) << rows[i].method;
}

TEST(DenoiseRows, EqualRowsDoNotDominateEachOther) {
  std::vector<DenoiseRow> rows{row("a", MethodKind::ours, dim, 1, 25, 4), row("b", MethodKind::ours, dim, 1, 25, 4)};
  mark_undominated(rows);
  EXPECT_TRUE(rows[0].undominated && rows[1].undominated);
}

TEST(DenoiseFindings, HoldFromTheirLimitOnAndNotBelow) {
  const auto gain = [](double standard_db, double standard_ciede) {
    std::vector<DenoiseRow> rows{row("none", MethodKind::other, dim, 0.001, 20, 10),
                                 row(name_of_nl_means, MethodKind::other, dim, 1, 27, 5),
                                 row("standard", MethodKind::ours, dim, 1.0 / 32, standard_db, standard_ciede)};
    mark_undominated(rows);
    return denoise_findings(rows);
  };
  const auto good = gain(28.0, 4.5), bad = gain(27.75, 4.75);
  EXPECT_TRUE(find(good, "nlm-psnr-20/2")->holds);
  EXPECT_TRUE(find(good, "nlm-ciede2000-20/2")->holds);
  EXPECT_TRUE(find(good, "gain-standard-20/2")->holds);
  EXPECT_TRUE(find(good, "speed-standard")->holds);
  EXPECT_TRUE(find(good, "undominated-20/2")->holds);
  EXPECT_TRUE(find(good, "saturation-standard-20/2")->holds);
  EXPECT_FALSE(find(bad, "nlm-psnr-20/2")->holds);
  EXPECT_FALSE(find(bad, "nlm-ciede2000-20/2")->holds);
  EXPECT_FALSE(find(bad, "gain-standard-20/2")->holds);
  EXPECT_EQ(find(bad, "nlm-psnr-20/2")->ours, "+0.75 dB");
  EXPECT_EQ(find(bad, "gain-draft-20/2"), nullptr);  // no such row
  EXPECT_EQ(find(bad, "gain-standard-20/200"), nullptr);
  for (const Finding& finding : good) EXPECT_EQ(finding.kind, Finding::Kind::check);
}

TEST(DenoiseFindings, TheSlowestLightDecidesSpeedAndDominatedLevelsAreNamed) {
  std::vector<DenoiseRow> rows{
      row("none", MethodKind::other, dim, 0.001, 20, 10),  row("quick one", MethodKind::other, dim, 0.02, 28, 4),
      row("draft", MethodKind::ours, dim, 0.03, 27, 5),    row("high", MethodKind::ours, dim, 0.05, 29, 3),
      row("draft", MethodKind::ours, bright, 0.01, 35, 1),
  };
  mark_undominated(rows);
  const auto findings = denoise_findings(rows);
  EXPECT_EQ(find(findings, "undominated-20/2")->ours, "draft");
  EXPECT_FALSE(find(findings, "undominated-20/2")->holds);
  EXPECT_EQ(find(findings, "speed-draft")->ours, "33.3");
  EXPECT_FALSE(find(findings, "speed-draft")->holds);
  EXPECT_EQ(find(findings, "undominated-2000/2"), nullptr);  // bright light is not asked about
}

TEST(DenoiseFindings, SaturationHasBothEndsWhereBothAreAsked) {
  const auto holds = [](const DenoiseLight& light, double ratio) {
    std::vector<DenoiseRow> rows{row("draft", MethodKind::ours, light, 0.03, 27, 5)};
    rows[0].error.saturation_ratio = ratio;
    return find(denoise_findings(rows), "saturation-draft-" + name_of(light))->holds;
  };
  EXPECT_TRUE(holds(dim, 0.985) && holds(dim, 1.015) && holds(bright, 1) && holds(dark, 0.95) && holds(dark, 1.5));
  EXPECT_FALSE(holds(dim, 0.975) || holds(dim, 1.025) || holds(dark, 0.94));
  EXPECT_FALSE(holds(dim, std::numeric_limits<double>::quiet_NaN()));
}

TEST(DenoiseFindings, WithoutTheOtherMethodNothingIsSaidOfIt) {
  std::vector<DenoiseRow> rows{row("standard", MethodKind::ours, dim, 0.03, 27, 5)};
  rows[0].speed_of_nlm = std::numeric_limits<double>::quiet_NaN();
  const auto findings = denoise_findings(rows);
  EXPECT_EQ(find(findings, "nlm-psnr-20/2"), nullptr);
  EXPECT_EQ(find(findings, "speed-standard"), nullptr);
}

TEST(DenoiseRows, TableAndPlotsHoldWhatWasMeasured) {
  std::vector<DenoiseRow> rows{
      row("noise-free", MethodKind::ceiling, dim, 0, 40, 0.5), row("none", MethodKind::other, dim, 0.001, 20, 10),
      row("draft", MethodKind::ours, dim, 0.02, 28, 4), row("draft", MethodKind::ours, dark, 0.01, 23, 7)};
  rows[2].spread = 0.03;
  rows[2].patch_uv = 0.004;
  rows[2].patch_uv_bound = 0.002;
  mark_undominated(rows);
  const Table table = table_of(denoise_table(rows), 4);
  ASSERT_EQ(table.rows.size(), rows.size());
  for (const auto& cells : table.rows) EXPECT_EQ(cells.size(), table.columns.size());
  EXPECT_EQ(table.rows[2][3], "draft");
  EXPECT_EQ(table.rows[2][4], "28");
  EXPECT_EQ(table.rows[0][12], "");  // the ceiling takes no time
  EXPECT_EQ(table.columns[9], "patch_uv");
  EXPECT_EQ(table.rows[2][9], "0.004");
  EXPECT_EQ(table.columns[10], "patch_uv_bound");
  EXPECT_EQ(table.rows[2][10], "0.002");
  EXPECT_EQ(table.columns[13], "spread_percent");
  EXPECT_EQ(table.rows[2][13], "3");
  EXPECT_EQ(table.rows[1][13], "");
  EXPECT_EQ(table.rows[2].back(), "yes");
  const std::vector<Plot> plots = denoise_plots(rows);
  ASSERT_EQ(plots.size(), 2u);
  EXPECT_EQ(plots[0].id, "denoise-20-2");
  ASSERT_EQ(plots[0].series.size(), 3u);  // none, draft, the line
  EXPECT_EQ(plots[0].series.back().x, (std::vector<double>{0.001, 0.02}));
  EXPECT_EQ(plots[0].series.back().y, (std::vector<double>{10, 4}));
}

TEST(DenoiseRows, LightsAreEightAndQuickOnesTwoOfThem) {
  EXPECT_EQ(denoise_lights(false).size(), 8u);
  const auto quick = denoise_lights(true);
  ASSERT_EQ(quick.size(), 2u);
  EXPECT_EQ(name_of(quick[0]), "20/2");
  EXPECT_EQ(name_of(quick[1]), "4/200");
}

TEST(BenchStages, AreFoundByTheirIds) {
  ASSERT_FALSE(bench_stages().empty());
  for (const BenchStage& stage : bench_stages()) EXPECT_EQ(bench_stage_named(stage.id)->title, stage.title);
  const auto none = bench_stage_named("denoi");
  ASSERT_FALSE(none.has_value());
  EXPECT_NE(none.error().message.find("denoise"), std::string::npos);
}

TEST(BenchStages, AMissingPictureIsAnErrorThatNamesIt) {
  const BenchOptions options{.pictures_folder = "/nowhere", .advance = [](double, const std::string&) {}};
  const auto outcome = run_denoise_bench(options);
  ASSERT_FALSE(outcome.has_value());
  EXPECT_NE(outcome.error().where.find("/nowhere"), std::string::npos);
}

}  // namespace
}  // namespace lowlux::isp::denoise_rows_test
