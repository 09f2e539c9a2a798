#include "isp/cli/shared/profile_option.h"

#include <algorithm>
#include <optional>
#include <string_view>
#include <utility>

#include "calib/profile/profile_io.h"
#include "capture/file/file_bytes.h"
#include "isp/base/text.h"
#include "isp/model/sensor/sensor_db.h"
#include "isp/output/report/report.h"
#include "isp/pipeline/plan/plan_develop.h"

namespace lowlux::cli {
namespace {

/// Returns the weights that a profile holds for the rods under a light.
std::optional<Vector3> rod_weights_of(const CameraProfile& profile, const isp::SceneLight& light) {
  const auto found = std::ranges::find_if(profile.colours, [&](const ColourProfile& colour) {
    return colour.scotopic_weights && std::ranges::equal(colour.illuminant, light.name, {}, ascii_lower, ascii_lower);
  });
  return found == profile.colours.end() ? std::nullopt : found->scotopic_weights;
}

void use_colours(const CameraProfile& profile, RawFrame& frame, isp::LookChoice& look) {
  if (profile.colours.empty()) return;
  if (look.light) look.rod_weights = rod_weights_of(profile, *look.light);
  frame.colour.calibrations = calib::calibrations_of(profile);
  frame.colour.analog_balance = {1, 1, 1};  // the matrices were fitted to the camera's unscaled values
  frame.colour.source = CameraColour::Source::profile;
}

/// Sets the noise of the profile, relative to the black point that is going to be subtracted.
void set_noise(const calib::ProfileAtFrame& found, const ProfileChoice& choice, const isp::BlackRequest& request,
               RawFrame& frame) {
  const bool is_clean_raw = frame.noise && frame.noise->reduced;  // its noise is not that of the sensor
  if (!found.noise || is_clean_raw) return;
  frame.noise = found.noise;
  if (!choice.with_darks) {
    const Result<BlackPoint> black = isp::choose_black_by_gain(frame, request);
    const auto above = black ? calib::noise_above(*black, found, frame.raw) : std::nullopt;
    if (above) frame.noise = above;
  }
  frame.noise->source = NoiseProfile::Source::profile;
}

/// Returns the camera of a profile: by its make and model, or by the name of its sensor; empty if it states neither.
std::string camera_of(const CameraProfile& profile) {
  if (!profile.make.empty() || !profile.model.empty()) return camera_name(profile.make, profile.model);
  if (profile.gains.empty() || !profile.gains.front().sensor) return {};
  return std::string(isp::own_camera(profile.gains.front().sensor->name));
}

}  // namespace

Result<calib::ProfileAtFrame> use_profile(const CameraProfile& profile, const ProfileChoice& choice, RawFrame& frame,
                                          isp::DevelopOptions& options) {
  isp::BlackRequest& black = options.black;
  auto found = calib::profile_at(profile, frame.raw, choice.gain_setting);
  if (!found) return found;
  const bool knows_dark = found->dark_mean_e != PerSite<double>{};
  if (frame.raw.is_float() && !choice.everything) {
    return fail(ErrorCode::unsupported,
                "the profile's black level applies to integer codes, but the frame has floating-point samples");
  }
  if (!found->black && !knows_dark && !choice.everything) {
    return fail(ErrorCode::insufficient,
                "the profile has no black level and no dark current: add them with `calibrate black --add-to`, or use "
                "its other values with --profile");
  }
  if (knows_dark) {  // for a pedestal of the file or of the user, which does not include it
    for (int site = 0; site < 4; ++site) {
      black.dark_dn[site] = found->sensor->system_gain_dn_per_e * found->dark_mean_e[site];
    }
  }
  if (found->black) {
    black.measured = *found->black;
    const bool is_asked_for = !choice.everything;
    if (is_asked_for && black.choice == isp::BlackChoice::automatic) black.choice = isp::BlackChoice::measured;
  }
  options.look.profile_iso = found->iso;
  options.look.camera = camera_of(profile);
  set_noise(*found, choice, black, frame);
  auto& defects = frame.corrections.defects;
  defects.insert(defects.end(), found->hot_pixels.begin(), found->hot_pixels.end());
  frame.warnings.insert(frame.warnings.end(), found->warnings.begin(), found->warnings.end());
  if (choice.everything) use_colours(profile, frame, options.look);
  return found;
}

Result<CameraProfile> read_profile(const std::string& path) {
  const auto bytes = capture::read_file_bytes(path, calib::largest_profile_bytes);
  if (!bytes) return tl::make_unexpected(bytes.error());
  auto profile = calib::parse_profile(std::string_view(reinterpret_cast<const char*>(bytes->data()), bytes->size()));
  if (!profile) profile.error().where = path;  // the message includes the key's path
  return profile;
}

Result<void> write_profile(const std::string& path, const CameraProfile& profile, isp::Overwrite overwrite) {
  const auto text = calib::profile_text(profile);
  if (!text) return fail(text.error().code, text.error().message, path);
  return isp::write_text(path, *text, overwrite);
}

}  // namespace lowlux::cli
