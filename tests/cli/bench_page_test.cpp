#include "isp/cli/bench/bench_page.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "isp/cli/bench/bench_report.h"
#include "tests/cli/command.h"
#include "tests/support/scratch_directory.h"

namespace lowlux::cli {
namespace {

using test::holds;

/// As a stage yields it: a row that is undominated and one that is not, a finding that holds and one that does not.
MeasuredStage stage_of(std::string_view id) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  MeasuredStage out{{id, id, nullptr}, {}};
  out.outcome.table = {{"level", "error", "undominated"}, {{"fast", 2.0, "yes"}, {"slow", nan, ""}}};
  out.outcome.findings = {{"a", "", "", "", true, ""}, {"b", "", "", "", false, ""}};
  out.outcome.plots.push_back({.id = "p", .series = {{"fast", {1}, {2}}}});
  out.outcome.remarks = {"one remark", "another"};
  out.took_s = 1.25;
  return out;
}

void add_pair(MeasuredStage& measured, const std::string& before, const std::string& after) {
  for (const std::string& id : {before, after}) {
    measured.outcome.images.push_back({id, Encoded8{Plane<std::uint8_t>(6, 2)}});
  }
  measured.outcome.comparisons.push_back({"Pair", before, "raw <", after, "done"});
}

/// Pictures are not copied, and so a list of stages has to be filled.
template <class... Stage>
std::vector<MeasuredStage> list_of(Stage... stages) {
  std::vector<MeasuredStage> out;
  (out.push_back(std::move(stages)), ...);
  return out;
}

std::string page_of(const std::vector<MeasuredStage>& measured, const Machine& machine = {}) {
  InlineExecutor one;
  auto page = bench_page(measured, machine, one);
  EXPECT_TRUE(page);
  return page ? *page : "";
}

TEST(BenchPage, PutsTheWholePipelineFirstAndTheOthersAsMeasured) {
  const std::string page = page_of(list_of(stage_of("tone"), stage_of("simulate"), stage_of("alpha"),
                                           stage_of("error-sources"), stage_of("develop")));
  std::vector<std::size_t> places;
  for (const char* title : {"Machine</h2>", "At a glance</h2>", "develop</h2>", "error-sources</h2>", "simulate</h2>",
                            "tone</h2>", "alpha</h2>"}) {
    places.push_back(page.find(title));
    EXPECT_NE(places.back(), std::string::npos) << title;
  }
  EXPECT_TRUE(std::ranges::is_sorted(places));
}

TEST(BenchPage, StatesTheTimeOfEachStageAndOfAll) {
  const std::string page = page_of(list_of(stage_of("tone"), stage_of("alpha")));
  EXPECT_TRUE(holds(page, R"(took [s]</th>)"));
  EXPECT_TRUE(holds(page, "1.2</td></tr>"));  // to the even one
  EXPECT_TRUE(holds(page, "<p>2 stages took 2.5 s.</p>"));
  EXPECT_EQ(time_text(list_of(stage_of("tone"))), "1 stage took 1.2 s");
}

TEST(BenchPage, MarksParetoOptimalRowsAndFailedFindings) {
  const std::string page = page_of(list_of(stage_of("tone")));
  EXPECT_TRUE(holds(page, R"(<tr class="marked"><td class="short">fast)"));
  EXPECT_TRUE(holds(page, R"(<tr><td class="short">slow)"));
  EXPECT_TRUE(holds(page, R"(<tr class="marked"><td class="short">b<)"));
  EXPECT_TRUE(holds(page, R"(<tr class="marked"><td class="short">tone)"));  // at a glance
  EXPECT_TRUE(holds(page, "1 of 2 hold"));
  EXPECT_TRUE(holds(page, ">Charts</h3>"));
  MeasuredStage good = stage_of("good");
  good.outcome.findings.pop_back();
  const std::string without = page_of(list_of(std::move(good)));
  EXPECT_TRUE(holds(without, R"(<tr><td class="short">good)"));
  EXPECT_TRUE(holds(without, "1 of 1 hold."));
}

TEST(BenchPage, HoldsBothPicturesOfAComparison) {
  std::vector<MeasuredStage> measured = list_of(stage_of("tone"));
  EXPECT_FALSE(holds(page_of(measured), "<img"));
  add_pair(measured[0], "tone-raw", "tone-done");
  const std::string page = page_of(measured);
  EXPECT_TRUE(holds(page, R"(alt="raw &lt;" src="data:image/png;base64,iVBORw0KGgo)"));  // a PNG file's first bytes
  EXPECT_TRUE(holds(page, R"(alt="done" src="data:image/png;base64,iVBORw0KGgo)"));
  EXPECT_TRUE(holds(page, "tone-raw.png, tone-done.png"));
}

TEST(BenchPage, LeavesOutWhatAStageDoesNotHave) {
  MeasuredStage measured = stage_of("tone");
  measured.outcome.findings.clear();
  measured.outcome.plots.clear();
  measured.outcome.remarks.clear();
  const std::string page = page_of(list_of(std::move(measured)));
  for (const char* part : {">Charts<", "Pictures", "Expectations", "How it was measured", "<canvas"}) {
    EXPECT_FALSE(holds(page, part)) << part;
  }
  EXPECT_TRUE(holds(page, "none are stated"));
}

TEST(BenchPage, StatesTheMachineAndWhatIsUnknown) {
  const std::string page = page_of({}, {.cpu = "Made <up>", .processors = 3, .memory_gib = 7.75, .system = "\xff"});
  for (const char* part : {"Made &lt;up&gt;", ">3<", "7.8 GiB"}) EXPECT_TRUE(holds(page, part)) << part;
  EXPECT_TRUE(holds(page_of({}), "not stated by the system"));
}

TEST(BenchFiles, AreOnePageAndTwoFilesForEachStageAndNoneIfOneIsInTheWay) {
  const test::ScratchDirectory scratch;
  std::vector<MeasuredStage> measured = list_of(stage_of("tone"), stage_of("alpha"));
  add_pair(measured[0], "tone-raw", "tone-done");
  BenchArgs args{.output = scratch.path()};
  InlineExecutor one;
  for (const char* name : {"bench.html", "tone.csv", "alpha.json", "tone-done.png"}) {
    scratch.write(name, "mine");
    const auto refused = write_bench_files(measured, {}, args, one);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::exists);
    EXPECT_EQ(refused.error().where, scratch.file(name));
    EXPECT_EQ(scratch.names().size(), 1u);
    std::filesystem::remove(scratch.file(name));
  }
  scratch.write("bench.html", "old");
  args.force = true;
  const auto written = write_bench_files(measured, {.system = "\xff"}, args, one);
  ASSERT_TRUE(written);
  std::vector<std::string> names;
  for (const std::string& path : *written) names.push_back(std::filesystem::path(path).filename());
  EXPECT_EQ(names, (std::vector<std::string>{"bench.html", "tone.csv", "tone.json", "tone-raw.png", "tone-done.png",
                                             "alpha.csv", "alpha.json"}));
  EXPECT_EQ(scratch.names().size(), names.size());
  EXPECT_TRUE(holds(scratch.read("bench.html"), "tone-raw.png"));
}

TEST(BenchFiles, EveryRowStatesThreadsAndInstructionSet) {
  const test::ScratchDirectory scratch;
  std::vector<MeasuredStage> measured = list_of(stage_of("tone"), stage_of("alpha"));
  measured[0].outcome.threads = 3;
  measured[1].outcome.table.columns = {"level", "error", "threads"};  // its rows differ in them
  InlineExecutor one;
  ASSERT_TRUE(write_bench_files(measured, {.kernels = "AVX9"}, {.output = scratch.path()}, one));
  EXPECT_EQ(scratch.read("tone.csv"),
            "level,error,undominated,threads,instruction set\nfast,2,yes,3,AVX9\nslow,,,3,AVX9\n");
  EXPECT_EQ(scratch.read("alpha.csv"), "level,error,threads,instruction set\nfast,2,yes,AVX9\nslow,,,AVX9\n");
}

TEST(Machine, IsNamedByItsProcessorElseByItsBoard) {
  EXPECT_EQ(cpu_model("processor\t: 0\nmodel\t\t: 85\nmodel name\t: Some CPU @ 2.0 GHz \nmodel name : second\n"),
            "Some CPU @ 2.0 GHz");
  EXPECT_EQ(cpu_model("processor : 0\nCPU part : 0xd08\n\nModel\t: Raspberry Pi 4 Model B Rev 1.4\r\n"),
            "Raspberry Pi 4 Model B Rev 1.4");
  EXPECT_EQ(cpu_model("Model : board\nmodel name : cpu"), "cpu");
  for (const char* none : {"", "\n\n", "model name", "model name :", "model name : \nx", ":", "modelname : x"}) {
    EXPECT_FALSE(cpu_model(none)) << none;
  }
}

TEST(Machine, IsDescribedWithoutProcToo) {
  const test::ScratchDirectory scratch;
  for (const std::string& file : {scratch.file("none"), scratch.path()}) {
    const Machine machine = this_machine(2, file);
    EXPECT_FALSE(machine.cpu);
    EXPECT_GE(machine.processors, 1);
    EXPECT_EQ(machine.threads, 2);
    EXPECT_GT(machine.memory_gib.value_or(0), 0.1);
    for (const std::string& text : {machine.kernels, machine.system, machine.compiler, machine.lowlux}) {
      EXPECT_FALSE(text.empty());
    }
  }
  scratch.write("cpuinfo", "model name : made up\n" + std::string(1 << 20, 'x'));
  EXPECT_EQ(this_machine(1, scratch.file("cpuinfo")).cpu, "made up");
}

}  // namespace
}  // namespace lowlux::cli
