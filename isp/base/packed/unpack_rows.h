#pragma once

#include <cstddef>
#include <cstdint>

/// The row kernels under raw_format.h are dispatched at run time. They use plain types only: their source is compiled
/// for several instruction sets, and shared inline code must not be. The contract of unpack_row holds for each.
namespace lowlux::unpack_rows {

void put_bytes(const std::uint8_t* in, std::size_t width, std::uint16_t* out);
void put_little16(const std::uint8_t* in, std::size_t width, std::uint16_t* out);
void put_big16(const std::uint8_t* in, std::size_t width, std::uint16_t* out);
void put_csi2_10(const std::uint8_t* in, std::size_t width, std::uint16_t* out);
void put_csi2_12(const std::uint8_t* in, std::size_t width, std::uint16_t* out);
void put_csi2_14(const std::uint8_t* in, std::size_t width, std::uint16_t* out);
void put_ipu3(const std::uint8_t* in, std::size_t width, std::uint16_t* out);
void put_msb_first_10(const std::uint8_t* in, std::size_t width, std::uint16_t* out);

/// Returns the instruction set in use, for reports and tests.
const char* target_name();

}  // namespace lowlux::unpack_rows
