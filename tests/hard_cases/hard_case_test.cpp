#include "tests/hard_cases/hard_case.h"

#include <gtest/gtest-spi.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <limits>
#include <string>

// What records the rows: it must fail where a row lacks something.
namespace lowlux::hard_cases {
namespace {

/// Rows of these tests are no part of the page.
class HardCaseRow : public testing::Test {
 protected:
  HardCaseRow() {
    if (const char* const folder = std::getenv("LOWLUX_HARD_CASES")) folder_ = folder;
    unsetenv("LOWLUX_HARD_CASES");  // NOLINT(concurrency-mt-unsafe): no other thread yet
  }
  ~HardCaseRow() override {
    // NOLINTNEXTLINE(concurrency-mt-unsafe): no other thread any more
    if (!folder_.empty()) setenv("LOWLUX_HARD_CASES", folder_.c_str(), 1);
  }

 private:
  std::string folder_;
};

constexpr About about{"none", "a case", "an oracle", "a unit"};

/// All columns but `live`.
void fill(HardCase& row) {
  row.none(Path::reference, no_image)
      .none(levels, no_image)
      .none(instruction_sets, no_image)
      .none(Path::file, no_image);
}

TEST_F(HardCaseRow, FailsWithAnEmptyCell) {
  EXPECT_NONFATAL_FAILURE(
      {
        HardCase row(about);
        fill(row);
      },
      "live is neither measured nor has a reason");
}

void with_error(double kept, double flushed) {
  HardCase row(about);
  fill(row);
  row.on(Path::live, 1, [=](Denormals mode) { return mode == Denormals::kept ? kept : flushed; });
}

TEST_F(HardCaseRow, FailsAboveItsBoundInEitherMode) {
  EXPECT_NONFATAL_FAILURE(with_error(1.01, 1), "denormals kept");
  EXPECT_NONFATAL_FAILURE(with_error(1, 1.01), "denormals flushed");
  EXPECT_NONFATAL_FAILURE(with_error(std::numeric_limits<double>::quiet_NaN(), 1), "denormals kept");
  with_error(1, 1);
}

TEST_F(HardCaseRow, FailsWithAReasonThatSaysNothing) {
  EXPECT_NONFATAL_FAILURE(
      {
        HardCase row(about);
        fill(row);
        row.none(Path::live, "");
      },
      "a case");
}

TEST_F(HardCaseRow, FailsWithACellThatIsThereTwice) {
  EXPECT_NONFATAL_FAILURE(
      {
        HardCase row(about);
        fill(row);
        row.none(Path::live, no_image).none(Path::live, no_image);
      },
      "live is there twice");
}

TEST(WorstError, IsNoNumberOnceOneWasNone) {
  double worst = 0;
  keep_worst(worst, 2);
  keep_worst(worst, 1);
  EXPECT_EQ(worst, 2);
  keep_worst(worst, std::numeric_limits<double>::quiet_NaN());
  keep_worst(worst, 3);
  EXPECT_TRUE(std::isnan(worst));
}

/// Of a product below the normal range, and of one operand there: how many are not 0. Not inlined: the compiler
/// knows nothing of the mode, and would move the products out of it.
[[gnu::noinline]] int survivors() {
  const volatile float small = 1e-30f, smaller = 1e-10f, denormal = 1e-40f, large = 1e10f;
  return (small * smaller != 0 ? 1 : 0) + (denormal * large != 0 ? 1 : 0);
}

TEST(Denormals, AreFlushedInEveryThreadOfThePoolAndKeptAfterwards) {
  PoolExecutor pool(3);
  for (const Denormals mode : {Denormals::flushed, Denormals::kept, Denormals::flushed}) {
    test::ExecutorInMode executor(pool, mode);
    std::array<int, 3> left{};
    executor.run(
        3, [](void* context, int i) { static_cast<int*>(context)[i] = survivors(); }, left.data());
    for (const int n : left) EXPECT_EQ(n, mode == Denormals::kept ? 2 : 0);
    EXPECT_EQ(in_mode(mode, survivors), mode == Denormals::kept ? 2 : 0);
    EXPECT_EQ(survivors(), 2);
  }
}

}  // namespace
}  // namespace lowlux::hard_cases
