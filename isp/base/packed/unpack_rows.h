#pragma once

#include <cstddef>
#include <cstdint>

/// The row kernels under unpack.h, dispatched at run time. Plain types only: their source is compiled for several
/// instruction sets, and shared inline code must not be. What unpack_row promises holds for each.
namespace lowlux::unpack_rows {

void put_bytes(const std::uint8_t* in, std::size_t width, std::uint16_t* out);
void put_little16(const std::uint8_t* in, std::size_t width, std::uint16_t* out);
void put_big16(const std::uint8_t* in, std::size_t width, std::uint16_t* out);
void put_csi2_10(const std::uint8_t* in, std::size_t width, std::uint16_t* out);
void put_csi2_12(const std::uint8_t* in, std::size_t width, std::uint16_t* out);
void put_csi2_14(const std::uint8_t* in, std::size_t width, std::uint16_t* out);
void put_ipu3(const std::uint8_t* in, std::size_t width, std::uint16_t* out);
void put_msb_first_10(const std::uint8_t* in, std::size_t width, std::uint16_t* out);

/// The instruction set in use, for reports and tests.
const char* target_name();

}  // namespace lowlux::unpack_rows
