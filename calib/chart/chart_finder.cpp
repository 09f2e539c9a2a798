#include "calib/chart/chart_finder.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

#include <fmt/format.h>

#include "isp/model/spectrum/cie_data.h"

namespace lowlux::calib {
namespace {

constexpr int max_shapes = 8;                  // of one detection: images show few charts, not dozens
constexpr double worst_relative_error = 0.03;  // of the median patch: it changes colours by one or two CIEDE2000

/// Minimum number of patches; one of them is left out in cross-validation.
constexpr int min_patches = static_cast<int>(min_colour_samples) + 1;

/// Longer sides of the resized images: the detector enlarges small images, and shrinking reduces noise.
constexpr std::array longer_sides{1000, 640, 420};
/// Factors on the gain that brings the 99th percentile to white. A chart in front of a bright window is dark.
constexpr std::array looks{1.0, 3.0};

/// Returns means of blocks of n x n pixels; incomplete blocks are left out.
CameraRgb shrunk(const CameraRgb& picture, int n) {
  CameraRgb out(picture.width() / n, picture.height() / n);
  for (std::size_t c = 0; c < 3; ++c) {
    for (int y = 0; y < out.height(); ++y) {
      for (int x = 0; x < out.width(); ++x) {
        float sum = 0;
        for (int j = 0; j < n; ++j) {
          for (int i = 0; i < n; ++i) sum += picture.plane[c].at(n * x + i, n * y + j);
        }
        out.plane[c].at(x, y) = sum / static_cast<float>(n * n);
      }
    }
  }
  return out;
}

/// Returns the value below which 99 % of a plane lie; at least the smallest positive float.
float bright_value(const Plane<float>& plane) {
  std::vector<float> values(plane.data(), plane.data() + plane.size());
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(values.size() * 99 / 100);
  std::nth_element(values.begin(), place, values.end());
  return std::max(*place, 1e-30F);
}

/// Converts to 8-bit codes, blue first: each channel to the same white, an approximate white balance, then a square
/// root, which keeps dark patches separate.
std::vector<std::uint8_t> codes_of(const CameraRgb& picture, double gain) {
  std::vector<std::uint8_t> out(3 * picture.plane[0].size());
  for (std::size_t c = 0; c < 3; ++c) {
    const float* value = picture.plane[c].data();
    const float scale = static_cast<float>(gain) / bright_value(picture.plane[c]);
    for (std::size_t i = 0; i < picture.plane[c].size(); ++i) {
      const float code = 255 * std::sqrt(std::clamp(scale * value[i], 0.0F, 1.0F));
      out[3 * i + 2 - c] = static_cast<std::uint8_t>(std::lround(code));
    }
  }
  return out;
}

/// Returns the colour error of patches as a ColorChecker's; infinite if the patches cannot be one. The assumed light
/// matters little: a matrix nearly converts one light to another.
double chart_error(const std::array<ChartPatch, chart_patch_count>& patches) {
  static const Spectrum light = *isp::light_named("D50");
  static const auto reference = *chart_reference(light);
  ColourFitOptions options;
  options.white = isp::xyz_of(light);
  options.white = {options.white.x / options.white.y, 1, options.white.z / options.white.y};
  options.minimise_ciede2000 = false;
  const auto samples = samples_of(patches, reference);
  const auto fit = fit_colour(samples, options);
  return fit ? summary_of(colour_errors(*fit, samples, options.white)).mean : HUGE_VAL;
}

FoundChart turned_right(const ChartPicture& picture, const ChartGrid& grid) {
  FoundChart best;
  best.ciede2000 = HUGE_VAL;
  for (const ChartTurn turn : all_chart_turns) {
    FoundChart tried{grid, {}, 0};
    tried.grid.turn = turn;
    tried.patches = measure_patches(picture, tried.grid);
    tried.ciede2000 = chart_error(tried.patches);
    if (turn == ChartTurn::as_is || tried.ciede2000 < best.ciede2000) best = tried;
  }
  return best;
}

/// Returns whether two grids are on the same chart: the middle of one lies within the other's half.
bool same_chart(const ChartGrid& a, const ChartGrid& b) {
  const PicturePoint p = a.at(3, 2), q = b.at(3, 2), edge = b.at(3, 0);
  return std::hypot(p.x - q.x, p.y - q.y) < std::hypot(edge.x - q.x, edge.y - q.y);
}

/// Results of one or more detections in an image.
struct Search {
  std::vector<FoundChart> charts;
  std::optional<FoundChart> unusable;  // a shape whose patches are clipped or too small to be measured
  int shapes = 0;
  double nearest = HUGE_VAL;  // CIEDE2000 of the best rejected shape
};

int measurable(const FoundChart& chart) {
  return static_cast<int>(std::count_if(chart.patches.begin(), chart.patches.end(), usable));
}

void judge(const FoundChart& chart, Search& search) {
  ++search.shapes;
  if (measurable(chart) < min_patches) {
    if (!search.unusable || measurable(chart) > measurable(*search.unusable)) search.unusable = chart;
    return;
  }
  search.nearest = std::min(search.nearest, chart.ciede2000);
  if (!(chart.ciede2000 <= worst_chart_ciede2000)) return;
  for (FoundChart& known : search.charts) {
    if (!same_chart(chart.grid, known.grid)) continue;
    if (chart.ciede2000 < known.ciede2000) known = chart;
    return;
  }
  search.charts.push_back(chart);
}

Result<void> look(const ChartPicture& picture, const CameraRgb& small, int shrink, double gain, DetectCharts* detect,
                  Search& search) {
  const std::vector<std::uint8_t> codes = codes_of(small, gain);
  std::array<ChartShape, max_shapes> shapes;
  const int count = detect({codes.data(), small.width(), small.height()}, shapes.data(), max_shapes);
  if (count < 0) return fail(ErrorCode::unreadable, "OpenCV's chart detector failed on the image");
  for (int i = 0; i < count; ++i) {
    // The detector's model has patches of 2.5 that are 0.25 apart, in a border of 0.25: cells of 2.75 that end 0.125
    // inside its box.
    const auto box = grid_of(shapes[static_cast<std::size_t>(i)].corner);
    if (!box) continue;
    const auto inner = [&](double u, double v) {
      constexpr double in_x = 0.125 / 16.75 * chart_columns, in_y = 0.125 / 11.25 * chart_rows;
      return box->at(in_x + u * (1 - 2 * in_x / chart_columns), in_y + v * (1 - 2 * in_y / chart_rows));
    };
    const auto cells =
        grid_of({inner(0, 0), inner(chart_columns, 0), inner(chart_columns, chart_rows), inner(0, chart_rows)});
    const auto grid = cells ? refined(*cells, small.view()) : std::nullopt;
    if (grid) judge(turned_right(picture, rescaled(*grid, shrink, 0.5 * (shrink - 1))), search);
  }
  return {};
}

Error none_found(const Search& search) {
  if (search.unusable) {
    double clipped = 0;
    for (const ChartPatch& patch : search.unusable->patches) {
      clipped += patch.clipped_fraction > max_clipped_fraction ? 1 : 0;
    }
    return {ErrorCode::insufficient,
            fmt::format("{} of the 24 patches of the probable chart can be measured, {} are needed: {} are clipped; {}",
                        measurable(*search.unusable), min_patches, clipped,
                        clipped > 0 ? "expose shorter" : "the chart must be larger in the image"),
            {}};
  }
  const std::string seen =
      search.shapes == 0 ? std::string("no grid of 6 x 4 patches was found")
      : std::isfinite(search.nearest)
          ? fmt::format(
                "the most similar grid differs from a ColorChecker by {:.0f} CIEDE2000, more than the limit of {:g}",
                search.nearest, worst_chart_ciede2000)
          : std::string("the colours of the most similar grid cannot be those of a ColorChecker");
  return {ErrorCode::insufficient,
          fmt::format("no chart found: {}; the image must show a complete ColorChecker Classic, with patches of at "
                      "least 15 pixels at half size",
                      seen),
          {}};
}

Result<FoundChart> chosen(const Search& search) {
  if (search.charts.empty()) return tl::make_unexpected(none_found(search));
  if (search.charts.size() > 1) {
    std::string places;
    for (const FoundChart& chart : search.charts) {
      const PicturePoint middle = chart.grid.at(3, 2);
      places += fmt::format("{}({:.0f}, {:.0f})", places.empty() ? "" : ", ", 2 * middle.x, 2 * middle.y);
    }
    return fail(ErrorCode::insufficient,
                fmt::format("{} charts were found, at {}: the image must show only one", search.charts.size(), places));
  }
  const FoundChart& chart = search.charts.front();
  const double error = relative_error(chart.patches);
  if (!(error <= worst_relative_error)) {
    return fail(ErrorCode::insufficient,
                fmt::format("the chart is too dark: the standard error of its median patch is {:.1f} %, at most {:g} % "
                            "are allowed; expose longer, or take a larger image of the chart",
                            100 * error, 100 * worst_relative_error));
  }
  return chart;
}

}  // namespace

std::vector<ColourSample> samples_of(const std::array<ChartPatch, chart_patch_count>& patches,
                                     const std::array<isp::Xyz, 24>& reference) {
  std::vector<ColourSample> out;
  out.reserve(patches.size());
  for (std::size_t i = 0; i < patches.size(); ++i) {
    if (!usable(patches[i])) continue;
    const std::size_t column = i % chart_columns, row = i / chart_columns;
    out.push_back({patches[i].camera_rgb, reference[i], 2 * (static_cast<double>(column) + 0.5) / chart_columns - 1,
                   2 * (static_cast<double>(row) + 0.5) / chart_rows - 1});
  }
  return out;
}

std::optional<Vector3> chart_neutral(const std::array<ChartPatch, chart_patch_count>& patches,
                                     const LightGradient& light) {
  Vector3 sum{};
  for (int column = 0; column < chart_columns; ++column) {
    const ChartPatch& patch = patches[chart_patch_count - chart_columns + static_cast<std::size_t>(column)];
    const double x = 2 * (column + 0.5) / chart_columns - 1, y = 2 * (chart_rows - 0.5) / chart_rows - 1;
    for (std::size_t c = 0; c < 3 && usable(patch); ++c) sum[c] += patch.camera_rgb[c] / light.at(x, y);
  }
  const double largest = *std::max_element(sum.begin(), sum.end());
  if (!(*std::min_element(sum.begin(), sum.end()) > 0)) return std::nullopt;
  return Vector3{sum[0] / largest, sum[1] / largest, sum[2] / largest};
}

Result<FoundChart> find_chart(const ChartPicture& picture, DetectCharts* detect) {
  constexpr int smallest_side = 64;  // six patches of ten pixels
  if (picture.rgb.width() < smallest_side || picture.rgb.height() < smallest_side) {
    return tl::make_unexpected(none_found({}));
  }
  Search search;
  int last_shrink = 0;
  for (const int side : longer_sides) {
    const int longer = std::max(picture.rgb.width(), picture.rgb.height());
    const int shrink = std::max(1, (longer + side / 2) / side);
    if (shrink == last_shrink) continue;
    last_shrink = shrink;
    const CameraRgb small = shrunk(picture.rgb, shrink);
    for (const double gain : looks) {
      if (auto looked = look(picture, small, shrink, gain, detect, search); !looked) {
        return tl::make_unexpected(looked.error());
      }
    }
    if (!search.charts.empty()) break;
  }
  return chosen(search);
}

}  // namespace lowlux::calib
