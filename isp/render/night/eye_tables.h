#pragma once

#include "isp/render/night/eye_rows.h"

namespace lowlux::isp {

/// Returns the tables of the kernels, made at the first call.
const rows::EyeTables& eye_tables();

}  // namespace lowlux::isp
