#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "capture/dng/dng_storage.h"
#include "isp/base/frame.h"
#include "isp/base/plane.h"
#include "isp/base/result.h"

namespace lowlux::capture {

/// Returns an error unless the image is a lossy one that decode_lossy_image reads: LinearRaw of 8 bits, with 1 or 3
/// samples, in baseline JPEG (DNG 1.4, Compression 34892), with all of its parts inside the file.
Result<void> check_lossy_image(const TiffDirectory& directory, const DngImage& image, std::size_t file_bytes);

/// Decodes the strips or tiles of a lossy image to its 8-bit codes, height x (width * samples). As other readers do,
/// the markers of each JPEG decide whether it holds RGB or YCbCr. Errors: a part that is not a JPEG of the size of its
/// place, or is damaged.
Result<Plane<std::uint16_t>> decode_lossy_image(std::span<const std::byte> file, const TiffDirectory& directory,
                                                const DngImage& image);

/// Replaces codes of `bits` bits by their values in LinearizationTable, if there is one; those beyond it get its last
/// value. Errors: a damaged table.
Result<void> apply_linearization_table(const TiffDirectory& directory, int bits, Plane<std::uint16_t>& codes);

/// Replaces the codes of a readout, of `bits` bits, by linear samples: LinearizationTable, then the MapPolynomial
/// opcodes of OpcodeList2 (DNG 1.4, chapter 7). With polynomials, samples are 16 bits, black is 0 and white 65535: a
/// polynomial takes (code - black) / (white - black), which it clips to 0..1 before and after.
///
/// Only polynomials of all pixels and all rows and columns are applied, the way in which writers store the curve by
/// which few bits suffice. Errors: a damaged tag, a polynomial of a part of the image, a degree above 8, or one after
/// which a linear value falls. `opcodes` is the directory with OpcodeList2. Without the curve the image would be wrong,
/// so none of these is ignored.
Result<void> linearize_codes(const TiffDirectory& directory, const TiffDirectory& opcodes, int bits, RawDn& raw);

}  // namespace lowlux::capture
