#include <cmath>
#include <cstdint>
#include <string>
#include <utility>

#include "capture/dng/dng_opcodes.h"
#include "capture/dng/dng_tags.h"
#include "capture/dng/opcode_reader.h"
#include "capture/file/pass_on.h"

namespace lowlux::capture {
namespace {

constexpr std::uint32_t map_polynomial = 8, max_degree = 8;

tl::unexpected<Error> refused(ErrorCode code, const std::string& why) {
  return fail(code, "MapPolynomial of the tag OpcodeList2 " + why, tag::opcode_list[1].name);
}

Result<Polynomial> read_polynomial(OpcodeReader in, const Rect& active) {
  const std::uint32_t top = in.u32(), left = in.u32(), bottom = in.u32(), right = in.u32();
  const std::uint32_t first_plane = in.u32(), planes = in.u32(), row_pitch = in.u32(), column_pitch = in.u32();
  const std::uint32_t degree = in.u32();
  if (!in.complete() || degree > max_degree || first_plane > 2) return refused(ErrorCode::malformed, "is damaged");
  const bool whole = top == 0 && left == 0 && bottom >= static_cast<std::uint32_t>(active.height) &&
                     right >= static_cast<std::uint32_t>(active.width) && row_pitch == 1 && column_pitch == 1;
  if (!whole) return refused(ErrorCode::unsupported, "applies to a part of the image, which is not supported");
  Polynomial out{.first_plane = static_cast<int>(first_plane), .planes = planes < 3 ? static_cast<int>(planes) : 3};
  for (std::uint32_t i = 0; i <= degree; ++i) {
    out.coefficient.push_back(in.f64());
    if (!std::isfinite(out.coefficient.back())) return refused(ErrorCode::malformed, "is damaged");
  }
  if (!in.complete()) return refused(ErrorCode::malformed, "is damaged");
  return out;
}

}  // namespace

Result<std::vector<Polynomial>> read_polynomials(std::span<const std::byte> bytes, const Rect& active) {
  std::vector<Polynomial> found;
  if (bytes.empty()) return found;
  auto read = each_opcode(bytes, 2, [&](std::uint32_t id, std::span<const std::byte> parameters) -> Result<void> {
    if (id != map_polynomial) return {};
    return read_polynomial(OpcodeReader(parameters), active).map([&](Polynomial p) { found.push_back(std::move(p)); });
  });
  if (!read) return pass_on(read);
  return found;
}

}  // namespace lowlux::capture
