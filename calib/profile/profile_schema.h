#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "isp/base/camera_profile.h"
#include "isp/base/result.h"

namespace lowlux::calib {

inline constexpr const char* profile_format = "lowlux camera profile";

/// The first failure; what follows is skipped.
struct ProfileFailure {
  std::optional<Error> error;
  void set(ErrorCode code, const std::string& path, const std::string& what);
};

/// Return "path.key" and "path[i]".
std::string joined(const std::string& path, const std::string& key);
std::string indexed(const std::string& path, std::size_t i);

/// Range of values of a key, ends included.
struct Range {
  double low = 0;
  double high = 1e9;
};

/// Returns whether the value lies in the range; if not, or if it is NaN, sets `failure`.
bool check_range(double value, const Range& range, const std::string& path, ProfileFailure& failure);

/// Checks what no single key can show: values of a sensor that contradict each other.
void check_together(const CameraProfile& profile, ProfileFailure& failure);

inline constexpr double tiny = 1e-12;  // stands for "above 0"
inline constexpr std::size_t max_gains = 256, max_hot_pixels = 100000, max_files = 10000, max_provenance = 64,
                             max_colours = 64;
inline constexpr Range matrix_entries{-1e3, 1e3};

/// Visits the profile's keys in order, once for reading and writing. A visitor offers
///     text(key, string)               number(key, double, range)       integer(key, int, range)
///     optional_number(key, optional)  estimate(key, value, standard error, range)
///     choice(key, enum, names)        object(key, fn)                  optional_object(key, optional, fn)
///     matrix(key, Matrix3)            list(key, container, most, fn)
/// each of which does nothing once something has failed.
template <class Visitor, class Sensor, class Errors>
void visit_sensor(Visitor& v, Sensor& s, Errors& e) {
  v.text("name", s.name);
  v.estimate("system_gain_dn_per_e", s.system_gain_dn_per_e, e.system_gain_dn_per_e, {tiny, 1e6});
  v.estimate("read_noise_e", s.read_noise_e, e.read_noise_e, {});
  v.estimate("full_well_e", s.full_well_e, e.full_well_e, {tiny, 1e6});
  v.integer("bits", s.bits, {1, 16});
  v.number("black_level_dn", s.black_level_dn, {0, 65535});
  v.number("white_level_dn", s.white_level_dn, {0, 65535});
  v.choice("quantisation", s.quantisation, {"round", "floor"});
  v.estimate("dark_current_red_e_per_s", s.dark_current_e_per_s[0], e.dark_current_e_per_s[0], {});
  v.estimate("dark_current_green_e_per_s", s.dark_current_e_per_s[1], e.dark_current_e_per_s[1], {});
  v.estimate("dark_current_blue_e_per_s", s.dark_current_e_per_s[2], e.dark_current_e_per_s[2], {});
  v.number("dark_temperature_c", s.dark_temperature_c, {-200, 200});
  v.estimate("dark_doubling_c", s.dark_doubling_c, e.dark_doubling_c, {1, 1000});
  v.estimate("prnu", s.prnu, e.prnu, {0, 1});
  v.estimate("dsnu", s.dsnu, e.dsnu, {0, 1});
  v.number("hot_pixel_fraction", s.hot_pixel_fraction, {0, 1});
  v.number("hot_pixel_current_e_per_s", s.hot_pixel_current_e_per_s, {});
  v.number("row_noise_e", s.row_noise_e, {});
  v.number("column_noise_e", s.column_noise_e, {});
}

template <class Visitor, class Source>
void visit_provenance(Visitor& v, Source& p) {
  v.choice("kind", p.kind, {"measured", "quoted"});
  v.text("figures", p.figures);
  v.text("source", p.source);
  v.text("date", p.date);
  v.texts("files", p.files, max_files);
  v.number("reduced_chi_square", p.reduced_chi_square, {});
  v.integer("degrees_of_freedom", p.degrees_of_freedom, {0, 1e9});
}

template <class Visitor, class Measured>
void visit_range(Visitor& v, Measured& r, const Range& possible) {
  v.number("low", r.low, possible);
  v.number("high", r.high, possible);
}

template <class Visitor, class Gain>
void visit_gain(Visitor& v, Gain& g) {
  v.text("gain_setting", g.gain_setting);
  v.optional_number("iso", g.iso, {tiny, 1e9});
  v.optional_object("sensor", g.sensor, [&](Visitor& inner, auto& sensor) { visit_sensor(inner, sensor, g.errors); });
  v.optional_object("pedestal_dn", g.pedestal_dn, [](Visitor& inner, auto& pedestal) {
    inner.estimate("site_00", pedestal[0].value, pedestal[0].standard_error, {-1, 65535});
    inner.estimate("site_01", pedestal[1].value, pedestal[1].standard_error, {-1, 65535});
    inner.estimate("site_10", pedestal[2].value, pedestal[2].standard_error, {-1, 65535});
    inner.estimate("site_11", pedestal[3].value, pedestal[3].standard_error, {-1, 65535});
  });
  v.choice("pedestal_holds", g.pedestal_holds, {"pedestal", "pedestal and dark"});
  v.optional_object("dark_exposure_s", g.dark_exposure_s,
                    [](Visitor& inner, auto& range) { visit_range(inner, range, {}); });
  v.optional_object("dark_temperature_c", g.dark_temperature_c, [](Visitor& inner, auto& range) {
    visit_range(inner, range, {-200, 200});
  });
  v.optional_object("dark_chromaticity", g.dark_chromaticity, [](Visitor& inner, auto& share) {
    inner.estimate("red", share[0].value, share[0].standard_error, {-10, 10});
    inner.estimate("green", share[1].value, share[1].standard_error, {-10, 10});
    inner.estimate("blue", share[2].value, share[2].standard_error, {-10, 10});
  });
  v.list("hot_pixels", g.hot_pixels, max_hot_pixels, [](Visitor& inner, auto& hot) {
    inner.integer("x_px", hot.x, {0, 1e6});
    inner.integer("y_px", hot.y, {0, 1e6});
    inner.number("excess_e_per_s", hot.excess_e_per_s, {});
  });
  v.list("provenance", g.provenance, max_provenance, [](Visitor& inner, auto& p) { visit_provenance(inner, p); });
}

template <class Visitor, class Colour>
void visit_colour(Visitor& v, Colour& c) {
  v.text("illuminant", c.illuminant);
  v.number("cct_k", c.calibration.cct_k, {0, 1e6});
  v.matrix("xyz_to_camera", c.calibration.xyz_to_camera);
  v.optional_object("forward", c.calibration.forward,
                    [](Visitor& inner, auto& forward) { inner.matrix("balanced_camera_to_xyz_d50", forward); });
  v.optional_number("patches_ciede2000", c.patches_ciede2000, {});
  v.optional_number("cross_validated_ciede2000", c.cross_validated_ciede2000, {});
  v.optional_number("condition_number", c.condition_number, {1, 1e300});
  v.optional_object("scotopic_weights", c.scotopic_weights, [](Visitor& inner, auto& weight) {
    inner.number("red", weight[0], matrix_entries);
    inner.number("green", weight[1], matrix_entries);
    inner.number("blue", weight[2], matrix_entries);
  });
  v.object("provenance", [&](Visitor& inner) { visit_provenance(inner, c.provenance); });
}

template <class Visitor, class Profile>
void visit_profile(Visitor& v, Profile& p) {
  v.text("make", p.make);
  v.text("model", p.model);
  v.text("mosaic", p.mosaic);
  v.list("gains", p.gains, max_gains, [](Visitor& inner, auto& gain) { visit_gain(inner, gain); });
  v.list("colours", p.colours, max_colours, [](Visitor& inner, auto& colour) { visit_colour(inner, colour); });
}

}  // namespace lowlux::calib
