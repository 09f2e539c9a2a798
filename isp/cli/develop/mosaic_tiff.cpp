#include "isp/cli/develop/mosaic_tiff.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <variant>

#include <fmt/format.h>

#include "capture/decoder/decoded_raw.h"
#include "capture/file/file_bytes.h"
#include "isp/base/file_extension.h"
#include "isp/base/image.h"
#include "isp/codec/tiff.h"

namespace lowlux::cli {
namespace {

constexpr float max_code = 65535;

tl::unexpected<Error> coloured() {
  return fail(ErrorCode::unsupported, "this TIFF has colours; save the mosaic of the sensor before demosaicing");
}

Result<Plane<float>> grey_of(const Encoded8& /*picture*/) {
  return fail(ErrorCode::unsupported, "this TIFF has 8 bits; save it with 16 bits or as 32-bit floats");
}

Result<Plane<float>> grey_of(const Encoded16& picture) {
  Plane<float> out(picture.width(), picture.height());
  for (int y = 0; y < out.height(); ++y) {
    const std::uint16_t* in = picture.codes.row(y);
    for (int x = 0; x < out.width(); ++x, in += 3) {
      if (in[0] != in[1] || in[1] != in[2]) return coloured();
      out.at(x, y) = in[0];
    }
  }
  return out;
}

Result<void> check_finite(const Plane<float>& plane) {
  for (int y = 0; y < plane.height(); ++y) {
    for (int x = 0; x < plane.width(); ++x) {
      if (std::isfinite(plane.at(x, y))) continue;
      return fail(ErrorCode::malformed, fmt::format("the value at column {}, row {} is not a finite number", x, y));
    }
  }
  return {};
}

Result<Plane<float>> grey_of(const SceneLinear& picture) {
  if (const auto finite = check_finite(picture.plane[0]); !finite) return tl::make_unexpected(finite.error());
  for (int y = 0; y < picture.height(); ++y) {
    for (int x = 0; x < picture.width(); ++x) {
      const float red = picture.plane[0].at(x, y);
      if (red != picture.plane[1].at(x, y) || red != picture.plane[2].at(x, y)) return coloured();
    }
  }
  return picture.plane[0].clone();
}

}  // namespace

bool is_tiff_name(const std::string& file) { return has_extension(file, ".tif") || has_extension(file, ".tiff"); }

Result<MosaicTiff> mosaic_of(RawFrame frame, const std::string& file) {
  if (frame.raw.layout == SensorLayout::linear_rgb) {
    return fail(ErrorCode::unsupported, "this DNG has colours; save the mosaic of the sensor before demosaicing");
  }
  return MosaicTiff{.file = file,
                    .dn = std::move(frame.raw.dn_float),
                    .rounded = false,
                    .white = frame.raw.white_dn[0],
                    .info = std::move(frame.raw.info)};
}

Result<MosaicTiff> read_mosaic_tiff(const std::string& file) {
  const auto bytes = capture::read_file_bytes(file, capture::ReadLimits{}.max_file_bytes);
  if (!bytes) return tl::make_unexpected(bytes.error());
  const auto decoded = isp::decode_tiff(*bytes, {capture::ReadLimits{}.max_pixels});
  if (!decoded) return tl::make_unexpected(decoded.error());
  auto grey = std::visit([](const auto& picture) { return grey_of(picture); }, decoded->picture);
  if (!grey) return tl::make_unexpected(grey.error());
  MosaicTiff out{.file = file, .dn = *std::move(grey), .info = decoded->metadata.info};
  out.rounded = !std::holds_alternative<SceneLinear>(decoded->picture);
  float* const first = out.dn.data();
  out.scaled = !out.rounded && *std::max_element(first, first + out.dn.size()) <= 1;
  if (out.scaled) std::transform(first, first + out.dn.size(), first, [](float v) { return v * max_code; });
  return out;
}

}  // namespace lowlux::cli
