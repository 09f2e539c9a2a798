#include "isp/cli/shared/profile_option.h"

#include <string_view>
#include <utility>

#include "calib/profile/profile_io.h"
#include "calib/profile/profile_use.h"
#include "capture/file/file_bytes.h"
#include "isp/output/report/report.h"

namespace lowlux::cli {
namespace {

void use_colours(const CameraProfile& profile, RawFrame& frame) {
  if (profile.colours.empty()) return;
  frame.colour.calibrations = calib::calibrations_of(profile);
  frame.colour.analog_balance = {1, 1, 1};  // the matrices were fitted to the camera's unscaled values
  frame.colour.source = CameraColour::Source::profile;
}

}  // namespace

Result<void> use_profile(const CameraProfile& profile, const ProfileChoice& choice, RawFrame& frame,
                         isp::DevelopOptions& options) {
  isp::BlackRequest& black = options.black;
  auto found = calib::profile_at(profile, frame.raw, choice.gain_setting);
  if (!found) return tl::make_unexpected(found.error());
  const bool knows_dark = found->dark_mean_e != PerSite<double>{};
  if (!found->black && !knows_dark && !choice.everything) {
    return fail(ErrorCode::insufficient,
                "the profile holds no black level and no dark current: add them with `calibrate black --add-to`, "
                "or use what else it holds with --profile");
  }
  if (!found->black && knows_dark) {  // the pedestal is the file's
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
  if (found->noise) {
    frame.noise = found->noise;
    frame.noise->source = NoiseProfile::Source::profile;
  }
  auto& defects = frame.corrections.defects;
  defects.insert(defects.end(), found->hot_pixels.begin(), found->hot_pixels.end());
  frame.warnings.insert(frame.warnings.end(), found->warnings.begin(), found->warnings.end());
  if (choice.everything) use_colours(profile, frame);
  return {};
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
