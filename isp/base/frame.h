#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "isp/base/cfa.h"
#include "isp/base/correction.h"
#include "isp/base/matrix3.h"
#include "isp/base/noise_ratio.h"
#include "isp/base/plane.h"
#include "isp/base/source_tags.h"

namespace lowlux {

/// Holds a rectangle of pixels: x and y of its upper left pixel, and its size.
struct Rect {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
  friend bool operator==(const Rect&, const Rect&) = default;
};

/// Lists what one sample of a readout represents.
enum class SensorLayout : std::uint8_t {
  bayer,       // one filter per pixel, see BayerPhase
  monochrome,  // no filters
  linear_rgb,  // three samples per pixel, already demosaiced (DNG LinearRaw), interleaved R G B
};

/// Lists the EXIF orientations, 1 to 8: the transform that brings the stored image upright.
enum class Orientation : std::uint8_t {
  normal = 1,
  mirror_horizontal,
  rotate_180,
  mirror_vertical,
  transpose,
  rotate_90,
  transverse,
  rotate_270
};

/// Holds what is known about how a frame was taken; what the source does not state is absent, never guessed.
struct FrameInfo {
  std::string make;
  std::string model;
  std::string software;
  std::string date_time;  // text of the source, "YYYY:MM:DD hh:mm:ss"
  std::optional<double> exposure_s;
  std::optional<double> iso;
  std::optional<double> f_number;
  std::optional<double> focal_length_mm;
  std::optional<double> temperature_c;  // temperature of the sensor, else of the camera, else of the air
  Orientation orientation = Orientation::normal;
};

/// Holds the black level a source states: a pattern that repeats from the corner of the active area, plus an offset for
/// each active column and row (DNG BlackLevelRepeatDim, BlackLevel, BlackLevelDeltaH, BlackLevelDeltaV).
struct BlackLevel {
  int rows = 1;
  int columns = 1;
  int samples = 1;                 // samples per pixel: 3 for SensorLayout::linear_rgb
  std::vector<double> pattern_dn;  // rows x columns x samples
  std::vector<double> column_dn;   // empty, or one for each active column
  std::vector<double> row_dn;      // empty, or one for each active row

  /// Returns the black level [DN] of sample `sample` at active column x, row y.
  double at(int x, int y, int sample = 0) const {
    const int i = ((y % rows) * columns + x % columns) * samples + sample;
    return pattern_dn[i] + (column_dn.empty() ? 0.0 : column_dn[x]) + (row_dn.empty() ? 0.0 : row_dn[y]);
  }
};

/// Holds one readout, as the source delivers it after its own LinearizationTable and before anything else. `dn` holds
/// the complete readout, borders included: readout height x width (x 3 interleaved for linear_rgb). `active` is in
/// readout pixels; `phase`, `black_tag` and `default_crop` count from the corner of `active`.
///
/// Frames that were computed, such as merges of several exposures, may hold floating-point samples: these are in
/// `dn_float`, and `dn` is empty. They are in the units of the black and white levels, signed and finite, may exceed
/// white, and have no quantisation noise. Frames of cameras hold codes in `dn`, and `dn_float` is empty.
struct RawDn {
  Plane<std::uint16_t> dn;
  Plane<float> dn_float;
  SensorLayout layout = SensorLayout::bayer;
  BayerPhase phase = BayerPhase::rggb;  // only for SensorLayout::bayer
  Rect active;
  Rect default_crop;                      // the region of the active area that makes the image
  std::vector<Rect> masked;               // light-shielded regions of the readout, in readout pixels
  bool masked_is_stated = false;          // true: the source states them; false: assumed to be all that is not active
  std::optional<BlackLevel> black_tag;    // black level that the source states; absent if it states none
  bool is_black_zero_by_default = false;  // the source states none, and its format (DNG) defines 0 as the default
  std::array<double, 3> white_dn{};       // saturation of R, G, B (all equal for monochrome)
  bool from_x_trans = false;              // linear_rgb that was interpolated from an X-Trans mosaic at reading
  FrameInfo info;

  bool is_float() const { return !dn_float.empty(); }
  int row_samples() const { return is_float() ? dn_float.width() : dn.width(); }  // in one row of the readout
  int rows() const { return is_float() ? dn_float.height() : dn.height(); }       // rows of the readout
  std::size_t samples() const { return is_float() ? dn_float.size() : dn.size(); }
  std::size_t sample_bytes() const { return is_float() ? sizeof(float) : sizeof(std::uint16_t); }
};

/// Calls `use` with a view of the readout's samples, of const std::uint16_t or const float, and returns its result.
template <class Use>
decltype(auto) with_samples(const RawDn& raw, Use&& use) {
  if (raw.is_float()) return use(raw.dn_float.view());
  return use(raw.dn.view());
}

/// Holds the black point of one frame, per CFA site. The pedestal [DN] is subtracted; if `pattern` is set, the pattern
/// is subtracted and the pedestal is its mean. If it was measured on masked pixels or dark frames it includes the dark
/// charge, and the dark mean left to subtract is 0. For a dark frame it is the mean of the frame that is subtracted
/// (dark_frame.h). For SensorLayout::linear_rgb the four values are those of R, G, B and B.
struct BlackPoint {
  PerSite<double> pedestal_dn{};
  PerSite<double> pedestal_standard_error_dn{};  // 0 where the pedestal is quoted and not measured
  PerSite<double> dark_mean_e{};   // dark charge left in the data once the pedestal is subtracted; 0 if unknown
  PerSite<double> noise_std_dn{};  // noise of masked pixels; 0 where nothing was measured
  enum class Holds : std::uint8_t { pedestal_only, pedestal_and_dark } holds = Holds::pedestal_only;
  enum class Source : std::uint8_t {
    masked_pixels,
    tag,
    given,
    profile,
    dark_frame,
    format_default,  // 0, because nothing states or measures it
  } source = Source::tag;
  std::optional<BlackLevel> pattern;  // set when `source` is tag and four figures cannot express it
};

/// Describes the variance of a raw value x in 0..1 (black to white): scale * x + offset (DNG NoiseProfile), R, G, B.
struct NoiseProfile {
  std::array<double, 3> scale{};
  std::array<double, 3> offset{};
  enum class Source : std::uint8_t { file, profile, picture } source = Source::file;  // origin of the figures
  bool reduced = false;  // true: noise after noise reduction (DNG NoiseReductionApplied)
};

/// Holds one colour calibration of a camera (DNG ColorMatrixN, CameraCalibrationN, ForwardMatrixN).
struct ColourCalibration {
  double cct_k = 0;  // temperature of its calibration illuminant; 0 if the source does not state it
  Matrix3 xyz_to_camera = identity3();
  Matrix3 camera_calibration = identity3();
  std::optional<Matrix3> forward;  // white-balanced camera RGB -> XYZ under D50
};

/// Holds what a source states about a camera's colour. Without a calibration, only camera RGB can be made.
struct CameraColour {
  std::vector<ColourCalibration> calibrations;  // none, one or two; by rising cct_k
  Vector3 analog_balance{1, 1, 1};
  std::optional<Vector3> as_shot_neutral;  // camera RGB of a neutral, largest 1
  std::optional<std::array<double, 2>> as_shot_white_xy;
  enum class Source : std::uint8_t { none, file_tags, decoder_table, profile } source = Source::none;
};

/// Holds a frame with all metadata of its source: capture passes it to the pipeline.
struct RawFrame {
  RawDn raw;
  CameraColour colour;
  std::optional<NoiseProfile> noise;
  std::shared_ptr<const NoiseRatio> noise_ratio;  // for mosaics; null: the noise is that of `noise` everywhere
  RawCorrections corrections;
  std::shared_ptr<const SourceTags> source_tags;  // tags of the raw file, to be passed on; null: none
  std::vector<std::string> warnings;              // requests of the source that were not met, by name; one line each
};

struct Electrons {};        // unit: the system gain is known
struct FractionOfWhite {};  // unit for an unknown system gain: 0 is black, 1 the white level
struct DarkIn {};           // the dark charge is still in the values
struct DarkOut {};          // the dark charge has been subtracted

/// Holds a mosaic in linear signed units, active area only; pedestal removed, nothing clipped: values below zero are
/// data. The unit and whether the dark charge is still in are part of the type, so that neither can be confused.
template <class Unit, class Dark>
struct LinearMosaic {
  Plane<float> value;
  BayerPhase phase = BayerPhase::rggb;
};
using RawElectrons = LinearMosaic<Electrons, DarkIn>;
using SignalElectrons = LinearMosaic<Electrons, DarkOut>;
using RawFraction = LinearMosaic<FractionOfWhite, DarkIn>;
using SignalFraction = LinearMosaic<FractionOfWhite, DarkOut>;

}  // namespace lowlux
