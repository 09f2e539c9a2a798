#include "isp/cli/dataset/pixel_mask.h"

#include <cmath>
#include <cstdint>
#include <vector>

#include <fmt/format.h>

#include "capture/synthetic/fixed_pattern.h"
#include "isp/model/sensor/noise_source_plan.h"
#include "isp/output/report/report.h"

namespace lowlux::cli {
namespace {

/// Returns the header of NumPy's format 1.0, filled with blanks to a multiple of 64 bytes.
std::string npy_header(int height, int width) {
  std::string text = fmt::format("{{'descr': '|u1', 'fortran_order': False, 'shape': ({}, {}), }}", height, width);
  constexpr std::size_t before = 10;
  while ((before + text.size() + 1) % 64 != 0) text += ' ';
  text += '\n';
  const auto size = static_cast<unsigned>(text.size());
  std::string out = "\x93NUMPY";
  for (const unsigned byte : {1U, 0U, size & 255, size >> 8}) out += static_cast<char>(byte);
  return out + text;
}

}  // namespace

Result<void> write_mask(const RawFrame& frame, const SimulateArgs& args, const SensorModel& sensor,
                        const std::string& file) {
  const RawDn& raw = frame.raw;
  const int width = raw.row_samples(), height = raw.is_float() ? raw.dn_float.height() : raw.dn.height();
  const auto columns = static_cast<std::size_t>(width);
  const bool hot_simulated =
      args.options.effects.tolerance.has_value() || args.options.effects.effects.has(isp::Effect::hot_pixels);
  const double fraction = hot_simulated ? sensor.hot_pixel_fraction : 0;
  std::string text = npy_header(height, width);
  text.reserve(text.size() + columns * static_cast<std::size_t>(height));
  const double white_dn = std::round(raw.white_dn[0]);  // as the file states it
  std::vector<std::uint32_t> words(columns);
  std::vector<std::uint8_t> hot(columns);
  for (int y = 0; y < height; ++y) {
    capture::find_hot_pixels({args.options.sensor_seed, 0, static_cast<std::uint32_t>(y)}, fraction, words, hot);
    for (int x = 0; x < width; ++x) {
      const double code = raw.is_float() ? raw.dn_float.at(x, y) : raw.dn.at(x, y);
      unsigned mask = code >= white_dn ? mask_saturated : 0;
      if (hot[static_cast<std::size_t>(x)] != 0) mask |= mask_hot;
      if (x < args.options.masked_columns) mask |= mask_shielded;
      text += static_cast<char>(mask);
    }
  }
  return isp::write_text(file, text, isp::Overwrite::yes);
}

}  // namespace lowlux::cli
