#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "isp/base/image.h"
#include "isp/base/plane.h"
#include "isp/base/result.h"
#include "isp/output/atomic_file.h"

namespace lowlux::cli {

/// Lists the types of elements, in the order of their sizes; all are little-endian.
enum class ElementType : std::uint8_t { u8, u16, f32 };

/// Describes an array whose last index is the fastest.
struct ArrayEntry {
  std::string name;  // .npy has none
  ElementType type = ElementType::u8;
  std::vector<std::size_t> shape;
};

/// Returns the size of an array [bytes].
std::size_t bytes_of(const ArrayEntry& array);

/// Borrows the bytes of a plane.
template <class T>
std::span<const std::byte> bytes_of(const Plane<T>& plane) {
  return std::as_bytes(std::span(plane.data(), plane.size()));
}

/// Returns the samples of an image in the order of an array of height x width x 3, that of images in NumPy.
Plane<float> interleaved(const SceneLinear& picture);

/// Writes a file of arrays in parts of any order, completely or not at all. An existing file is replaced.
/// Errors: those of AtomicFile; a full disk.
class ArrayFile {
 public:
  /// Creates an array for NumPy (.npy, format 1.0 of numpy.lib.format).
  static Result<ArrayFile> create_npy(const std::string& path, const ArrayEntry& array);

  /// Creates a file of named arrays (safetensors, "Format" in its README): the length of the header in 64 bits, the
  /// header as JSON, filled with blanks to a multiple of 8 bytes, and the arrays without gaps. They are stored in the
  /// order of their element sizes, largest first, so that each is aligned.
  /// @param metadata  texts by their names: __metadata__
  static Result<ArrayFile> create_safetensors(const std::string& path, std::span<const ArrayEntry> arrays,
                                              const std::map<std::string, std::string>& metadata);

  /// Writes bytes of an array from one of its bytes on.
  /// @param array  its index among those of the file
  Result<void> put(std::size_t array, std::size_t from, std::span<const std::byte> bytes);

  /// Gives the file its name. Call it once, after all bytes of all arrays.
  Result<void> commit() { return file_.commit(); }

 private:
  ArrayFile(isp::AtomicFile file, std::string path, std::vector<std::size_t> begins)
      : file_(std::move(file)), path_(std::move(path)), begins_(std::move(begins)) {}
  static Result<ArrayFile> create(const std::string& path, std::string_view header, std::vector<std::size_t> begins);

  isp::AtomicFile file_;
  std::string path_;
  std::vector<std::size_t> begins_;  // starts of the arrays in the file
};

/// Writes one array for NumPy.
Result<void> write_npy(const std::string& path, const ArrayEntry& array, std::span<const std::byte> bytes);

}  // namespace lowlux::cli
