#include "isp/cli/dataset/array_file.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cstdio>
#include <functional>
#include <numeric>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "isp/base/json_text.h"
#include "isp/cli/shared/exit_code.h"
#include "isp/codec/picture_file.h"

namespace lowlux::cli {
namespace {

static_assert(std::endian::native == std::endian::little);

struct ElementFormat {
  std::size_t bytes;
  const char* npy;
  const char* safetensors;
};

const ElementFormat& format_of(const ArrayEntry& array) {
  static constexpr ElementFormat formats[] = {{1, "|u1", "U8"}, {2, "<u2", "U16"}, {4, "<f4", "F32"}};
  return formats[static_cast<int>(array.type)];
}

/// Returns a number as its lowest bytes, little-endian.
std::string little_endian(std::uint64_t number, int bytes) {
  std::string out;
  for (int i = 0; i < bytes; ++i) out += static_cast<char>(number >> (8 * i) & 255);
  return out;
}

void fill(std::string& header, std::size_t before, std::size_t multiple) {
  header.append((multiple - (before + header.size()) % multiple) % multiple, ' ');
}

/// Returns the header of NumPy's format 1.0, filled with blanks to a multiple of 64 bytes.
std::string npy_header(const ArrayEntry& array) {
  constexpr std::size_t before = 10, newline = 1;
  std::string text = fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': ({}{}), }}", format_of(array).npy,
                                 fmt::join(array.shape, ", "), array.shape.size() == 1 ? "," : "");
  fill(text, before + newline, 64);
  text += '\n';
  return "\x93NUMPY" + little_endian(1, 2) + little_endian(text.size(), 2) + text;
}

Result<void> write(std::FILE* file, const std::string& path, std::span<const std::byte> bytes) {
  return isp::write_bytes(file, bytes).map_error([&](Error error) { return with_file(std::move(error), path); });
}

}  // namespace

std::size_t bytes_of(const ArrayEntry& array) {
  return std::accumulate(array.shape.begin(), array.shape.end(), format_of(array).bytes, std::multiplies<>());
}

Plane<float> interleaved(const SceneLinear& picture) {
  Plane<float> out(3 * picture.width(), picture.height());
  for (int y = 0; y < picture.height(); ++y) {
    float* row = out.row(y);
    for (int c = 0; c < 3; ++c) {
      const float* from = picture.plane[static_cast<std::size_t>(c)].row(y);
      for (int x = 0; x < picture.width(); ++x) row[3 * x + c] = from[x];
    }
  }
  return out;
}

Result<ArrayFile> ArrayFile::create(const std::string& path, std::string_view header, std::vector<std::size_t> begins) {
  auto file = isp::AtomicFile::create(path, isp::Overwrite::yes);
  if (!file) return tl::make_unexpected(file.error());
  const auto written = write(file->file(), path, std::as_bytes(std::span(header)));
  if (!written) return tl::make_unexpected(written.error());
  return ArrayFile(*std::move(file), path, std::move(begins));
}

Result<ArrayFile> ArrayFile::create_npy(const std::string& path, const ArrayEntry& array) {
  const std::string header = npy_header(array);
  return create(path, header, {header.size()});
}

Result<ArrayFile> ArrayFile::create_safetensors(const std::string& path, std::span<const ArrayEntry> arrays,
                                                const std::map<std::string, std::string>& metadata) {
  std::vector<std::size_t> order(arrays.size()), begins(arrays.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, std::greater(), [&](std::size_t i) { return arrays[i].type; });
  nlohmann::ordered_json json{{"__metadata__", metadata}};
  std::size_t end = 0;
  for (const std::size_t i : order) {
    begins[i] = end;
    end += bytes_of(arrays[i]);
    json[arrays[i].name] = {
        {"dtype", format_of(arrays[i]).safetensors}, {"shape", arrays[i].shape}, {"data_offsets", {begins[i], end}}};
  }
  constexpr int before = 8;
  std::string text = json_text(json);
  fill(text, before, 8);
  for (std::size_t& begin : begins) begin += before + text.size();
  return create(path, little_endian(text.size(), before) + text, std::move(begins));
}

Result<void> ArrayFile::put(std::size_t array, std::size_t from, std::span<const std::byte> bytes) {
  assert(array < begins_.size());
  if (fseeko(file_.file(), static_cast<off_t>(begins_[array] + from), SEEK_SET) != 0) {
    return tl::make_unexpected(with_file(isp::write_failure().value(), path_));
  }
  return write(file_.file(), path_, bytes);
}

Result<void> write_npy(const std::string& path, const ArrayEntry& array, std::span<const std::byte> bytes) {
  assert(bytes.size() == bytes_of(array));
  return ArrayFile::create_npy(path, array).and_then([&](ArrayFile file) {
    return file.put(0, 0, bytes).and_then([&] { return file.commit(); });
  });
}

}  // namespace lowlux::cli
