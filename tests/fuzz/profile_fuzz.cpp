// Camera profiles from arbitrary text: what is accepted can be written, and reading that gives the same text again.
#include <cstddef>
#include <cstdint>
#include <string>

#include "calib/profile/profile_io.h"
#include "tests/fuzz/input.h"

using lowlux::test::require;

LOWLUX_FUZZ_TARGET(profile)(const std::uint8_t* data, std::size_t size) {
  const auto profile = lowlux::calib::parse_profile({reinterpret_cast<const char*>(data), size});
  if (!profile) {
    require(!profile.error().message.empty() && profile.error().message.find('\n') == std::string::npos);
    return 0;
  }
  const auto text = lowlux::calib::profile_text(*profile);
  require(text.has_value());
  const auto again = lowlux::calib::parse_profile(*text);
  require(again.has_value());
  require(*lowlux::calib::profile_text(*again) == *text);
  return 0;
}
