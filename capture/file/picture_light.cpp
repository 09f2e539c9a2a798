#include "capture/file/picture_light.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>

#include "isp/base/text.h"

namespace lowlux::capture {
namespace {

// Maximum fraction of the light (the sum of absolute values). Enlarging with a filter with negative lobes stays below
// it: 3.5 % for black and white bars four pixels wide with Lanczos-3, the sharpest in use. A difference of two images
// has half.
constexpr double max_negative_fraction = 0.05;
constexpr std::array<const char*, 3> channel_names{"red", "green", "blue"};

/// Position of pixel (x, y) of a stored image in the upright one: base + x * step_x + y * step_y, samples of a plane
/// without gaps. EXIF 2.32 table 6.
struct Placement {
  int width = 0;  // width of the upright image
  int height = 0;
  std::ptrdiff_t base = 0;
  std::ptrdiff_t step_x = 1;
  std::ptrdiff_t step_y = 0;
};

Placement placement_of(int width, int height, Orientation orientation) {
  const int o = static_cast<int>(orientation);
  const bool transposed = o >= 5;
  const bool flip_x = o == 2 || o == 3 || o == 7 || o == 8;  // horizontal flip of the stored image
  const bool flip_y = o == 3 || o == 4 || o == 6 || o == 7;
  Placement p;
  p.width = transposed ? height : width;
  p.height = transposed ? width : height;
  p.step_x = transposed ? p.width : 1;
  p.step_y = transposed ? 1 : p.width;
  if (flip_x) p.base += p.step_x * (width - 1);
  if (flip_y) p.base += p.step_y * (height - 1);
  if (flip_x) p.step_x = -p.step_x;
  if (flip_y) p.step_y = -p.step_y;
  return p;
}

bool is_grey(const auto& codes) {
  for (int y = 0; y < codes.height(); ++y) {
    const auto* row = codes.row(y);
    for (int x = 0; x < codes.width(); x += 3) {
      if (row[x] != row[x + 1] || row[x] != row[x + 2]) return false;
    }
  }
  return true;
}

template <class Code>
Result<SceneLinear> light_of_codes(const Encoded<Code>& picture, const DisplayColour& colour, Orientation orientation,
                                   Executor& executor) {
  if (colour.grey && !is_grey(picture.codes)) {
    return fail(ErrorCode::malformed, "the image has colours, its ICC profile is one for grey: convert it to sRGB");
  }
  const Placement p = placement_of(picture.width(), picture.height(), orientation);
  SceneLinear xyz(p.width, p.height);
  std::array<std::array<float, 3>, 3> m{};
  for (int i = 0; i < 3; ++i) std::copy_n(colour.to_xyz[i].begin(), 3, m[i].begin());
  const std::array<const float*, 3> curve{colour.curve[0].data(), colour.curve[1].data(), colour.curve[2].data()};
  const std::array<float*, 3> out{xyz.plane[0].data(), xyz.plane[1].data(), xyz.plane[2].data()};
  for_each_band(executor, picture.height(), [&](RowBand band, int /*index*/) {
    for (int y = band.first; y < band.last; ++y) {
      const Code* in = picture.codes.row(y);
      std::ptrdiff_t at = p.base + y * p.step_y;
      for (int x = 0; x < picture.width(); ++x, in += 3, at += p.step_x) {
        const float r = curve[0][in[0]], g = curve[1][in[1]], b = curve[2][in[2]];
        for (int i = 0; i < 3; ++i) out[i][at] = m[i][0] * r + m[i][1] * g + m[i][2] * b;
      }
    }
  });
  return xyz;
}

/// A sample of a float image, by its index in the order of rows, pixels and channels.
struct Place {
  std::int64_t index = std::numeric_limits<std::int64_t>::max();
  bool found() const { return index != std::numeric_limits<std::int64_t>::max(); }
};

std::string text_of(const SceneLinear& picture, Place place) {
  const auto pixel = place.index / 3;
  const int x = static_cast<int>(pixel % picture.width()), y = static_cast<int>(pixel / picture.width());
  const auto channel = static_cast<std::size_t>(place.index % 3);
  return std::string(channel_names[channel]) + " of the pixel at column " + std::to_string(x) + ", row " +
         std::to_string(y) + " is " + number_text(picture.plane[channel].at(x, y));
}

struct Survey {
  Place not_finite;
  std::int64_t negatives = 0;
  float least = 0;
  double positive_sum = 0;
  double negative_sum = 0;
};

Survey survey_band(const SceneLinear& picture, RowBand band) {
  Survey survey;
  for (int y = band.first; y < band.last; ++y) {
    const std::array<const float*, 3> row{picture.plane[0].row(y), picture.plane[1].row(y), picture.plane[2].row(y)};
    for (int x = 0; x < picture.width(); ++x) {
      for (int c = 0; c < 3; ++c) {
        const float value = row[c][x];
        if (value >= 0 && value <= std::numeric_limits<float>::max()) {
          survey.positive_sum += value;
          continue;
        }
        if (!std::isfinite(value)) {
          survey.not_finite.index = 3 * (std::int64_t{y} * picture.width() + x) + c;
          return survey;
        }
        ++survey.negatives;
        survey.negative_sum -= value;
        survey.least = std::min(survey.least, value);
      }
    }
  }
  return survey;
}

Survey survey_of(const SceneLinear& picture, Executor& executor) {
  std::vector<Survey> bands(static_cast<std::size_t>(executor.width()));
  for_each_band(executor, picture.plane[0].height(),
                [&](RowBand band, int index) { bands[index] = survey_band(picture, band); });
  Survey all;
  for (const Survey& band : bands) {
    all.not_finite.index = std::min(all.not_finite.index, band.not_finite.index);
    all.negatives += band.negatives;
    all.positive_sum += band.positive_sum;
    all.negative_sum += band.negative_sum;
    all.least = std::min(all.least, band.least);
  }
  return all;
}

Result<void> check_radiance(const SceneLinear& picture, Executor& executor, Negatives negatives,
                            std::vector<std::string>& warnings) {
  const Survey survey = survey_of(picture, executor);
  if (survey.not_finite.found()) {
    return fail(ErrorCode::malformed,
                text_of(picture, survey.not_finite) + ", which is not a valid radiance: repair the image");
  }
  if (survey.negatives == 0) return {};
  const double samples = 3.0 * static_cast<double>(picture.plane[0].size());
  const std::string found = number_text(100 * static_cast<double>(survey.negatives) / samples, 3) +
                            " % of the samples are negative, down to " + number_text(survey.least, 3);
  const double fraction = survey.negative_sum / (survey.positive_sum + survey.negative_sum);
  const std::string light = number_text(100 * fraction, 3) + " % of its light";
  if (negatives == Negatives::few && fraction > max_negative_fraction) {
    return fail(ErrorCode::malformed, found + ", " + light + " and more than the " +
                                          number_text(100 * max_negative_fraction) +
                                          " % that filters leave: clip the image at 0 if that is meant");
  }
  warnings.push_back(found + ", " + light + ": they become 0");
  return {};
}

}  // namespace

Result<SceneLinear> light_of(const Encoded8& picture, const DisplayColour& colour, Orientation orientation,
                             Executor& executor) {
  return light_of_codes(picture, colour, orientation, executor);
}

Result<SceneLinear> light_of(const Encoded16& picture, const DisplayColour& colour, Orientation orientation,
                             Executor& executor) {
  return light_of_codes(picture, colour, orientation, executor);
}

Result<SceneLinear> light_of(const SceneLinear& picture, const Matrix3& to_xyz, Orientation orientation,
                             Executor& executor, std::vector<std::string>& warnings, Negatives negatives) {
  if (auto sound = check_radiance(picture, executor, negatives, warnings); !sound)
    return tl::make_unexpected(sound.error());
  const Placement p = placement_of(picture.width(), picture.height(), orientation);
  SceneLinear xyz(p.width, p.height);
  std::vector<Place> beyond(static_cast<std::size_t>(executor.width()));
  for_each_band(executor, picture.height(), [&](RowBand band, int index) {
    for (int y = band.first; y < band.last; ++y) {
      std::ptrdiff_t at = p.base + y * p.step_y;
      for (int x = 0; x < picture.width(); ++x, at += p.step_x) {
        Vector3 rgb{};
        for (int c = 0; c < 3; ++c) rgb[c] = std::max(0.0F, picture.plane[c].row(y)[x]);
        const Vector3 v = to_xyz * rgb;
        for (int i = 0; i < 3; ++i) {
          xyz.plane[i].data()[at] = static_cast<float>(std::max(0.0, v[i]));  // with AP0, Y can be below 0
          const bool fits = std::fabs(v[i]) <= std::numeric_limits<float>::max();
          if (!fits && !beyond[index].found()) beyond[index].index = 3 * (std::int64_t{y} * picture.width() + x);
        }
      }
    }
  });
  for (const Place& place : beyond) {
    if (place.found()) {
      return fail(ErrorCode::malformed, text_of(picture, place) + ", and its light is beyond the range of floats");
    }
  }
  return xyz;
}

}  // namespace lowlux::capture
