#pragma once

#include <cstddef>
#include <cstdint>

/// The row kernels under random.h, dispatched at run time. Plain types only: their sources are compiled for several
/// instruction sets, and shared inline code must not be.
namespace lowlux {
struct DrawStream;
}

namespace lowlux::draws {

/// What the counters of one row have in common, and where it starts.
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

/// The same for words that are there already.
void normals_of_words(const std::uint32_t* r, std::size_t count, float* out);
void poisson_of_words(const std::uint32_t* r, const float* mean, std::size_t count, float* out);

/// Whether this build rounds products before it adds to them, which equal draws everywhere depend on.
bool products_are_rounded();

/// The instruction set in use, for reports and tests.
const char* target_name();

}  // namespace lowlux::draws
