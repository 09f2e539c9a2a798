#include "isp/cli/pixel_map.h"

#include <utility>

#include "isp/cli/exit_code.h"
#include "isp/codec/pfm.h"

namespace lowlux::cli {
Result<void> write_map(const PixelMap& map, isp::Overwrite overwrite, isp::Sync sync) {
  auto file = isp::AtomicFile::create(map.path, overwrite, sync);
  if (!file) return tl::make_unexpected(with_file(file.error(), map.path));
  if (const auto written = isp::encode_pfm(map.value.view(), file->file()); !written) {
    return tl::make_unexpected(with_file(written.error(), map.path));
  }
  const auto committed = file->commit();
  if (!committed) return tl::make_unexpected(with_file(committed.error(), map.path));
  return {};
}

}  // namespace lowlux::cli
