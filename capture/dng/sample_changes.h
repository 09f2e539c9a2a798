#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "isp/base/correction.h"
#include "isp/base/frame.h"

namespace lowlux::capture {

/// Returns the new value of a sample of the value `value` at column x, row y of a plane.
using SampleFunction = std::function<double(double value, int x, int y, int plane)>;

/// Describes how an opcode changes the samples of an area.
struct SampleChange {
  GainMap area;             // rows, columns and planes; its gains are not used
  SampleFunction function;  // of codes in OpcodeList1, of fractions of white (0 is black) in OpcodeList2
  bool is_delta = false;    // it adds a number, which depends on the place alone
};

/// Returns whether an area includes a sample.
bool includes(const GainMap& area, int x, int y, int plane);

/// Changes the samples of a readout, borders included. Codes are rounded and kept within 0 to 65535 after each change.
void change_readout(const std::vector<SampleChange>& changes, int planes, RawDn& raw);

/// Changes fractions of white of the active area, whose black level is `black`:
/// - If all changes are deltas, samples stay as they are, and deltas are subtracted from the black level: exact,
/// without
///   clipping, and for saturated samples, which have lost their black level, none.
/// - Otherwise floating-point samples are changed, and codes are encoded again in 16 bits, with white at 65535 and a
///   black level that is as far below white as before, 0 for images of three samples. Masked pixels, whose codes do not
///   change, are no longer listed.
/// Returns what is wrong if the changes cannot be applied; nothing is changed then.
std::optional<std::string> change_fractions(const std::vector<SampleChange>& changes, int planes,
                                            const BlackLevel& black, RawDn& raw);

}  // namespace lowlux::capture
