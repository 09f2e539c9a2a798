#include "capture/dng/dng_colour.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>

#include "capture/dng/dng_tags.h"
#include "capture/file/pass_on.h"
#include "isp/base/text.h"
#include "isp/model/colour/camera_colour.h"
#include "isp/model/colour/colorimetry.h"
#include "isp/model/spectrum/spectral_lift.h"

namespace lowlux::capture {
namespace {

using Numbers = std::optional<std::vector<double>>;

// Every positive rational of TIFF lies in this range; the bytes of rationals that are read as doubles do not.
constexpr double min_positive = 1e-10, max_positive = 1e10;
constexpr double max_ratio = 1000;  // of three numbers; sodium lamps lead to neutrals of up to 300

/// Largest excitation purity of a white under the colour matrices. These are least exact for narrow bands: with the
/// published sensitivities of 22 cameras, low-pressure sodium lamps lead to purities of up to 1.08.
constexpr double max_purity = 1.1;

/// Returns the directory with a tag: profile and as-shot tags belong in the first one; some writers put them in that of
/// the raw image.
const TiffDirectory& directory_with(const DngFile& dng, const TiffDirectory& raw_image, TagName name) {
  return dng.main.find(name) != nullptr ? dng.main : raw_image;
}

Result<Numbers> numbers_of(const DngFile& dng, const TiffDirectory& raw_image, TagName name, std::size_t count) {
  return directory_with(dng, raw_image, name).numbers(name, count, count);
}

tl::unexpected<Error> bad(TagName name, const std::string& what) {
  return fail(ErrorCode::malformed, std::string("the tag ") + name.name + " " + what, name.name);
}

/// Reads a 3x3 matrix with an inverse; nullopt if there is no such tag.
Result<std::optional<Matrix3>> read_matrix(const DngFile& dng, const TiffDirectory& raw_image, TagName name) {
  auto values = numbers_of(dng, raw_image, name, 9);
  if (!values) return pass_on(values);
  if (!*values) return std::nullopt;
  Matrix3 matrix{};
  for (int i = 0; i < 9; ++i) {
    const double value = (**values)[i];
    if (!std::isfinite(value)) return bad(name, "holds a value that is not a number");
    matrix[i / 3][i % 3] = value;
  }
  if (!inverse(matrix)) return bad(name, "is a singular matrix");
  return matrix;
}

/// Reads a forward matrix: white-balanced camera RGB of a neutral has positive XYZ.
Result<std::optional<Matrix3>> read_forward(const DngFile& dng, const TiffDirectory& raw_image, TagName name) {
  auto matrix = read_matrix(dng, raw_image, name);
  if (!matrix || !*matrix) return matrix;
  const Vector3 white = **matrix * Vector3{1, 1, 1};
  if (std::all_of(white.begin(), white.end(), [](double sum) { return sum > 0; })) return matrix;
  return bad(name, "maps a neutral to an impossible colour");
}

/// Reads three positive numbers of similar size; nullopt if the tag is missing.
Result<std::optional<Vector3>> read_positive(const DngFile& dng, const TiffDirectory& raw_image, TagName name) {
  auto values = numbers_of(dng, raw_image, name, 3);
  if (!values) return pass_on(values);
  if (!*values) return std::nullopt;
  Vector3 out{};
  for (int i = 0; i < 3; ++i) {
    out[i] = (**values)[i];
    if (!std::isfinite(out[i]) || out[i] <= 0)
      return bad(name, "holds " + number_text(out[i]) + ", expected numbers above 0");
    if (out[i] < min_positive || out[i] > max_positive)
      return bad(name, "holds " + number_text(out[i]) + ", expected numbers near 1");
  }
  const auto [least, most] = std::minmax_element(out.begin(), out.end());
  if (*most > max_ratio * *least)
    return bad(name, "holds " + number_text(*least) + " and " + number_text(*most) + ", which differ by a factor of " +
                         number_text(*most / *least) + ", more than " + number_text(max_ratio));
  return out;
}

/// Returns whether CameraCalibration was measured with the profile of the file: the signatures of both are equal, or
/// neither has one (DNG 1.7, CameraCalibrationSignature).
bool is_calibrated_for_profile(const DngFile& dng, const TiffDirectory& raw_image) {
  const auto text = [&](TagName name) {
    const auto bytes = directory_with(dng, raw_image, name).bytes(name).value_or(std::span<const std::byte>{});
    return bytes.first(static_cast<std::size_t>(std::find(bytes.begin(), bytes.end(), std::byte{0}) - bytes.begin()));
  };
  return std::ranges::equal(text(tag::camera_calibration_signature), text(tag::profile_calibration_signature));
}

/// Reads calibration `index` (0 or 1); nullopt if the file has no usable colour matrix for it.
std::optional<ColourCalibration> read_calibration(const DngFile& dng, const TiffDirectory& raw_image, int index,
                                                  std::vector<std::string>& warnings) {
  const auto colour = or_ignored(read_matrix(dng, raw_image, tag::color_matrix[index]), warnings);
  if (!colour) return std::nullopt;
  const TagName light = tag::calibration_illuminant[index];
  ColourCalibration out;
  out.xyz_to_camera = *colour;
  if (is_calibrated_for_profile(dng, raw_image)) {
    out.camera_calibration =
        or_ignored(read_matrix(dng, raw_image, tag::camera_calibration[index]), warnings).value_or(identity3());
  }
  out.forward = or_ignored(read_forward(dng, raw_image, tag::forward_matrix[index]), warnings);
  out.cct_k = illuminant_cct_k(or_ignored(directory_with(dng, raw_image, light).whole(light), warnings).value_or(0));
  return out;
}

Result<std::optional<std::array<double, 2>>> read_white_xy(const DngFile& dng, const TiffDirectory& raw_image) {
  auto xy = numbers_of(dng, raw_image, tag::as_shot_white_xy, 2);
  if (!xy) return pass_on(xy);
  if (!*xy) return std::nullopt;
  const double x = (**xy)[0], y = (**xy)[1];
  if (x > 0 && y > 0 && x + y < 1) return std::array<double, 2>{x, y};
  return bad(tag::as_shot_white_xy,
             "holds " + number_text(x) + ", " + number_text(y) + ", which is not a valid chromaticity");
}

void read_white(const DngFile& dng, const TiffDirectory& raw_image, CameraColour& colour,
                std::vector<std::string>& warnings) {
  if (const auto n = or_ignored(read_positive(dng, raw_image, tag::as_shot_neutral), warnings)) {
    const double top = std::max({(*n)[0], (*n)[1], (*n)[2]});
    colour.as_shot_neutral = Vector3{(*n)[0] / top, (*n)[1] / top, (*n)[2] / top};
  }
  colour.as_shot_white_xy = or_ignored(read_white_xy(dng, raw_image), warnings);
}

/// Returns whether a light can have this white, and images can be made of it with the calibrations.
bool is_usable(const CameraColour& colour, const isp::Xy& white) {
  return isp::excitation_purity(white) <= max_purity && isp::camera_to_xyz(colour, white, isp::white_d65).has_value();
}

bool is_usable(const CameraColour& colour, const Vector3& neutral) {
  const auto white = isp::white_of_neutral(colour, neutral);
  return white && is_usable(colour, white->xy);
}

}  // namespace

double illuminant_cct_k(std::uint32_t light_source) {
  // CIE 15: A 2856, B 4874, C 6774, D50 5003, D55 5503, D65 6504, D75 7504, F2 4230 K. Other fluorescent lamps: the
  // middle of the range EXIF gives for each. Daylight, fine weather and flash are taken as D55, cloudy as D65, shade
  // as D75; tungsten as A.
  struct Illuminant {
    std::uint32_t light_source;
    double cct_k;
  };
  constexpr Illuminant illuminants[] = {{1, 5503},  {2, 4230},  {3, 2856},  {4, 5503},  {9, 5503},
                                        {10, 6504}, {11, 7504}, {12, 6400}, {13, 5050}, {14, 4150},
                                        {15, 3525}, {16, 2925}, {17, 2856}, {18, 4874}, {19, 6774},
                                        {20, 5503}, {21, 6504}, {22, 7504}, {23, 5003}, {24, 3200}};
  for (const Illuminant& known : illuminants) {
    if (known.light_source == light_source) return known.cct_k;
  }
  return 0;
}

CameraColour read_colour(const DngFile& dng, const TiffDirectory& raw_image, std::vector<std::string>& warnings) {
  CameraColour colour;
  for (int i = 0; i < 2; ++i) {
    if (auto calibration = read_calibration(dng, raw_image, i, warnings)) colour.calibrations.push_back(*calibration);
  }
  std::stable_sort(colour.calibrations.begin(), colour.calibrations.end(),
                   [](const auto& a, const auto& b) { return a.cct_k < b.cct_k; });
  if (!colour.calibrations.empty()) colour.source = CameraColour::Source::file_tags;
  colour.analog_balance =
      or_ignored(read_positive(dng, raw_image, tag::analog_balance), warnings).value_or(Vector3{1, 1, 1});
  read_white(dng, raw_image, colour, warnings);
  if (dng.main.find(tag::color_matrix_3) != nullptr) warnings.emplace_back("ColorMatrix3 is not used");
  return colour;
}

Result<void> check_colour_matrices(const DngFile& dng, const TiffDirectory& raw_image) {
  for (const TagName name : tag::color_matrix) {
    if (auto matrix = read_matrix(dng, raw_image, name); !matrix) return pass_on(matrix);
  }
  return {};
}

void ignore_impossible_white(CameraColour& colour, std::vector<std::string>& warnings) {
  if (colour.calibrations.empty()) return;
  const std::string why =
      " is not the colour of a light under the camera's colour matrices; it is ignored, --wb sets another";
  if (const auto n = colour.as_shot_neutral; n && !is_usable(colour, *n)) {
    warnings.push_back("the as-shot neutral " + number_text((*n)[0]) + " " + number_text((*n)[1]) + " " +
                       number_text((*n)[2]) + why);
    colour.as_shot_neutral.reset();
  }
  if (const auto xy = colour.as_shot_white_xy; xy && !is_usable(colour, isp::Xy{(*xy)[0], (*xy)[1]})) {
    warnings.push_back("the as-shot white x " + number_text((*xy)[0]) + " y " + number_text((*xy)[1]) + why);
    colour.as_shot_white_xy.reset();
  }
}

Result<std::optional<NoiseProfile>> read_noise(const DngFile& dng, const TiffDirectory& raw_image, int planes) {
  const TagName name = tag::noise_profile;
  const TiffDirectory& directory = raw_image.find(name) != nullptr ? raw_image : dng.main;
  auto values = directory.numbers(name, 2, 8);
  if (!values) return pass_on(values);
  if (!*values) return std::nullopt;
  const std::vector<double>& pairs = **values;
  if (pairs.size() != 2 && pairs.size() < 2 * static_cast<std::size_t>(planes)) {
    return bad(name, "has " + std::to_string(pairs.size()) + " values, expected 2 or two for each colour");
  }
  NoiseProfile noise;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t at = pairs.size() == 2 || planes == 1 ? 0 : 2 * i;
    // This is the variance of a value between 0 and 1: it is at most 1.
    if (!(pairs[at] >= 0 && pairs[at] <= 1 && std::fabs(pairs[at + 1]) <= 1)) {
      return bad(name, "holds a value that is not a variance");
    }
    noise.scale[i] = pairs[at];
    noise.offset[i] = pairs[at + 1];
  }
  // From 0, none, to 1, as much as there should be; 0/0 where it is not known, which other values count as too. With
  // less than a half there is noise left to be reduced.
  const auto applied = directory.numbers(tag::noise_reduction_applied, 1, 1);
  noise.reduced = applied && *applied && (**applied)[0] >= 0.5 && (**applied)[0] <= 1;
  return noise;
}

}  // namespace lowlux::capture
