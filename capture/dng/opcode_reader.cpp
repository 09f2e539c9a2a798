#include "capture/dng/opcode_reader.h"

#include <string>

namespace lowlux::capture {
namespace {

constexpr std::size_t max_opcodes = 64;  // cameras write some
constexpr std::size_t opcode_header_bytes = 16;

}  // namespace

Result<void> each_opcode(std::span<const std::byte> bytes, int list,
                         const std::function<Result<void>(std::uint32_t, std::span<const std::byte>)>& use) {
  const std::string tag = "OpcodeList" + std::to_string(list);
  const auto damaged = [&] { return fail(ErrorCode::malformed, "the tag " + tag + " is damaged", tag); };
  OpcodeReader in(bytes);
  const std::uint32_t count = in.u32();
  if (!in.complete() || count > in.left() / opcode_header_bytes) return damaged();
  if (count > max_opcodes) {
    return fail(ErrorCode::malformed, "the tag " + tag + " holds more opcodes than any camera writes", tag);
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t id = in.u32();
    in.u32();  // the DNG version that introduced it
    in.u32();  // flags: whether a reader may skip it; a skipped opcode becomes a warning in any case
    const auto parameters = in.block(in.u32());
    if (!in.complete()) return damaged();
    if (auto used = use(id, parameters); !used) return used;
  }
  return {};
}

}  // namespace lowlux::capture
