// Files that state the noise of cameras, from arbitrary text: darktable's table and a tuning file of libcamera. What is
// accepted is within the stated limits, and its noise is one that a sensor can have.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "calib/noise/darktable_noise.h"
#include "calib/noise/raspberry_tuning.h"
#include "calib/profile/profile_io.h"
#include "tests/fuzz/input.h"

using lowlux::test::require;

namespace {

void require_possible(const lowlux::calib::NoiseFigures& figures) {
  require(std::isfinite(figures.gain_dn_per_e) && figures.gain_dn_per_e > 0);
  require(std::isfinite(figures.read_noise_e) && figures.read_noise_e >= 0);
  require(figures.gain_factor >= 1 && figures.read_noise_factor >= 1);
}

void read_table(std::string_view text) {
  const auto table = lowlux::calib::parse_darktable_noise(text);
  if (!table) return require(!table.error().message.empty());
  require(!table->empty() && table->size() <= lowlux::calib::max_darktable_cameras);
  for (const lowlux::calib::DarktableCamera& camera : *table) {
    const auto not_above = [](const auto& a, const auto& b) { return b.iso <= a.iso; };
    require(std::ranges::adjacent_find(camera.settings, not_above) == camera.settings.end());
    for (const double iso : {50.0, 800.0, 1e5}) {
      const auto match = find_darktable_noise(*table, camera.maker, camera.model, iso, 16383 - 512);
      if (match) require_possible(match->figures);
    }
  }
}

void read_tuning(std::string_view text) {
  const auto tuning = lowlux::calib::parse_raspberry_tuning(text);
  if (!tuning) return require(!tuning.error().message.empty());
  const auto profile = profile_of_tuning(*tuning, {.name = "imx477", .bits = 12, .max_gain = 16, .source = "file"});
  if (!profile) return require(!profile.error().message.empty());  // figures that no sensor has
  const auto written = lowlux::calib::profile_text(*profile);
  require(written && lowlux::calib::parse_profile(*written));
}

}  // namespace

LOWLUX_FUZZ_TARGET(noise_files)(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  read_table(text);
  read_tuning(text);
  return 0;
}
