#pragma once

#include <gtest/gtest.h>

#include <clocale>
#include <cstdlib>
#include <string>

#include "tests/support/process.h"
#include "tests/support/scratch_directory.h"

namespace lowlux::test {

/// Makes the C library write and read numbers with a decimal comma, for the lifetime of the object, as in a program
/// under German settings. The locale is made here: machines for tests have none.
class CommaLocale {
 public:
  CommaLocale() {
    const std::string source =
        "LC_NUMERIC\ndecimal_point \"<U002C>\"\nthousands_sep \"\"\ngrouping -1\nEND LC_NUMERIC\n";
    write_file(folder_.file("source"), source.data(), source.size());
    run_process({"localedef", "-c", "--no-archive", "-i", folder_.file("source"), folder_.file("comma")});
    setenv("LOCPATH", folder_.file("").c_str(), 1);
    EXPECT_NE(std::setlocale(LC_NUMERIC, "comma"), nullptr);
    EXPECT_EQ(std::localeconv()->decimal_point, std::string(","));
  }
  ~CommaLocale() {
    std::setlocale(LC_NUMERIC, "C");
    unsetenv("LOCPATH");
  }
  CommaLocale(const CommaLocale&) = delete;
  CommaLocale& operator=(const CommaLocale&) = delete;

 private:
  ScratchDirectory folder_;
};

}  // namespace lowlux::test
