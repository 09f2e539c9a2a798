#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/image.h"
#include "isp/base/matrix3.h"
#include "isp/base/source_tags.h"
#include "isp/render/hue_sat_map.h"
#include "isp/render/profile_curve.h"

namespace lowlux::isp {

/// Holds the tables and the tone curve of the profile in a DNG.
struct ProfileTables {
  std::optional<HueSatMap> low;       // table of the calibration with the lower temperature, or the only one
  std::optional<HueSatMap> high;      // table of the other calibration
  std::optional<HueSatMap> look;      // applied after exposure
  std::optional<ProfileCurve> curve;  // replaces ToneCurve::standard
};

/// States what is read of a profile.
struct ProfileParts {
  bool two_maps = false;   // the file has two calibrations, so that the map of the second may not be absent
  bool with_curve = true;  // false: the tone curve is chosen otherwise
};

/// Reads the tables of a DNG's profile, and its tone curve; null if it has none that change a colour. Left out with a
/// warning is a table whose divisions are not within the limits of hue_sat_map.h, whose values are absent, not FLOAT or
/// not as many as the divisions require, or which has a shift beyond +-360 degrees or a factor not in 0..1000; and the
/// hue and saturation map as a whole if one of its two tables is. The specification requires a factor of value of 1 at
/// saturation 0, so it is read as 1 there. So is a curve that is not valid (make_profile_curve).
std::shared_ptr<const ProfileTables> read_profile_tables(const SourceTags& tags, const ProfileParts& parts,
                                                         std::vector<std::string>& warnings);

/// Returns the map for a white: between two maps linear in the inverse of the correlated colour temperature, as
/// matrices are; absent if there is none.
/// @param weight  weights of the calibration with the higher temperature, 0..1
std::optional<HueSatMap> map_at(const ProfileTables& tables, double weight);

/// Holds the tables in use for a frame. With v a pixel of linear values after exposure, divided by the tone curve's
/// limit, the result is
///     from_prophoto curve(look(map(to_prophoto v / map_scale) map_scale limit)) / limit
/// where a curve is set, limit is 1.
struct ProfileRendering {
  std::optional<HueSatMap> map;
  std::optional<HueSatMap> look;
  std::optional<ProfileCurve> curve;
  Matrix3 to_prophoto = identity3();
  Matrix3 from_prophoto = identity3();
  double map_scale = 1;  // v of a value of 1 before exposure
  double limit = 1;      // value after exposure for v = 1
};

/// Returns the matrix from XYZ under D65 to linear ProPhoto RGB, whose white is D50 (ISO 22028-2).
Matrix3 xyz_to_prophoto();

/// Applies the tables to every pixel; planes have equal size, `out` may be `in`. A sample that is not finite counts as
/// 0.
void apply_profile(const ProfileRendering& profile, const RgbView<const float>& in, const RgbView<float>& out,
                   Executor& executor);

}  // namespace lowlux::isp
