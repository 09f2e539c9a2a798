#include "isp/python/raw_image.h"

#include <utility>

#include <pybind11/stl.h>

#include "capture/file/dng_source.h"
#include "isp/cli/develop/develop_args.h"
#include "isp/cli/shared/machine.h"
#include "isp/cli/shared/option_values.h"
#include "isp/output/dng/dng_check.h"
#include "isp/output/dng/dng_writer.h"
#include "isp/python/failure.h"
#include "isp/python/text.h"

namespace lowlux::python {
namespace {

namespace py = pybind11;

/// Returns a view of the samples inside `area`, which keeps the frame alive.
template <class Sample>
py::array view_of(const py::object& self, Plane<Sample>& plane, const Rect& area, int channels) {
  const auto row = static_cast<py::ssize_t>(sizeof(Sample) * plane.width());
  const auto pixel = static_cast<py::ssize_t>(sizeof(Sample) * channels);
  std::vector<py::ssize_t> shape{area.height, area.width}, strides{row, pixel};
  if (channels == 3) shape.push_back(3), strides.push_back(sizeof(Sample));
  Sample* const corner = plane.data() + static_cast<std::size_t>(area.y) * plane.width() + area.x * channels;
  return py::array(py::dtype::of<Sample>(), std::move(shape), std::move(strides), corner, self);
}

py::array samples_in(const py::object& self, const Rect& area) {
  RawDn& raw = self.cast<RawImage&>().frame.raw;
  const int channels = isp::samples_of(raw.layout);
  return raw.is_float() ? view_of(self, raw.dn_float, area, channels) : view_of(self, raw.dn, area, channels);
}

Rect readout_of(const RawDn& raw) { return {0, 0, raw.row_samples() / isp::samples_of(raw.layout), raw.rows()}; }

py::array raw_image(const py::object& self) {
  return samples_in(self, readout_of(self.cast<const RawImage&>().frame.raw));
}
py::array raw_image_visible(const py::object& self) {
  return samples_in(self, self.cast<const RawImage&>().frame.raw.active);
}

/// Returns the filters of the first 2x2 cell of the readout as indices into color_desc, as LibRaw numbers them: 0 red,
/// 1 green of red's rows, 2 blue, 3 green of blue's rows. None without a mosaic.
py::object raw_pattern(const RawImage& image) {
  const RawDn& raw = image.frame.raw;
  if (raw.layout != SensorLayout::bayer) return py::none();
  const BayerPhase phase = phase_of_crop(raw.phase, raw.active.x, raw.active.y);
  py::array_t<std::uint8_t> out({2, 2});
  for (int y = 0; y < 2; ++y) {
    for (int x = 0; x < 2; ++x) {
      const CfaColour colour = colour_at(phase, x, y);
      const bool second = colour == CfaColour::green && y != red_row(phase);
      out.mutable_at(y, x) = second ? 3 : static_cast<std::uint8_t>(colour);
    }
  }
  return out;
}

py::bytes color_desc(const RawImage& image) {
  const SensorLayout layout = image.frame.raw.layout;
  return layout == SensorLayout::bayer ? "RGBG" : layout == SensorLayout::linear_rgb ? "RGB" : "G";
}

std::string cfa_of(const RawImage& image) {
  constexpr std::array phases{"RGGB", "GRBG", "GBRG", "BGGR"};
  const RawDn& raw = image.frame.raw;
  if (raw.layout == SensorLayout::bayer) return phases[static_cast<std::size_t>(raw.phase)];
  return raw.layout == SensorLayout::monochrome ? "MONO" : "RGB";
}

/// Returns the black level at each site of the visible part's 2x2 cell; None if the file states none.
py::object black_dn(const RawImage& image) {
  const RawDn& raw = image.frame.raw;
  if (!raw.black_tag) return py::none();
  const bool rgb = raw.layout == SensorLayout::linear_rgb;
  std::vector<py::ssize_t> shape{2, 2};
  if (rgb) shape = {3};
  py::array_t<double> out(shape);
  double* const value = out.mutable_data();
  for (int i = 0; i < (rgb ? 3 : 4); ++i) {
    const int x = i & 1, y = i >> 1;
    value[i] = rgb ? raw.black_tag->at(0, 0, i)
                   : raw.black_tag->at(std::min(x, raw.active.width - 1), std::min(y, raw.active.height - 1));
  }
  return out;
}

py::array white_dn(const RawImage& image) { return py::array_t<double>(3, image.frame.raw.white_dn.data()); }

/// Returns scale and offset of R, G, B.
py::object noise_of(const RawImage& image) {
  if (!image.frame.noise) return py::none();
  py::array_t<double> out({3, 2});
  for (int c = 0; c < 3; ++c) {
    out.mutable_at(c, 0) = image.frame.noise->scale[static_cast<std::size_t>(c)];
    out.mutable_at(c, 1) = image.frame.noise->offset[static_cast<std::size_t>(c)];
  }
  return out;
}

py::list matrices_of(const RawImage& image) {
  py::list out;
  for (const ColourCalibration& calibration : image.frame.colour.calibrations) {
    py::array_t<double> matrix({3, 3});
    for (std::size_t i = 0; i < 9; ++i) {
      matrix.mutable_at(static_cast<int>(i / 3), static_cast<int>(i % 3)) = calibration.xyz_to_camera[i / 3][i % 3];
    }
    out.append(matrix);
  }
  return out;
}

std::array<int, 6> sizes_of(const RawImage& image) {
  const Rect all = readout_of(image.frame.raw), &seen = image.frame.raw.active;
  return {all.height, all.width, seen.height, seen.width, seen.y, seen.x};
}

RawImagePtr read_raw(const std::string& path) {
  const py::gil_scoped_release released;
  auto out = std::make_shared<RawImage>();
  Result<RawFrame> frame = capture::read_raw(path);
  if (!frame && frame.error().where.empty()) frame.error().where = path;
  out->frame = value_of(std::move(frame));
  return out;
}

isp::DngCompression compression_named(const std::string& name) {
  const auto& names = cli::compression_names();
  const auto found = names.find(name);
  if (found != names.end()) return found->second;
  throw Failure({ErrorCode::invalid_argument, "'" + name + "' is none of " + cli::joined(names), "compression"});
}

void write_dng(const RawImage& image, const std::string& path, bool overwrite, const std::string& compression) {
  const py::gil_scoped_release released;
  value_of(isp::write_dng(image.frame, path,
                          {.overwrite = overwrite ? isp::Overwrite::yes : isp::Overwrite::no,
                           .software = "lowlux " + cli::version_number(),
                           .compression = compression_named(compression)}));
}

RawImagePtr from_array(const py::array& mosaic, std::vector<double> black_dn_, std::vector<double> white_dn_,
                       std::string cfa, std::vector<double> noise, std::vector<double> matrix,
                       std::optional<double> exposure_s, std::optional<double> iso, const RawImage* like) {
  return frame_from_array(mosaic,
                          {.black_dn = std::move(black_dn_),
                           .white_dn = std::move(white_dn_),
                           .cfa = std::move(cfa),
                           .noise = std::move(noise),
                           .matrix = std::move(matrix),
                           .exposure_s = exposure_s,
                           .iso = iso},
                          like);
}

/// Takes the place of RawImage.__new__, which would make an object without a frame.
PyObject* refuse_new(PyTypeObject* /*type*/, PyObject* /*positional*/, PyObject* /*named*/) {
  PyErr_SetString(PyExc_TypeError, "a RawImage is made by read_raw or raw_from_array");
  return nullptr;
}

/// Adds an attribute of FrameInfo.
template <class Value>
void add_info(py::class_<RawImage, RawImagePtr>& type, const char* name, Value FrameInfo::*member, const char* doc) {
  type.def_property_readonly(
      name, [member](const RawImage& image) { return image.frame.raw.info.*member; }, doc);
}

}  // namespace

void add_raw_image(py::module_& module) {
  py::class_<RawImage, RawImagePtr> type(
      module, "RawImage", "A raw frame and what is known of it; what its source does not state is None.");
  reinterpret_cast<PyTypeObject*>(type.ptr())->tp_new = refuse_new;
  const auto add = [&type](const char* name, auto get, const char* doc) { type.def_property_readonly(name, get, doc); };
  add("raw_image", raw_image,
      "Samples of the whole readout, a writable view: raw_height x raw_width (x 3 for RGB), uint16 or float32 [DN].");
  add("raw_image_visible", raw_image_visible, "The part of raw_image that light reaches, a writable view.");
  add("raw_pattern", raw_pattern, "Index into color_desc at each site of raw_image's 2x2 cell; None without a mosaic.");
  add("color_desc", color_desc, "Colours that raw_pattern counts, as bytes: b'RGBG', b'RGB' or b'G'.");
  add("cfa", cfa_of, "Mosaic of raw_image_visible: RGGB, GRBG, GBRG or BGGR; MONO without filters, or RGB.");
  add("black_dn", black_dn, "Black level [DN] at each site of raw_image_visible's 2x2 cell, or of R, G, B; or None.");
  add("white_dn", white_dn, "White level of R, G, B [DN].");
  add("noise", noise_of,
      "3 x 2, scale and offset of R, G, B: the variance of x, 0 at black and 1 at white, is scale x + offset; or "
      "None.");
  add("matrices", matrices_of, "3 x 3 matrices from XYZ to camera RGB, by rising colour temperature of their light.");
  add("_sizes", sizes_of, "");
  add(
      "warnings", [](const RawImage& image) { return strs_of(image.frame.warnings); },
      "Warnings of reading, one line each.");
  add(
      "as_shot_neutral", [](const RawImage& image) { return image.frame.colour.as_shot_neutral; },
      "Camera RGB of a neutral as the camera chose it, largest 1; None if unknown.");
  add(
      "orientation", [](const RawImage& image) { return static_cast<int>(image.frame.raw.info.orientation); },
      "EXIF orientation, 1 to 8; 1 is upright.");
  add(
      "make", [](const RawImage& image) { return str_of(image.frame.raw.info.make); },
      "Maker of the camera; empty if unknown.");
  add(
      "model", [](const RawImage& image) { return str_of(image.frame.raw.info.model); },
      "Model of the camera; empty if unknown.");
  add_info(type, "exposure_s", &FrameInfo::exposure_s, "Exposure time [s]; None if unknown.");
  add_info(type, "iso", &FrameInfo::iso, "ISO setting; None if unknown.");
  add_info(type, "f_number", &FrameInfo::f_number, "f-number; None if unknown.");
  add_info(type, "temperature_c", &FrameInfo::temperature_c, "Temperature of the sensor [C]; None if unknown.");
  module.def("read_raw", read_raw);
  module.def("write_dng", write_dng);
  module.def("from_array", from_array);
}

RawFrame without_samples(const RawFrame& frame) {
  RawFrame out;
  const RawDn& raw = frame.raw;
  out.raw.layout = raw.layout;
  out.raw.phase = raw.phase;
  out.raw.active = raw.active;
  out.raw.default_crop = raw.default_crop;
  out.raw.masked = raw.masked;
  out.raw.masked_is_stated = raw.masked_is_stated;
  out.raw.black_tag = raw.black_tag;
  out.raw.white_dn = raw.white_dn;
  out.raw.info = raw.info;
  out.colour = frame.colour;
  out.noise = frame.noise;
  out.noise_ratio = frame.noise_ratio;
  out.corrections = frame.corrections;
  out.source_tags = frame.source_tags;
  out.warnings = frame.warnings;
  return out;
}

RawFrame clone(const RawFrame& frame) {
  RawFrame out = without_samples(frame);
  out.raw.dn = frame.raw.dn.clone();
  out.raw.dn_float = frame.raw.dn_float.clone();
  return out;
}

}  // namespace lowlux::python
