#pragma once

#include <cstddef>
#include <cstdint>

/// The row kernels under random.h are dispatched at run time. They use plain types only: their sources are compiled for
/// several instruction sets, and shared inline code must not be.
namespace lowlux {
struct DrawStream;
}

namespace lowlux::draws {

/// Holds the common counter values of one row, and its first column.
struct Row {
  std::uint32_t x0;
  std::uint32_t y;
  std::uint32_t frame;
  std::uint32_t purpose;
  std::uint32_t key[2];
};

Row row_of(const DrawStream& stream, std::uint32_t x0, std::uint32_t y);

void put_words(const Row& row, int word, std::size_t count, std::uint32_t* out);
void put_normals(const Row& row, int word, std::size_t count, float* out);
void put_poisson(const Row& row, const float* mean, std::size_t count, float* out);

/// Both functions convert words that already exist.
void normals_of_words(const std::uint32_t* r, std::size_t count, float* out);
void poisson_of_words(const std::uint32_t* r, const float* mean, std::size_t count, float* out);

/// Returns whether this build rounds products before adding to them, which bit-identical draws on all machines require.
bool products_are_rounded();

/// Returns the instruction set in use, for reports and tests.
const char* target_name();

}  // namespace lowlux::draws
