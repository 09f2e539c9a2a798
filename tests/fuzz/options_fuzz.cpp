// Values of options from arbitrary text: numbers are finite and those the text says, lists are as long as allowed.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "isp/cli/shared/option_values.h"
#include "tests/fuzz/input.h"

using lowlux::test::require;

LOWLUX_FUZZ_TARGET(options)(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  if (const auto number = lowlux::cli::number_of(text)) {
    require(std::isfinite(*number));
    require(std::strtod(text.c_str(), nullptr) == *number);
  }
  constexpr std::size_t most = 4;
  if (const auto numbers = lowlux::cli::numbers_of(text, most)) {
    require(!numbers->empty() && numbers->size() <= most);
    for (const double number : *numbers) require(std::isfinite(number));
  }
  std::string joined;
  for (const std::string& word : lowlux::cli::split_at_commas(text)) {
    require(word.find(',') == std::string::npos);
    joined += word;
  }
  require(joined.size() <= text.size());
  return 0;
}
