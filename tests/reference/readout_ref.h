#pragma once

#include <cstdint>

#include "capture/synthetic/readout.h"

namespace lowlux::reference {

/// Holds the charge of one pixel for read_out(): read_out_row in double, draws included, those of poisson_ref.h.
struct PixelCharge {
  float mean_e = 0;
  float steady_e = 0;
  float offset_e = 0;
};

struct PixelReadout {
  double dn;         // before it is quantised and clipped
  double result_dn;  // after it is quantised and clipped
  double float_dn;   // how far float arithmetic may be from dn
};

PixelReadout read_out(const PhiloxWords& words, const PixelCharge& charge, const capture::ReadoutParameters& p);

}  // namespace lowlux::reference
