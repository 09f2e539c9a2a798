// The picture reader on arbitrary bytes, whatever format they claim: errors are good; crashes, leaks, memory beyond the
// limits and values no scene can have are bad.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "capture/file/picture_source.h"
#include "isp/base/executor.h"
#include "tests/fuzz/input.h"

namespace {

using lowlux::test::require;

constexpr lowlux::isp::DecodeLimits limits{.max_pixels = 1 << 16};

bool is_one_line(const std::string& text) { return !text.empty() && text.find('\n') == std::string::npos; }

// Colours are promised to be positive where the file cannot state primaries of its own: Rec. 709 and sRGB have none
// below the colours.
bool states_primaries(std::string_view bytes) {
  const bool tiff = bytes.starts_with("II") || bytes.starts_with("MM");
  const auto holds = [bytes](std::string_view mark) { return bytes.find(mark) != std::string_view::npos; };
  return tiff || holds("iCCP") || holds("ICC_PROFILE") || holds("chromaticities");
}

void check(const lowlux::capture::ScenePicture& scene, bool positive) {
  const auto& xyz = scene.xyz;
  require(xyz.width() >= 1 && xyz.height() >= 1);
  require(std::int64_t{xyz.width()} * xyz.height() <= limits.max_pixels);
  for (const auto& plane : xyz.plane) {
    require(plane.width() == xyz.width() && plane.height() == xyz.height());
    for (std::size_t i = 0; i < plane.size(); ++i) {
      const float value = plane.data()[i];
      require(std::isfinite(value) && (value >= 0 || !positive));
    }
  }
  require(scene.absolute ? std::isfinite(scene.white_luminance_cd_m2) && scene.white_luminance_cd_m2 > 0
                         : scene.white_luminance_cd_m2 == 0);
  require(std::all_of(scene.warnings.begin(), scene.warnings.end(), is_one_line));
}

}  // namespace

LOWLUX_FUZZ_TARGET(read_picture)(const std::uint8_t* data, std::size_t size) {
  lowlux::InlineExecutor executor;
  const auto scene = lowlux::capture::read_picture(std::as_bytes(std::span(data, size)), "fuzz", executor, limits);
  if (scene) {
    check(*scene, !states_primaries({reinterpret_cast<const char*>(data), size}));
  } else {
    require(scene.error().where == "fuzz" && is_one_line(scene.error().message));
  }
  return 0;
}
