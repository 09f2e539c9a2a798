#include "isp/cli/dataset/dataset_settings.h"

#include <array>

namespace lowlux::cli {
namespace {

constexpr std::array all_settings{
    Setting{"size", "--size", SettingKind::text},
    Setting{"light", "--light", SettingKind::text},
    Setting{"luminance_cd_m2", "--luminance", SettingKind::number},
    Setting{"stars", "--stars", SettingKind::whole},
    Setting{"star_luminance_cd_m2", "--star-luminance", SettingKind::number},
    Setting{"gain", "--gain", SettingKind::text},
    Setting{"camera", "--camera", SettingKind::text},
    Setting{"exposure_s", "--exposure", SettingKind::number},
    Setting{"f_number", "--f-number", SettingKind::number},
    Setting{"lens_blur_px", "--lens-blur", SettingKind::number},
    Setting{"temperature_c", "--temperature", SettingKind::number},
    Setting{"cfa", "--cfa", SettingKind::text},
    Setting{"masked_columns", "--masked-columns", SettingKind::even},
    Setting{"effects", "--effects", SettingKind::text},
    Setting{"sampling", "--sampling", SettingKind::text},
    Setting{"sensor_seed", "--sensor-seed", SettingKind::whole},
    Setting{"frames", "--frames", SettingKind::whole},
    Setting{"system_gain_dn_per_e", "--system-gain", SettingKind::number},
    Setting{"read_noise_e", "--read-noise", SettingKind::number},
    Setting{"full_well_e", "--full-well", SettingKind::number},
    Setting{"bits", "--bits", SettingKind::whole},
    Setting{"black_level_dn", "--black-level", SettingKind::number},
    Setting{"white_level_dn", "--white-level", SettingKind::number},
    Setting{"dark_current_e_per_s", "--dark-current", SettingKind::number},
    Setting{"dark_temperature_c", "--dark-temperature", SettingKind::number},
    Setting{"dark_doubling_c", "--dark-doubling", SettingKind::number},
    Setting{"dark_activation_ev", "--dark-activation", SettingKind::number},
    Setting{"dark_floor_e_per_s", "--dark-floor", SettingKind::number},
    Setting{"prnu", "--prnu", SettingKind::number},
    Setting{"dsnu", "--dsnu", SettingKind::number},
    Setting{"hot_pixel_fraction", "--hot-pixels", SettingKind::number},
    Setting{"hot_pixel_current_e_per_s", "--hot-current", SettingKind::number},
    Setting{"telegraph_fraction", "--telegraph-pixels", SettingKind::number},
    Setting{"telegraph_e", "--telegraph-noise", SettingKind::number},
    Setting{"crosstalk", "--crosstalk", SettingKind::number},
    Setting{"glow_e_per_s", "--glow", SettingKind::number},
    Setting{"glow_position", "--glow-position", SettingKind::text},
    Setting{"glow_length", "--glow-length", SettingKind::number},
    Setting{"row_noise_e", "--row-noise", SettingKind::number},
    Setting{"column_noise_e", "--column-noise", SettingKind::number},
    Setting{"pixel_pitch_um", "--pixel-pitch", SettingKind::number},
    Setting{"peak_quantum_efficiency", "--peak-qe", SettingKind::number},
    Setting{"iso", "--iso", SettingKind::number},
    Setting{"quantise", "--quantise", SettingKind::text},
};

}  // namespace

std::span<const Setting> settings() { return all_settings; }

}  // namespace lowlux::cli
