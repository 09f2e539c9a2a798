#pragma once

#include "isp/render/retarget/retarget_table.h"

/// This header declares what isp/render/retarget/retarget_table.h promises, written to be read against its source.
namespace lowlux::reference {

/// Interpolates tetrahedrally, the six cases spelled out (Kasson, Nin, Plouffe & Hafner 1995, table 1).
/// @param code  0..1
Vector3 looked_up(const isp::RetargetTable& table, const Vector3& code);

}  // namespace lowlux::reference
