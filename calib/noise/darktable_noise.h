#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "calib/noise/noise_figures.h"
#include "isp/base/result.h"

/// Reads the table of noise that darktable installs, noiseprofiles.json. Its figures are under the GPL: lowlux reads
/// them where the user's own darktable has installed them, and contains none of them.
namespace lowlux::calib {

/// Holds the entry of one camera at one ISO setting: variance = a x + b of the green channel, x from 0 at black to 1 at
/// white, as darktable measured it.
struct DarktableNoise {
  double iso = 0;
  double a = 0;
  double b = 0;  // may be below 0
};

/// Names a camera of darktable's noise table, with its noise by ISO.
struct DarktableCamera {
  std::string maker;
  std::string model;
  std::vector<DarktableNoise> settings;  // by rising ISO, each once
};

using DarktableTable = std::vector<DarktableCamera>;

/// Limits of a table, several times what darktable 5 installs; the parser keeps no more than these.
inline constexpr std::size_t max_darktable_bytes = std::size_t{16} << 20;
inline constexpr std::size_t max_darktable_cameras = 5000, max_darktable_settings = 100'000;

/// Parses the file. Entries that darktable itself skips ("skip": true), without an ISO, or with figures that are not
/// those of a noise are left out; keys that are not known are ignored. Memory is bounded by the limits above.
/// Errors: more bytes, cameras or settings than the limits; text that is not JSON, or deeper than 16 levels; no camera.
Result<DarktableTable> parse_darktable_noise(std::string_view json);

/// Holds what the table states of one camera at the ISO of a frame.
struct DarktableMatch {
  NoiseFigures figures;
  std::string camera;      // maker and model as the table has them
  double iso = 0;          // ISO of the frame
  double low_iso = 0;      // entries that were used, equal if it is one
  double high_iso = 0;     //
  bool is_beyond = false;  // the frame's ISO is outside of the entries: extrapolated
};

/// darktable's a and b are those of the finest diagonal Haar detail of images that its profiling tool has demosaiced,
/// so that they are smaller than the variance of a raw pixel: by 4 for the detail, which is not normalised, and again
/// for the interpolation of green. The quotient of green's a and 1 / electrons at white is 0.11 in the geometric mean
/// of seven cameras measured by others, with a factor of 1.30 between cameras; see calib/README.md.
inline constexpr double darktable_a_of_variance = 0.11;
inline constexpr double darktable_gain_factor = 1.3;

/// Returns the camera's noise at an ISO. Names match where letters and digits are equal in any case, the maker's name
/// before the model, "Digital" after it and names of other regions disregarded. Between two entries ln a and ln b are
/// interpolated over ln ISO; beyond them a follows the ISO and b its square, with a larger uncertainty. Where b is not
/// above 0 or contradicts the class of the sensor, the read noise is that of the class (sensor_class.h).
/// @param range_dn  white less black of the frame
/// @return nullopt: the camera is not in the table, or the ISO is more than 8 times beyond its entries
std::optional<DarktableMatch> find_darktable_noise(const DarktableTable& table, std::string_view make,
                                                   std::string_view model, double iso, double range_dn);

}  // namespace lowlux::calib
