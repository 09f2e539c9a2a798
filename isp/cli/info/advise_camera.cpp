#include "isp/cli/info/advise_camera.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "isp/base/camera_profile.h"
#include "isp/base/executor.h"
#include "isp/base/file_extension.h"
#include "isp/base/text.h"
#include "isp/cli/shared/profile_option.h"
#include "isp/model/colour/camera_colour.h"
#include "isp/model/colour/camera_matrix.h"
#include "isp/model/sensor/noise_budget.h"
#include "isp/model/sensor/scene_luminance.h"
#include "isp/model/sensor/sensor_db.h"
#include "isp/model/spectrum/cie_data.h"
#include "isp/model/spectrum/spectral_data.h"
#include "isp/model/spectrum/spectral_response.h"
#include "isp/pipeline/plan/dark_charge.h"
#include "isp/raw/black_point.h"
#include "isp/raw/to_linear.h"

namespace lowlux::cli {
namespace {

std::string suggestion_for(const std::vector<std::string_view>& near) {
  if (near.empty()) return "`lowlux simulate --list` names them";
  return fmt::format("near it: {}", fmt::join(near, ", "));
}

void add_note(std::vector<std::string>& notes, std::string note) {
  if (std::find(notes.begin(), notes.end(), note) == notes.end()) notes.push_back(std::move(note));
}

/// Notes noise of a sensor that the advice does not include.
void note_unknown(const isp::GainSetting& gain, std::vector<std::string>& notes) {
  const double noise_e = std::hypot(gain.sensor.row_noise_e, gain.sensor.column_noise_e);
  if (noise_e > 0) {
    add_note(notes, fmt::format("the prediction does not include row and column noise of {:.2g} e- at {}", noise_e,
                                gain.name));
  }
}

Result<Spectrum> light_of(const std::string& name) {
  if (auto light = isp::light_named(name)) return *std::move(light);
  return fail(ErrorCode::invalid_argument,
              fmt::format("unknown light '{}'; {}", name, suggestion_for(near_matches(name, isp::light_names()))),
              "--illuminant");
}

isp::Xy white_of(const Spectrum& light) { return *isp::xy_of(isp::xyz_of(light)); }

/// Returns the matrix from camera electrons to XYZ adapted to D65, by the camera's sensitivities.
Result<Matrix3> matrix_of(const std::string& camera, const Spectrum& light) {
  const auto sensitivity = isp::camera_sensitivity(camera);
  if (!sensitivity) {
    return fail(ErrorCode::invalid_argument,
                fmt::format("no spectral sensitivities of '{}' are known; {}", camera,
                            suggestion_for(near_matches(camera, isp::camera_names()))),
                "--camera");
  }
  const auto calibration = isp::fit_calibration(*sensitivity, light, isp::ForwardMatrix::fit);
  if (!calibration) return tl::make_unexpected(calibration.error());
  CameraColour colour;
  colour.calibrations = {*calibration};
  return isp::camera_to_xyz(colour, white_of(light), isp::white_d65);
}

/// Returns the requested gain settings of a sensor. Errors: values of one setting for several.
Result<std::vector<std::string>> settings_of(const AdviseArgs& args) {
  if (!args.gain.empty()) return std::vector<std::string>{args.gain};
  const auto names = isp::gain_settings(args.sensor);
  std::vector<std::string> settings(names.begin(), names.end());
  if (settings.empty()) settings.emplace_back();  // sensor_named() reports the unknown sensor
  const isp::SensorFigures& f = args.figures;
  if (settings.size() > 1 && (f.system_gain_dn_per_e || f.read_noise_e || f.iso)) {
    return fail(ErrorCode::invalid_argument,
                "--system-gain, --read-noise and --iso apply to one gain setting; name it with --gain", args.sensor);
  }
  return settings;
}

bool has_figures(const isp::SensorFigures& f) {
  return f.system_gain_dn_per_e || f.read_noise_e || f.iso || f.full_well_e || f.bits || f.dark_current_e_per_s ||
         f.pixel_pitch_um || f.peak_quantum_efficiency;
}

/// Adds gains of a named sensor. Gains without a value are left out and named; if all are, returns the first error.
Result<void> take_named(const AdviseArgs& args, const Spectrum& light, const isp::Optics& optics, AdviceCase& out) {
  const auto radiance = isp::radiance_of(light, 1);
  std::optional<Error> first_error;
  std::string camera;
  const auto settings = settings_of(args);
  if (!settings) return tl::make_unexpected(settings.error());
  for (const std::string& setting : *settings) {
    const auto sensor = isp::sensor_named(args.sensor, setting, args.figures);
    const auto response = sensor ? isp::spectral_response(*sensor, optics)
                                 : Result<SpectralResponse>(tl::make_unexpected(sensor.error()));
    if (!response) {
      if (!first_error) first_error = response.error();
      if (response.error().code != ErrorCode::insufficient) return tl::make_unexpected(response.error());
      add_note(out.notes, fmt::format("{} is left out: {}", setting, response.error().message));
      continue;
    }
    for (const std::string& assumption : sensor->assumptions)
      add_note(out.notes, "assumed, because there is no published value: " + assumption);
    out.camera = fmt::format("{}, {}", response->name, sensor->source);
    camera = sensor->camera;
    const std::string& name = sensor->gain_setting.empty() ? args.sensor : sensor->gain_setting;
    out.request.gains.push_back({name, sensor->model, isp::electron_rate(*response, *radiance)});
    note_unknown(out.request.gains.back(), out.notes);
  }
  if (out.request.gains.empty()) return tl::make_unexpected(*first_error);
  const auto matrix = matrix_of(camera, light);
  if (!matrix) return tl::make_unexpected(matrix.error());
  out.request.camera_to_xyz = *matrix;
  return {};
}

/// Returns the calibrations of a profile for a light: the one of its name, else all if there are one or two.
Result<CameraColour> colour_of(const CameraProfile& profile, const std::string& light) {
  CameraColour colour;
  for (const ColourProfile& c : profile.colours) {
    if (c.illuminant == light) colour.calibrations = {c.calibration};
  }
  if (!colour.calibrations.empty()) return colour;
  if (profile.colours.size() > 2) {
    std::string names;
    for (const ColourProfile& c : profile.colours) names += (names.empty() ? "" : ", ") + c.illuminant;
    return fail(ErrorCode::insufficient,
                fmt::format("the profile has no colour matrix for {}; use --illuminant with one of {}", light, names));
  }
  colour.calibrations.reserve(profile.colours.size());
  for (const ColourProfile& c : profile.colours) colour.calibrations.push_back(c.calibration);
  std::ranges::sort(colour.calibrations, {}, &ColourCalibration::cct_k);
  return colour;
}

/// Holds the response of a profile's camera to a neutral, largest 1, and its matrix.
struct ProfileColour {
  Vector3 neutral{};
  Matrix3 camera_to_xyz{};
};

Result<ProfileColour> profile_colour(const AdviseArgs& args, const CameraProfile& profile, const Spectrum& light) {
  ProfileColour out;
  if (args.figures.camera || profile.colours.empty()) {
    if (!args.figures.camera) {
      return fail(ErrorCode::insufficient,
                  "the profile has no colour matrix; name a camera with similar sensitivities with --camera");
    }
    const auto matrix = matrix_of(*args.figures.camera, light);
    if (!matrix) return tl::make_unexpected(matrix.error());
    out.camera_to_xyz = *matrix;
    out.neutral = isp::camera_response(*isp::camera_sensitivity(*args.figures.camera), light);
    const double most = std::ranges::max(out.neutral);
    for (double& n : out.neutral) n /= most;
    return out;
  }
  const auto colour = colour_of(profile, args.light);
  if (!colour) return tl::make_unexpected(colour.error());
  const auto neutral = isp::neutral_of_white(*colour, white_of(light));
  if (!neutral) return tl::make_unexpected(neutral.error());
  const auto matrix = isp::camera_to_xyz(*colour, white_of(light), isp::white_d65);
  if (!matrix) return tl::make_unexpected(matrix.error());
  return ProfileColour{*neutral, *matrix};
}

Result<void> take_profile(const AdviseArgs& args, const Spectrum& light, const isp::Optics& optics, AdviceCase& out) {
  if (has_figures(args.figures)) {
    return fail(ErrorCode::invalid_argument, "these values come from the profile; change them there", args.sensor);
  }
  const auto profile = read_profile(args.sensor);
  if (!profile) return tl::make_unexpected(profile.error());
  const auto colour = profile_colour(args, *profile, light);
  if (!colour) return tl::make_unexpected(colour.error());
  out.request.camera_to_xyz = colour->camera_to_xyz;
  out.camera = fmt::format("{}, {}", camera_name(profile->make, profile->model), args.sensor);
  for (const GainProfile& gain : profile->gains) {
    if (!args.gain.empty() && gain.gain_setting != args.gain) continue;
    FrameInfo second;
    second.exposure_s = 1;
    second.f_number = optics.f_number;
    second.iso = gain.iso;
    const auto saturation_cd_m2 =
        optics.white_luminance_cd_m2 ? optics.white_luminance_cd_m2 : isp::saturation_luminance_cd_m2(second);
    if (!gain.sensor || !saturation_cd_m2) {
      add_note(out.notes, fmt::format("{} is left out: the profile has no {}", gain.gain_setting,
                                      gain.sensor ? "ISO speed of it" : "sensor figures of it"));
      continue;
    }
    const double wall_e =
        optics.white_luminance_cd_m2 ? gain.sensor->full_well_e : isp::saturation_charge_e(*gain.sensor);
    Vector3 rate{};
    for (int k = 0; k < 3; ++k) rate[k] = colour->neutral[k] * wall_e / *saturation_cd_m2;
    out.request.gains.push_back({gain.gain_setting, *gain.sensor, rate});
    note_unknown(out.request.gains.back(), out.notes);
  }
  if (out.request.gains.empty()) {
    return fail(ErrorCode::insufficient,
                "no requested gain setting of the profile has sensor figures and an ISO speed; add them with "
                "`calibrate noise`, or give --white-luminance",
                args.sensor);
  }
  return {};
}

Result<void> take_scene(const AdviseArgs& args, const RawFrame* frame, AdviceCase& out) {
  isp::AdviceRequest& r = out.request;
  r.clipped_fraction = args.clipped_fraction.value_or(r.clipped_fraction);
  std::optional<double> midtone = args.midtone_cd_m2, highlight = args.highlight_cd_m2;
  if (frame != nullptr && (!midtone || (!highlight && !args.highlight_ratio))) {
    FrameInfo info = frame->raw.info;
    if (args.f_number) info.f_number = args.f_number;
    const auto seen = raw_luminance(*frame, info, r.clipped_fraction);
    if (!seen) return tl::make_unexpected(seen.error());
    if (!midtone) midtone = seen->median_cd_m2;
    if (!highlight && !args.highlight_ratio) highlight = std::max(seen->highlight_cd_m2, *midtone);
    add_note(out.notes, "luminances of the file are estimated from its f-number, ISO and exposure time");
    if (seen->highlight_clips)
      add_note(out.notes, "the file's highlights are clipped: their luminance is higher than estimated");
  }
  r.midtone_cd_m2 = *midtone;
  r.highlight_cd_m2 = args.highlight_ratio ? *args.highlight_ratio * *midtone : *highlight;
  r.longest_exposure_s = INFINITY;
  if (args.speed_px_per_s) {
    const auto limit = isp::motion_limit_s({*args.speed_px_per_s, *args.blur_px});
    if (!limit) return tl::make_unexpected(limit.error());
    r.longest_exposure_s = *limit;
  }
  if (args.longest_exposure_s) r.longest_exposure_s = std::min(r.longest_exposure_s, *args.longest_exposure_s);
  r.patch_pixels = args.patch_pixels;
  r.frames = args.frames;
  const auto of_file = frame != nullptr ? frame->raw.info.temperature_c : std::nullopt;
  r.temperature_c = args.temperature_c.value_or(of_file.value_or(20));
  if (!args.temperature_c && !of_file) add_note(out.notes, "a sensor temperature of 20 C is assumed");
  return {};
}

}  // namespace

Result<AdviceCase> advice_case(const AdviseArgs& args, const RawFrame* frame) {
  const auto light = light_of(args.light);
  if (!light) return tl::make_unexpected(light.error());
  isp::Optics optics;
  optics.white_luminance_cd_m2 = args.white_luminance_cd_m2;
  if (frame != nullptr && !args.f_number && !frame->raw.info.f_number) {
    return fail(ErrorCode::insufficient, "the file does not state its f-number; give --f-number");
  }
  optics.f_number = args.f_number.value_or(frame != nullptr ? *frame->raw.info.f_number : optics.f_number);
  AdviceCase out;
  if (auto scene = take_scene(args, frame, out); !scene) return tl::make_unexpected(scene.error());
  const bool profile = has_extension(args.sensor, ".json");
  auto camera = profile ? take_profile(args, *light, optics, out) : take_named(args, *light, optics, out);
  if (!camera) return tl::make_unexpected(camera.error());
  return out;
}

namespace {

std::vector<float> green_fractions(const RawDn& raw, const BlackPoint& black) {
  InlineExecutor executor;
  std::vector<float> out;
  if (raw.layout == SensorLayout::linear_rgb) {
    CameraRgb rgb(raw.active.width, raw.active.height);
    isp::to_fraction_rgb(raw, black, rgb.view(), executor);
    out.assign(rgb.plane[1].data(), rgb.plane[1].data() + rgb.plane[1].size());
    return out;
  }
  const RawFraction mosaic = isp::to_fraction(raw, black, executor);
  out.reserve(mosaic.value.size());
  for (int y = 0; y < mosaic.value.height(); ++y) {
    for (int x = 0; x < mosaic.value.width(); ++x) {
      if (raw.layout == SensorLayout::bayer && colour_at(raw.phase, x, y) != CfaColour::green) continue;
      out.push_back(mosaic.value.row(y)[x]);
    }
  }
  return out;
}

/// Returns the value that the fraction `share` of the values exceed.
double exceeded_by(std::vector<float>& values, double share) {
  const auto place = static_cast<std::size_t>((1 - share) * static_cast<double>(values.size() - 1));
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(place);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace

Result<RawLuminance> raw_luminance(const RawFrame& frame, const FrameInfo& info, double share) {
  const auto saturation_cd_m2 = isp::saturation_luminance_cd_m2(info);
  if (!saturation_cd_m2) {
    return fail(ErrorCode::insufficient,
                "the luminance is unknown, because its estimate needs exposure time, f-number and ISO; give "
                "--luminance and --highlight");
  }
  const auto black = isp::choose_black(frame.raw, {});
  if (!black) return tl::make_unexpected(black.error());
  std::vector<float> green = green_fractions(frame.raw, *black);
  if (green.empty()) return fail(ErrorCode::insufficient, "the file has no green pixels; give --luminance");
  constexpr double clipped = 0.995;  // fraction of the range, which leaves room for noise and the last code
  const double highlight = exceeded_by(green, std::clamp(share, 0.0, 1.0));
  const double median = exceeded_by(green, 0.5);
  if (!(median > 0)) {
    return fail(ErrorCode::insufficient, "half of the green pixels are not above black; give --luminance");
  }
  const double white_cd_m2 = isp::light_range_of(frame, {.black = *black}) * *saturation_cd_m2;
  return RawLuminance{median * white_cd_m2, highlight * white_cd_m2, highlight >= clipped};
}

}  // namespace lowlux::cli
