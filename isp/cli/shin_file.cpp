#include "isp/cli/shin_file.h"

#include <cstddef>

#include "capture/file/file_bytes.h"

namespace lowlux::cli {

Result<isp::ShinTable> read_shin_file(const std::string& file) {
  constexpr std::size_t most_bytes = 1 << 20;
  const auto bytes = capture::read_file_bytes(file, most_bytes);
  if (!bytes) return fail(bytes.error().code, bytes.error().message, file);
  auto table = isp::read_shin_table({reinterpret_cast<const char*>(bytes->data()), bytes->size()}, file);
  if (!table) return fail(table.error().code, table.error().message, file);
  return table;
}

}  // namespace lowlux::cli
