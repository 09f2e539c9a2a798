#include <algorithm>
#include <climits>
#include <cmath>
#include <string_view>
#include <utility>

#include "isp/base/text.h"
#include "isp/cli/develop/memory_gate.h"
#include "isp/output/dng/dng_check.h"
#include "isp/python/failure.h"
#include "isp/python/quiet_numpy.h"
#include "isp/python/raw_image.h"

namespace lowlux::python {
namespace {

namespace py = pybind11;

[[noreturn]] void refuse(const std::string& message, const std::string& argument) {
  throw Failure({ErrorCode::invalid_argument, message, argument});
}

std::string text_of(const py::handle& object) { return py::str(object).cast<std::string>(); }

/// Returns whether the samples are floats. Throws for types and values that a raw frame cannot hold.
bool check_samples(const py::array& mosaic) {
  if (mosaic.size() == 0) refuse("the array is empty", "mosaic");
  const char kind = mosaic.dtype().kind();
  if (kind == 'f') return true;
  if (kind != 'u' && kind != 'i') {
    refuse("the array is of " + text_of(mosaic.dtype()) + ": expected integers of 0 to 65535, or floats", "mosaic");
  }
  if (kind == 'u' && mosaic.itemsize() <= 2) return false;
  const py::object low = mosaic.attr("min")(), high = mosaic.attr("max")();
  if (low < py::int_(0) || high > py::int_(65535)) {
    refuse("its values range from " + text_of(low) + " to " + text_of(high) + ": integers are codes of 0 to 65535",
           "mosaic");
  }
  return false;
}

/// Throws unless there is memory for a copy: an array of stride 0 takes less than its samples.
void check_memory(const py::array& mosaic) {
  const std::size_t sample_bytes = mosaic.dtype().kind() == 'f' ? sizeof(float) : sizeof(std::uint16_t);
  const double bytes = static_cast<double>(mosaic.size()) * static_cast<double>(sample_bytes);
  const auto available = cli::available_memory();
  if (!available || bytes <= *available) return;
  throw Failure({ErrorCode::too_large,
                 "not enough memory for a copy of the array, which takes " + number_text(1e-9 * bytes, 3) +
                     " GB: " + number_text(1e-9 * *available, 3) + " GB are available",
                 "mosaic"});
}

/// Copies the array into new samples: one copy, of any strides and byte order. NumPy converts.
template <class Sample>
Plane<Sample> copied(const py::array& mosaic) {
  const auto height = static_cast<int>(mosaic.shape(0));
  const auto width = static_cast<int>(mosaic.size() / mosaic.shape(0));
  Plane<Sample> out(width, height);
  const std::vector<py::ssize_t> shape(mosaic.shape(), mosaic.shape() + mosaic.ndim());
  const py::array_t<Sample> view(shape, out.data(), py::capsule(out.data(), [](void*) {}));
  const QuietNumpy quiet;
  py::module_::import("numpy").attr("copyto")(view, mosaic, py::arg("casting") = "unsafe");
  return out;
}

void set_layout(const py::array& mosaic, const std::string& cfa, RawDn& raw) {
  constexpr std::array<std::string_view, 4> phases{"RGGB", "GRBG", "GBRG", "BGGR"};
  if (mosaic.ndim() == 3) {
    if (!cfa.empty()) refuse("an array of three channels has no filters: leave it out", "cfa");
    raw.layout = SensorLayout::linear_rgb;
    return;
  }
  const std::string name = cfa.empty() ? "RGGB" : cfa;
  raw.layout = name == "MONO" ? SensorLayout::monochrome : SensorLayout::bayer;
  if (raw.layout == SensorLayout::monochrome) return;
  const auto* const found = std::ranges::find(phases, name);
  if (found == phases.end()) refuse("'" + name + "' is none of RGGB, GRBG, GBRG, BGGR, MONO", "cfa");
  raw.phase = static_cast<BayerPhase>(found - phases.begin());
}

void set_area(const py::array& mosaic, RawDn& raw) {
  raw.active = raw.default_crop = {0, 0, static_cast<int>(mosaic.shape(1)), static_cast<int>(mosaic.shape(0))};
  raw.masked.clear();
  raw.masked_is_stated = false;
}

/// Returns the metadata of `like` for an array of its readout or of its active area.
RawFrame metadata_like(const py::array& mosaic, const RawImage& like) {
  RawFrame frame = without_samples(like.frame);
  const RawDn& raw = like.frame.raw;
  const int channels = isp::samples_of(raw.layout);
  const auto height = static_cast<int>(mosaic.shape(0)), width = static_cast<int>(mosaic.shape(1));
  if ((mosaic.ndim() == 3) != (channels == 3)) {
    refuse(channels == 3 ? "it has three channels, and the array has one" : "it has one channel, and the array three",
           "like");
  }
  if (height == raw.rows() && width == raw.row_samples() / channels) return frame;
  if (height != raw.active.height || width != raw.active.width) {
    refuse("its readout is " + std::to_string(raw.rows()) + " x " + std::to_string(raw.row_samples() / channels) +
               ", its visible part " + std::to_string(raw.active.height) + " x " + std::to_string(raw.active.width) +
               ", and the array is " + std::to_string(height) + " x " + std::to_string(width),
           "like");
  }
  const Rect crop = raw.default_crop;
  set_area(mosaic, frame.raw);
  frame.raw.default_crop = crop;
  return frame;
}

void set_levels(const MosaicFigures& figures, bool has_like, RawDn& raw) {
  const std::vector<double>&black = figures.black_dn, &white = figures.white_dn;
  const int channels = isp::samples_of(raw.layout);
  if (!has_like && black.empty()) refuse("state the black level [DN], or like=", "black");
  if (!has_like && white.empty()) refuse("state the white level [DN], or like=", "white");
  if (!black.empty()) {
    const bool sites = black.size() == 4 && raw.layout == SensorLayout::bayer;
    if (black.size() != 1 && !sites && black.size() != static_cast<std::size_t>(channels)) {
      refuse(std::to_string(black.size()) + " values: expected 1, 4 for a Bayer mosaic, or 3 for RGB", "black");
    }
    BlackLevel level{.rows = sites ? 2 : 1, .columns = sites ? 2 : 1, .samples = channels};
    level.pattern_dn = black;
    if (channels == 3 && black.size() == 1) level.pattern_dn.assign(3, black[0]);
    raw.black_tag = std::move(level);
  }
  if (white.empty()) return;
  if (white.size() != 1 && white.size() != static_cast<std::size_t>(channels)) {
    refuse(std::to_string(white.size()) + " values: expected 1, or 3 for RGB", "white");
  }
  for (const double level : white) {
    if (level != std::round(level)) refuse(number_text(level) + " is not an integer, as a DNG states it", "white");
  }
  for (std::size_t i = 0; i < 3; ++i) raw.white_dn[i] = white[white.size() == 3 ? i : 0];
}

void set_noise(const std::vector<double>& noise, RawFrame& frame) {
  if (noise.empty()) return;
  if (noise.size() != 2 && noise.size() != 6) {
    refuse(std::to_string(noise.size()) + " values: expected (scale, offset), once or for R, G and B", "noise");
  }
  NoiseProfile profile;
  for (std::size_t i = 0; i < 3; ++i) {
    profile.scale[i] = noise[noise.size() == 6 ? 2 * i : 0];
    profile.offset[i] = noise[noise.size() == 6 ? 2 * i + 1 : 1];
  }
  frame.noise = profile;
  frame.noise_ratio.reset();
}

void set_matrix(const std::vector<double>& matrix, CameraColour& colour) {
  if (matrix.empty()) return;
  if (matrix.size() != 9)
    refuse(std::to_string(matrix.size()) + " values: expected 3 x 3, XYZ to camera RGB", "matrix");
  ColourCalibration calibration;
  for (std::size_t i = 0; i < 9; ++i) calibration.xyz_to_camera[i / 3][i % 3] = matrix[i];
  colour.calibrations = {calibration};
  colour.source = CameraColour::Source::file_tags;
}

void set_exposure(const MosaicFigures& figures, FrameInfo& info) {
  const auto check = [](const std::optional<double>& value, const char* name) {
    if (value && !(*value > 0 && std::isfinite(*value))) {
      refuse(number_text(*value) + " is not a finite number above 0", name);
    }
  };
  check(figures.exposure_s, "exposure_s");
  check(figures.iso, "iso");
  if (figures.exposure_s) info.exposure_s = figures.exposure_s;
  if (figures.iso) info.iso = figures.iso;
}

}  // namespace

RawImagePtr frame_from_array(const py::array& mosaic, const MosaicFigures& figures, const RawImage* like) {
  const auto dimensions = mosaic.ndim();
  if (dimensions != 2 && !(dimensions == 3 && mosaic.shape(2) == 3)) {
    refuse("the array has the shape " + text_of(mosaic.attr("shape")) +
               ": expected (height, width), or (height, width, 3) for RGB",
           "mosaic");
  }
  if (mosaic.shape(0) > INT_MAX || mosaic.shape(1) > INT_MAX / 3) refuse("the array is too large", "mosaic");
  check_memory(mosaic);
  const bool is_float = check_samples(mosaic);
  auto out = std::make_shared<RawImage>();
  RawFrame& frame = out->frame;
  if (like != nullptr) frame = metadata_like(mosaic, *like);
  if (like == nullptr || !figures.cfa.empty()) set_layout(mosaic, figures.cfa, frame.raw);
  if (like == nullptr) set_area(mosaic, frame.raw);
  set_levels(figures, like != nullptr, frame.raw);
  set_noise(figures.noise, frame);
  set_matrix(figures.matrix, frame.colour);
  set_exposure(figures, frame.raw.info);
  if (is_float) {
    frame.raw.dn_float = copied<float>(mosaic);
  } else {
    frame.raw.dn = copied<std::uint16_t>(mosaic);
  }
  const py::gil_scoped_release released;
  value_of(isp::check_dng_frame(frame));
  return out;
}

}  // namespace lowlux::python
