#include "isp/output/report/report.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include <nlohmann/json.hpp>

#include "tests/support/comma_locale.h"
#include "tests/support/scratch_directory.h"

namespace lowlux::isp::report_test {
namespace {

std::size_t count(const std::string& text, std::string_view what) {
  std::size_t n = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + what.size())) ++n;
  return n;
}

Plot plot_of(std::vector<double> y) {
  Plot plot{"p", "A plot", "x [nm]", "y"};
  plot.series.push_back({"one", {1, 2}, std::move(y), Mark::dashed});
  return plot;
}

// The page's own data, as a browser would parse it.
nlohmann::json plots_in(const std::string& page) {
  const std::string begin = "const plots = ";
  const std::size_t start = page.rfind(begin) + begin.size();
  return nlohmann::json::parse(page.substr(start, page.find(";\n", start) - start));
}

TEST(Report, IsOnePageThatFetchesNothingAndHoldsChartJs) {
  const std::string page = html_of({"Title", "Text", {{"Section", "More", {{"a"}, {{"1"}}}, {plot_of({3, 4})}}}});
  EXPECT_TRUE(page.starts_with("<!DOCTYPE html>"));
  EXPECT_EQ(count(page, "Chart.js v"), 1u);
  EXPECT_GE(count(page, "MIT License"), 1u);
  for (const char* fetched : {"<script src", "<link", "@import", "<img", "url("}) EXPECT_EQ(count(page, fetched), 0u);
  EXPECT_EQ(count(page, "default-src 'none'"), 1u);
  EXPECT_EQ(count(page, "<canvas"), 1u);
  EXPECT_EQ(count(page, "<script>"), count(page, "</script>"));
  EXPECT_NE(page.find(">1</td>"), std::string::npos);
}

TEST(Report, CarriesEveryPointAndItsGaps) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto plots = plots_in(html_of({"", "", {{"", "", {}, {plot_of({3, nan})}}, {"", "", {}, {plot_of({5, 6})}}}}));
  ASSERT_EQ(plots.size(), 2u);
  EXPECT_EQ(plots[0]["series"][0]["x"], nlohmann::json({1.0, 2.0}));
  EXPECT_EQ(plots[0]["series"][0]["y"][0], 3.0);
  EXPECT_TRUE(plots[0]["series"][0]["y"][1].is_null());
  EXPECT_EQ(plots[1]["series"][0]["mark"], "dashed");
}

std::vector<std::byte> bytes_of(std::string_view text) {
  std::vector<std::byte> out;
  out.reserve(text.size());
  for (const char c : text) out.push_back(static_cast<std::byte>(c));
  return out;
}

std::string page_of(const ReportSection& section) { return html_of({"", "", {section}}); }

TEST(Report, HoldsPicturesAsData) {
  // The test vectors of RFC 4648, section 10.
  const std::pair<const char*, const char*> vectors[] = {{"", ""},
                                                         {"f", "Zg=="},
                                                         {"fo", "Zm8="},
                                                         {"foo", "Zm9v"},
                                                         {"foob", "Zm9vYg=="},
                                                         {"fooba", "Zm9vYmE="},
                                                         {"foobar", "Zm9vYmFy"},
                                                         {"\xff\xfe\xfb", "//77"}};
  for (const auto& [plain, encoded] : vectors) {
    const std::string page =
        page_of({.title = "", .comparisons = {{"Title", {"left", bytes_of(plain)}, {"right", {}}}}});
    EXPECT_EQ(count(page, "src=\"data:image/png;base64," + std::string(encoded) + "\">"), *plain == 0 ? 2u : 1u);
  }
}

TEST(Report, HasASliderForEachComparisonAndNoneWithout) {
  const Comparison comparison{"Title", {"left", {}}, {"right", {}}};
  for (const std::size_t n : {0u, 1u, 3u}) {
    const std::string page = page_of({.title = "", .comparisons = std::vector(n, comparison)});
    EXPECT_EQ(count(page, R"(<input type="range")"), n);
    EXPECT_EQ(count(page, R"(aria-label="How much is shown of left, the rest of right: Title")"), n);
    EXPECT_EQ(count(page, "<img"), 2 * n);
    EXPECT_EQ(count(page, "<canvas"), 0u);
  }
}

TEST(Report, ListsItsSectionsFromThreeOnButNotTheirParts) {
  const auto page = [](std::size_t sections) {
    Report report;
    for (std::size_t i = 0; i < sections; ++i) {
      report.sections.push_back({.title = "S"});
      report.sections.push_back({.title = "P", .is_part = true});
    }
    return html_of(report);
  };
  EXPECT_EQ(count(page(2), "<nav"), 0u);
  const std::string three = page(3);
  EXPECT_EQ(count(three, "<nav"), 1u);
  EXPECT_EQ(count(three, "<li>"), 3u);
  for (const char* id : {"section0\">S<", "section2\">S<", "section4\">S<"}) {
    EXPECT_EQ(count(three, std::string("<a href=\"#") + id), 1u);
    EXPECT_EQ(count(three, std::string("<h2 id=\"") + id), 1u);
  }
  EXPECT_EQ(count(three, "<h3"), 3u);
}

TEST(Report, SetsFiguresToTheRightAndMarksRows) {
  const std::string name(30, 'x'), sentence(60, 'x');
  const Table table{{"a", "b", "c", "d", "e"},
                    {{"1.5", "1.5", "", name, sentence}, {"-2e-7", "two", "", "y", "y"}, {"", "3", "", "", ""}},
                    {1}};
  const std::string page = page_of({"", "", table, {}});
  EXPECT_EQ(count(page, R"(<td class="number">)"), 3u);
  EXPECT_EQ(count(page, R"(<td class="short">)"), 6u);  // mixed, and empty
  EXPECT_EQ(count(page, R"(<td class="text">)"), 3u);
  EXPECT_EQ(count(page, R"(<td class="long">)"), 3u);
  EXPECT_EQ(count(page, R"(<tr class="marked"><td class="number">-2e-7)"), 1u);
  EXPECT_EQ(count(page, R"(<tr class="marked">)"), 1u);
}

TEST(Report, MakesAParagraphOfEachLine) {
  const std::string page = html_of({"", "one\ntwo\n\nthree\n", {}});
  EXPECT_EQ(count(page, "<p>one</p>\n<p>two</p>\n<p>three</p>\n"), 1u);
  EXPECT_EQ(count(page, "<p>"), 3u);
}

TEST(Report, NoTextBecomesMarkupOrScript) {
  const std::string evil = "</script><script>alert(\"1\")</script><!-- &";
  Plot plot = plot_of({3, 4});
  plot.title = plot.caption = plot.x_label = plot.series[0].name = evil;
  const Comparison comparison{evil, {evil, {}}, {evil, {}}};
  const ReportSection section{evil, evil, {{evil}, {{evil}}}, {plot}, {comparison}};
  const std::string page = html_of({evil, evil, {section, section, section}});
  EXPECT_EQ(count(page, "<script>"), 2u);
  EXPECT_EQ(count(page, "</script>"), 2u);
  EXPECT_EQ(count(page, "<!--"), 0u);
  EXPECT_EQ(count(page, "alert(\"1\")"), 0u);
  EXPECT_EQ(plots_in(page)[0]["title"], evil);
}

TEST(Report, BytesThatAreNoUtf8DoNotStopIt) {
  Plot plot = plot_of({3, 4});
  plot.title = "\xff\xfe";
  EXPECT_EQ(plots_in(html_of({"", "", {{"", "", {}, {plot}}}}))[0]["title"], "\xef\xbf\xbd\xef\xbf\xbd");
}

TEST(Report, OfNothingIsStillAPage) { EXPECT_TRUE(plots_in(html_of({})).empty()); }

TEST(Csv, QuotesWhatNeedsIt) {
  EXPECT_EQ(csv_of(Table{{"a", "b"}, {{"1,5", "say \"no\""}, {"two\nlines", ""}}}),
            "a,b\n\"1,5\",\"say \"\"no\"\"\"\n\"two\nlines\",\n");
}

TEST(Csv, OfAPlotHasAllDigitsAndEmptyGaps) {
  EXPECT_EQ(csv_of(plot_of({0.1, std::numeric_limits<double>::infinity()})),
            "series,x,y\none,1,0.10000000000000001\none,2,\n");
}

TEST(Csv, HasDecimalPointsUnderEveryLocale) {
  const test::CommaLocale comma;
  EXPECT_EQ(csv_of(plot_of({0.1, 1.5})), "series,x,y\none,1,0.10000000000000001\none,2,1.5\n");
}

TEST(TextFile, IsWrittenWholeAndNeverOverAnother) {
  const test::ScratchDirectory scratch;
  const std::string path = scratch.file("a.txt");
  ASSERT_TRUE(write_text(path, "first", Overwrite::no));
  const auto second = write_text(path, "second", Overwrite::no);
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, ErrorCode::exists);
  EXPECT_EQ(scratch.read("a.txt"), "first");
  ASSERT_TRUE(write_text(path, "", Overwrite::yes));
  EXPECT_EQ(scratch.read("a.txt"), "");
  EXPECT_FALSE(write_text(scratch.file("no/such/folder.txt"), "x", Overwrite::no));
  EXPECT_FALSE(write_text("/dev/full", "x", Overwrite::yes));
  EXPECT_EQ(scratch.names().size(), 1u);
}

}  // namespace
}  // namespace lowlux::isp::report_test
