#pragma once

#include "isp/render/night/eye_rows.h"

namespace lowlux::isp {

/// The tables of the kernels, made at the first call.
const rows::EyeTables& eye_tables();

/// threshold_contrast() by a table over log2 of luminance, its ends beyond.
float tabulated_threshold_contrast(float luminance_cd_m2);

}  // namespace lowlux::isp
