#include "isp/cli/noise/known_noise.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string_view>
#include <system_error>

#include <fmt/format.h>

#include "calib/noise/darktable_noise.h"
#include "calib/noise/raspberry_sensors.h"
#include "calib/noise/sensor_class.h"
#include "capture/file/file_bytes.h"

namespace lowlux::cli {
namespace {

constexpr std::string_view table_name = "/darktable/noiseprofiles.json";

std::string setting_text(const calib::DarktableMatch& match) {
  std::string text = fmt::format("{} at ISO {:g}", match.camera, match.iso);
  if (match.is_beyond) return text + fmt::format(", extrapolated from ISO {:g}", match.low_iso);
  if (match.low_iso < match.high_iso) text += fmt::format(", between {:g} and {:g}", match.low_iso, match.high_iso);
  return text;
}

/// Returns the table's figures of a camera. Errors: the table cannot be read.
Result<std::optional<NoiseOrigin>> origin_in(const std::string& file, const RawDn& raw, double range_dn) {
  const auto bytes = capture::read_file_bytes(file, calib::max_darktable_bytes);
  if (!bytes) return tl::make_unexpected(bytes.error());
  const auto table = calib::parse_darktable_noise({reinterpret_cast<const char*>(bytes->data()), bytes->size()});
  if (!table) return tl::make_unexpected(table.error());
  const auto match = calib::find_darktable_noise(*table, raw.info.make, raw.info.model, *raw.info.iso, range_dn);
  if (!match) return std::nullopt;
  return NoiseOrigin{
      .source = NoiseOrigin::Source::darktable, .basis = setting_text(*match), .figures = match->figures};
}

std::optional<NoiseOrigin> darktable_origin(const RawDn& raw, double range_dn, std::vector<std::string>& warnings) {
  if (!raw.info.iso || raw.info.model.empty()) return std::nullopt;
  for (const std::string& file : darktable_files()) {
    std::error_code absent;
    if (!std::filesystem::is_regular_file(file, absent)) continue;
    auto found = origin_in(file, raw, range_dn);
    if (found) return *std::move(found);
    warnings.push_back(fmt::format("{}: darktable's noise table is not used: {}", file, found.error().message));
  }
  return std::nullopt;
}

}  // namespace

std::vector<std::string> darktable_files() {
  const char* const set = std::getenv("XDG_DATA_DIRS");
  std::string_view folders = set != nullptr && *set != '\0' ? set : "/usr/local/share:/usr/share";
  std::vector<std::string> out;
  while (!folders.empty()) {
    const std::string_view folder = folders.substr(0, folders.find(':'));
    folders.remove_prefix(std::min(folder.size() + 1, folders.size()));
    if (!folder.empty()) out.push_back(std::string(folder) + std::string(table_name));
  }
  out.push_back("/opt/darktable/share" + std::string(table_name));
  out.push_back("/var/lib/flatpak/app/org.darktable.Darktable/current/active/files/share" + std::string(table_name));
  return out;
}

NoiseOrigin known_noise(const RawDn& raw, double range_dn, std::vector<std::string>& warnings) {
  if (auto found = darktable_origin(raw, range_dn, warnings)) return *std::move(found);
  if (raw.info.iso) {
    if (auto found = calib::find_raspberry_noise(raw.info.make, raw.info.model, *raw.info.iso, range_dn)) {
      const std::string setting = fmt::format("{} at analogue gain {:g}", found->sensor, found->analogue_gain);
      return {.source = NoiseOrigin::Source::raspberry_pi, .basis = setting, .figures = found->figures};
    }
  }
  const calib::ClassNoise noise = calib::class_noise(raw, range_dn);
  return {
      .source = NoiseOrigin::Source::sensor_class, .basis = calib::text_of(noise, raw.info), .figures = noise.figures};
}

}  // namespace lowlux::cli
