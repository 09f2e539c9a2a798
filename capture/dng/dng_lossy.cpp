#include "capture/dng/dng_lossy.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "capture/dng/dng_opcodes.h"
#include "capture/dng/dng_tags.h"
#include "capture/file/pass_on.h"
#include "isp/base/frame.h"
#include "isp/codec/jpeg.h"

namespace lowlux::capture {
namespace {

constexpr double linear_white_dn = 65535;

Result<DngGrid> lossy_grid(const TiffDirectory& directory, const DngImage& image, std::size_t file_bytes) {
  if (image.layout == SensorLayout::bayer || image.bits != 8) {
    return fail(ErrorCode::unsupported,
                "lossy JPEG is supported for LinearRaw images of 8 bits only: convert it to a DNG with lossless JPEG",
                tag::compression.name);
  }
  return dng_grid(directory, image, file_bytes);
}

/// Returns the codes of one part, interleaved R G B; grey has three equal samples.
Result<Plane<std::uint8_t>> decode_part(std::span<const std::byte> bytes, int width, int rows, int height) {
  auto decoded = isp::decode_jpeg(bytes, {.max_pixels = std::int64_t{width} * height});
  if (!decoded) return tl::make_unexpected(std::move(decoded.error()));
  auto& picture = std::get<Encoded8>(decoded->picture);
  if (picture.width() == width && (picture.height() == height || picture.height() == rows)) {
    return std::move(picture.codes);
  }
  return fail(ErrorCode::malformed, "it has " + std::to_string(picture.width()) + " x " +
                                        std::to_string(picture.height()) + " pixels, expected " +
                                        std::to_string(width) + " x " + std::to_string(height));
}

/// Returns LinearizationTable at each code, the identity without one; codes beyond the table have its last value.
Result<std::vector<double>> linearization(const TiffDirectory& directory, int bits) {
  std::vector<double> out(std::size_t{1} << bits);
  auto table = directory.numbers(tag::linearization_table, 1, 65536);
  if (!table) return pass_on(table);
  if (*table && !std::ranges::all_of(**table, [](double dn) { return std::isfinite(dn); })) {
    return fail(ErrorCode::malformed, "the table has a value that is not finite", tag::linearization_table.name);
  }
  for (std::size_t i = 0; i < out.size(); ++i) {
    out[i] = *table ? (**table)[std::min(i, (*table)->size() - 1)] : static_cast<double>(i);
  }
  return out;
}

/// Returns the black level of a sample; an error if it differs between pixels, because one curve is used for all.
Result<double> uniform_black(const RawDn& raw, std::size_t sample) {
  if (!raw.black_tag) return 0.0;
  const BlackLevel& black = *raw.black_tag;
  for (std::size_t i = sample; i < black.pattern_dn.size(); i += static_cast<std::size_t>(black.samples)) {
    if (black.pattern_dn[i] == black.pattern_dn[sample]) continue;
    return fail(ErrorCode::unsupported, "lossy raws with a black level that depends on the pixel are not supported",
                tag::black_level.name);
  }
  if (black.column_dn.empty() && black.row_dn.empty()) return black.pattern_dn[sample];
  return fail(ErrorCode::unsupported, "lossy raws with a black level that depends on the pixel are not supported",
              tag::black_level_delta_h.name);
}

double value_of(const Polynomial& polynomial, double x) {
  const auto& k = polynomial.coefficient;
  const double sum =
      std::accumulate(k.rbegin(), k.rend(), 0.0, [x](double all, double next) { return all * x + next; });
  return std::clamp(sum, 0.0, 1.0);
}

using Curve = std::vector<std::uint16_t>;

/// Returns the linear sample of each code after the polynomials of a plane.
Result<Curve> polynomial_curve(const std::vector<Polynomial>& polynomials, const std::vector<double>& linear,
                               const RawDn& raw, std::size_t plane) {
  auto black = uniform_black(raw, plane);
  if (!black) return pass_on(black);
  Curve curve(linear.size());
  for (std::size_t i = 0; i < curve.size(); ++i) {
    double x = std::clamp((linear[i] - *black) / (raw.white_dn[plane] - *black), 0.0, 1.0);
    for (const Polynomial& polynomial : polynomials) {
      if (polynomial.applies_to(static_cast<int>(plane))) x = value_of(polynomial, x);
    }
    curve[i] = static_cast<std::uint16_t>(std::lround(x * linear_white_dn));
  }
  if (std::is_sorted(curve.begin(), curve.end())) return curve;
  return fail(ErrorCode::malformed, "MapPolynomial of the tag OpcodeList2 is damaged: its values fall",
              tag::opcode_list[1].name);
}

void apply_curves(const std::vector<Curve>& curves, Plane<std::uint16_t>& codes) {
  for (int y = 0; y < codes.height(); ++y) {
    std::uint16_t* row = codes.row(y);
    for (int x = 0; x < codes.width(); ++x) row[x] = curves[static_cast<std::size_t>(x) % curves.size()][row[x]];
  }
}

}  // namespace

Result<void> check_lossy_image(const TiffDirectory& directory, const DngImage& image, std::size_t file_bytes) {
  return lossy_grid(directory, image, file_bytes).map([](const DngGrid& /*grid*/) {});
}

Result<Plane<std::uint16_t>> decode_lossy_image(std::span<const std::byte> file, const TiffDirectory& directory,
                                                const DngImage& image) {
  auto grid = lossy_grid(directory, image, file.size());
  if (!grid) return pass_on(grid);
  Plane<std::uint16_t> out(image.width * image.samples, image.height);
  for (std::size_t i = 0; i < grid->count; ++i) {
    const int left = grid->left(i), top = grid->top(i);
    const int rows = std::min(grid->height, image.height - top), columns = std::min(grid->width, image.width - left);
    auto part = decode_part(grid->at.part(file, i), grid->width, rows, grid->height);
    if (!part) {
      return fail(ErrorCode::malformed, "the lossy JPEG from column " + std::to_string(left) + ", row " +
                                            std::to_string(top) + " on does not decode: " + part.error().message);
    }
    const int step = image.samples == 1 ? 3 : 1;
    for (int y = 0; y < rows; ++y) {
      std::uint16_t* to = out.row(top + y) + static_cast<std::ptrdiff_t>(left) * image.samples;
      const std::uint8_t* from = part->row(y);
      for (int x = 0; x < columns * image.samples; ++x) to[x] = from[static_cast<std::ptrdiff_t>(x) * step];
    }
  }
  return out;
}

Result<void> apply_linearization_table(const TiffDirectory& directory, int bits, Plane<std::uint16_t>& codes) {
  auto linear = linearization(directory, bits);
  if (!linear) return pass_on(linear);
  if (directory.find(tag::linearization_table) == nullptr) return {};
  Curve curve(linear->size());
  std::transform(linear->begin(), linear->end(), curve.begin(),
                 [](double dn) { return static_cast<std::uint16_t>(std::clamp(dn, 0.0, linear_white_dn)); });
  apply_curves({curve}, codes);
  return {};
}

Result<void> linearize_codes(const TiffDirectory& directory, const TiffDirectory& opcodes, int bits, RawDn& raw) {
  auto polynomials =
      opcodes.bytes(tag::opcode_list[1]).and_then([&](auto bytes) { return read_polynomials(bytes, raw.active); });
  if (!polynomials) return pass_on(polynomials);
  if (polynomials->empty()) return apply_linearization_table(directory, bits, raw.dn);
  auto linear = linearization(directory, bits);
  if (!linear) return pass_on(linear);
  std::vector<Curve> curves(raw.layout == SensorLayout::linear_rgb ? 3 : 1);
  for (std::size_t plane = 0; plane < curves.size(); ++plane) {
    auto curve = polynomial_curve(*polynomials, *linear, raw, plane);
    if (!curve) return pass_on(curve);
    curves[plane] = *curve;
  }
  apply_curves(curves, raw.dn);
  raw.white_dn.fill(linear_white_dn);
  raw.black_tag =
      BlackLevel{.samples = static_cast<int>(curves.size()), .pattern_dn = std::vector<double>(curves.size(), 0.0)};
  return {};
}

}  // namespace lowlux::capture
