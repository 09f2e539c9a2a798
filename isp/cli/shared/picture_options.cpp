#include "isp/cli/shared/picture_options.h"

#include <cstddef>
#include <memory>
#include <utility>

#include "capture/file/file_bytes.h"
#include "isp/base/executor.h"
#include "isp/cli/shared/machine.h"
#include "isp/cli/simulate/scene_argument.h"
#include "isp/model/vision/scene_light.h"

namespace lowlux::cli {

isp::WriteOptions write_options(const DevelopArgs& args) {
  isp::WriteOptions write;
  write.overwrite = args.force ? isp::Overwrite::yes : isp::Overwrite::no;
  write.software = "lowlux " + version_number();
  write.jpeg.quality = args.jpeg_quality;
  write.exr.depth = args.bits.value_or(16) == 16 ? isp::ExrOptions::Depth::half : isp::ExrOptions::Depth::full;
  return write;
}

namespace {

Result<isp::SceneLight> read_light(const std::string& file) {
  auto spectrum = light_of(file, "--light");
  if (!spectrum) return tl::make_unexpected(spectrum.error());
  auto light = isp::light_of_spectrum(file, *std::move(spectrum));
  if (!light) return fail(light.error().code, light.error().message, file);
  return light;
}

}  // namespace

Result<void> make_for_display(const DevelopArgs& args, isp::DevelopOptions& options) {
  if (const std::string& file = args.look.coefficients; !file.empty()) {
    auto table = read_shin_file(file);
    if (!table) return tl::make_unexpected(table.error());
    options.look.shin = std::make_shared<const isp::ShinTable>(*std::move(table));
  }
  if (const std::string& file = args.look.light_file; !file.empty()) {
    auto light = read_light(file);
    if (!light) return tl::make_unexpected(light.error());
    options.look.light = std::make_shared<const isp::SceneLight>(*std::move(light));
  }
  if (!args.look.display_cd_m2) return {};
  PoolExecutor executor(2);
  auto target =
      isp::display_target({.display_cd_m2 = *args.look.display_cd_m2, .shin = options.look.shin.get()}, executor);
  if (!target) return fail(target.error().code, target.error().message, "--display-luminance");
  options.display = std::make_shared<const isp::DisplayTarget>(*std::move(target));
  return {};
}

Result<isp::ShinTable> read_shin_file(const std::string& file) {
  constexpr std::size_t max_bytes = 1 << 20;
  const auto bytes = capture::read_file_bytes(file, max_bytes);
  if (!bytes) return fail(bytes.error().code, bytes.error().message, file);
  auto table = isp::read_shin_table({reinterpret_cast<const char*>(bytes->data()), bytes->size()}, file);
  if (!table) return fail(table.error().code, table.error().message, file);
  return table;
}

}  // namespace lowlux::cli
