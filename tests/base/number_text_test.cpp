#include "isp/base/text.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <limits>
#include <vector>

#include "isp/base/file_extension.h"
#include "tests/support/comma_locale.h"

namespace lowlux {
namespace {

TEST(HasExtension, IgnoresTheCaseOfAsciiLettersOnly) {
  for (const char* name : {"a.dng", "A.DNG", "b/a.Dng", ".dng"}) EXPECT_TRUE(has_extension(name, ".dng")) << name;
  for (const char* name : {"", "dng", "a.dng.tif", "a-dng", "a.\xC4ng", "a.dn"})
    EXPECT_FALSE(has_extension(name, ".dng")) << name;
}

TEST(NumberText, IsThatOfPrintfWithADecimalPointUnderAnyLocale) {
  const std::vector<double> values = {0,
                                      -0.0,
                                      1,
                                      0.1,
                                      -2.5,
                                      1e-9,
                                      65535,
                                      1234567890123.0,
                                      1e300,
                                      1e-5,
                                      100000,
                                      1.0 / 3,
                                      1e6,
                                      999999.5,
                                      5e-324,
                                      std::numeric_limits<double>::infinity(),
                                      std::numeric_limits<double>::quiet_NaN()};
  for (const int digits : {3, 6, 10, 17}) {
    std::vector<std::string> expected;
    for (const double value : values) {
      char text[40];
      std::snprintf(text, sizeof text, "%.*g", digits, value);
      expected.emplace_back(text);
    }
    const test::CommaLocale comma;
    for (std::size_t i = 0; i < values.size(); ++i) EXPECT_EQ(number_text(values[i], digits), expected[i]);
  }
}

}  // namespace
}  // namespace lowlux
