#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

namespace lowlux::isp {

/// A point of a tone curve, both values linear and relative to white.
struct CurvePoint {
  double x = 0;
  double y = 0;
};

inline constexpr std::size_t max_curve_points = 8192;

/// Holds the tone curve of a DNG profile (DNG 1.4, ProfileToneCurve) over 0..1, tabulated in even steps of the square
/// root of x, as shadows need more steps than highlights.
struct ProfileCurve {
  static constexpr int steps = 4096;
  int points = 0;                        // points of the file
  std::array<float, steps + 1> value{};  // 0..1
  double mid_grey = 0.18;                // x for which y is 0.18
};

/// Returns y of the natural cubic spline (second derivative 0 at both ends) through points at x within 0..1, for each
/// x of `at`; never outside 0..1. Precondition: as make_profile_curve.
std::vector<double> spline_values(std::span<const CurvePoint> points, std::span<const double> at);

/// Makes the curve of a profile's points. nullopt: fewer than 2 or more than max_curve_points; x or y not within 0..1,
/// x not rising; a first point other than (0, 0) or a last one other than (1, 1).
std::optional<ProfileCurve> make_profile_curve(std::span<const CurvePoint> points);

/// Applies the curve to a colour in linear ProPhoto RGB, in place, without changing its hue: the largest and the
/// smallest channel take the curve, and the third one keeps its place between them (DNG SDK 1.4, RefBaselineRGBTone).
/// Values above 1 are 1; the part of a channel below 0 is added again, as in apply_hue_sat_map.
void apply_profile_curve(const ProfileCurve& curve, float (&rgb)[3]);

}  // namespace lowlux::isp
