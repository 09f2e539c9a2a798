#pragma once

#include "isp/render/night/eye_rows.h"

namespace lowlux::isp {

/// Returns the tables of the kernels, made at the first call.
const rows::EyeTables& eye_tables();

/// Returns threshold_contrast() from a table over log2 of luminance, constant beyond its ends.
float tabulated_threshold_contrast(float luminance_cd_m2);

}  // namespace lowlux::isp
