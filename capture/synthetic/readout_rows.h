#pragma once

#include <cstddef>
#include <cstdint>

#include "isp/base/random/random_rows.h"

/// The row kernels under read_out_row, dispatched at run time. They have plain types only, see
/// isp/base/random/random_rows.h.
namespace lowlux::capture {

struct ReadoutParameters;

/// Pointers to the charge of a row; the last two may be null.
struct ChargePointers {
  const float* mean_e;
  const float* steady_e;
  const float* offset_e;
};

void read_out_floats(const draws::Row& row, const ChargePointers& charge, const ReadoutParameters& parameters,
                     std::size_t count, float* dn);
void read_out_codes(const draws::Row& row, const ChargePointers& charge, const ReadoutParameters& parameters,
                    std::size_t count, std::uint16_t* dn);

}  // namespace lowlux::capture
