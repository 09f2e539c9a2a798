#include "capture/dng/sample_changes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <type_traits>
#include <utility>

namespace lowlux::capture {
namespace {

constexpr double largest_code = 65535;
constexpr double max_black_dn = 16384;                           // a quarter of the codes
constexpr std::int64_t max_black_sites = std::int64_t{1} << 26;  // of a black level, 512 MiB

/// Applies changes to the samples of row y, one change after the other.
void change_row(std::span<const SampleChange> changes, int y, int planes, std::span<double> row) {
  const int width = static_cast<int>(row.size()) / planes;
  for (const auto& [area, function, is_delta] : changes) {
    if (y < area.top || y >= area.bottom || (y - area.top) % area.row_pitch != 0) continue;
    const int last_plane = std::min(area.first_plane + area.planes, planes);
    for (int x = area.left; x < std::min(area.right, width); x += area.column_pitch) {
      for (int plane = area.first_plane; plane < last_plane; ++plane) {
        double& value = row[static_cast<std::size_t>(x) * planes + plane];
        value = function(value, x, y, plane);
      }
    }
  }
}

/// Calls `use` with a view of the readout's samples that can be written, of std::uint16_t or float.
template <class Use>
void with_writable(RawDn& raw, Use use) {
  if (raw.is_float()) return use(raw.dn_float.view());
  use(raw.dn.view());
}

template <class Sample>
Sample sample_of(double dn) {
  if constexpr (std::is_floating_point_v<Sample>) {
    return static_cast<Sample>(dn);
  } else {
    return dn > 0 ? static_cast<Sample>(std::lround(std::min(dn, largest_code))) : Sample{0};  // 0 if not a number
  }
}

double mean_of(const std::vector<double>& values) {
  if (values.empty()) return 0;
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double highest_of(const std::vector<double>& values) { return values.empty() ? 0 : *std::ranges::max_element(values); }

/// Returns the mean black level of each plane.
std::array<double, 3> mean_black(const BlackLevel& black) {
  const double deltas = mean_of(black.column_dn) + mean_of(black.row_dn);
  std::array<double, 3> mean{};
  const auto sites = static_cast<double>(black.rows) * black.columns;
  for (std::size_t i = 0; i < black.pattern_dn.size(); ++i) {
    mean[i % static_cast<std::size_t>(black.samples)] += black.pattern_dn[i] / sites;
  }
  for (double& dn : mean) dn += deltas;
  return mean;
}

/// Returns after how many columns a black level repeats once the deltas of an area are subtracted.
int columns_with(int columns, const SampleChange& change, int width) {
  const GainMap& area = change.area;
  const bool repeats = area.points_h == 1 && area.left < area.column_pitch && area.right >= width;
  return repeats ? static_cast<int>(std::min<std::int64_t>(std::lcm<std::int64_t>(columns, area.column_pitch), width))
                 : width;
}

int rows_with(int rows, const SampleChange& change, int height) {
  const GainMap& area = change.area;
  const bool repeats = area.points_v == 1 && area.top < area.row_pitch && area.bottom >= height;
  return repeats ? static_cast<int>(std::min<std::int64_t>(std::lcm<std::int64_t>(rows, area.row_pitch), height))
                 : height;
}

/// Subtracts a delta from the black levels of rows or columns, if it is the same for all pixels of each.
bool lower_lines(const SampleChange& delta, double range_dn, const Rect& active, BlackLevel& black) {
  const GainMap& area = delta.area;
  const auto subtract = [&](std::vector<double>& levels, int lines, const auto& delta_of) {
    levels.resize(static_cast<std::size_t>(lines));
    for (int line = 0; line < lines; ++line) levels[static_cast<std::size_t>(line)] -= range_dn * delta_of(line);
    return true;
  };
  const auto delta_at = [&](int x, int y) { return includes(area, x, y, 0) ? delta.function(0, x, y, 0) : 0; };
  if (area.points_h == 1 && area.left == 0 && area.right >= active.width && area.column_pitch == 1) {
    return subtract(black.row_dn, active.height, [&](int y) { return delta_at(0, y); });
  }
  if (area.points_v == 1 && area.top == 0 && area.bottom >= active.height && area.row_pitch == 1) {
    return subtract(black.column_dn, active.width, [&](int x) { return delta_at(x, 0); });
  }
  return false;
}

/// Subtracts deltas from the black level, whose pattern becomes as large as they require.
std::optional<std::string> lower_black(const std::vector<SampleChange>& deltas, int planes, const BlackLevel& black,
                                       RawDn& raw) {
  BlackLevel out = black;
  std::vector<SampleChange> of_sites;
  const std::array<double, 3> mean = mean_black(black);
  const auto range_dn = [&](int plane) { return raw.white_dn[plane] - mean[plane]; };
  for (const SampleChange& delta : deltas) {
    if (planes == 1 && lower_lines(delta, range_dn(0), raw.active, out)) continue;
    of_sites.push_back(delta);
    out.rows = rows_with(out.rows, delta, raw.active.height);
    out.columns = columns_with(out.columns, delta, raw.active.width);
  }
  if (std::int64_t{out.rows} * out.columns * planes > max_black_sites) return "it has a delta for too many pixels";
  const double highest = highest_of(out.row_dn) + highest_of(out.column_dn);
  out.pattern_dn.clear();
  std::vector<double> row(static_cast<std::size_t>(out.columns) * planes);
  for (int y = 0; y < out.rows; ++y) {
    std::fill(row.begin(), row.end(), 0.0);
    change_row(of_sites, y, planes, row);
    for (int i = 0; i < std::ssize(row); ++i) {
      const int plane = i % planes, site = y % black.rows * black.columns + i / planes % black.columns;
      const auto level = static_cast<std::size_t>(site) * planes + plane;
      out.pattern_dn.push_back(black.pattern_dn[level] - row[static_cast<std::size_t>(i)] * range_dn(plane));
      if (!(out.pattern_dn.back() + highest < raw.white_dn[plane])) return "its deltas raise black above white";
    }
  }
  raw.black_tag = std::move(out);
  return std::nullopt;
}

/// Returns the black level of codes after changes, at which code 0 stays 0 or more everywhere.
double black_of_codes(const std::vector<SampleChange>& changes, const BlackLevel& black, const RawDn& raw) {
  const double range_dn = raw.white_dn[0] - mean_black(black)[0];
  std::vector<double> row(static_cast<std::size_t>(raw.active.width));
  double least = 0;
  for (int y = 0; y < raw.active.height; ++y) {
    for (int x = 0; x < raw.active.width; ++x) row[static_cast<std::size_t>(x)] = -black.at(x, y) / range_dn;
    change_row(changes, y, 1, row);
    least = std::min(least, *std::ranges::min_element(row));
  }
  return std::min(std::ceil(largest_code * -least / (1 - least)), max_black_dn);
}

}  // namespace

bool includes(const GainMap& area, int x, int y, int plane) {
  return x >= area.left && x < area.right && (x - area.left) % area.column_pitch == 0 && y >= area.top &&
         y < area.bottom && (y - area.top) % area.row_pitch == 0 && plane >= area.first_plane &&
         plane - area.first_plane < area.planes;
}

void change_readout(const std::vector<SampleChange>& changes, int planes, RawDn& raw) {
  with_writable(raw, [&]<class Sample>(PlaneView<Sample> samples) {
    std::vector<SampleChange> rounded = changes;
    for (SampleChange& change : rounded) {
      change.function = [of = change.function](double value, int x, int y, int plane) {
        return static_cast<double>(sample_of<Sample>(of(value, x, y, plane)));
      };
    }
    std::vector<double> row(static_cast<std::size_t>(samples.width));
    for (int y = 0; y < samples.height; ++y) {
      std::copy_n(samples.row(y), row.size(), row.begin());
      change_row(rounded, y, planes, row);
      std::transform(row.begin(), row.end(), samples.row(y), sample_of<Sample>);
    }
  });
}

std::optional<std::string> change_fractions(const std::vector<SampleChange>& changes, int planes,
                                            const BlackLevel& black, RawDn& raw) {
  if (std::ranges::all_of(changes, &SampleChange::is_delta)) return lower_black(changes, planes, black, raw);
  const std::array<double, 3> mean = mean_black(black);
  const double black_dn = planes > 1 || raw.is_float() ? 0 : black_of_codes(changes, black, raw);
  const Rect& active = raw.active;
  std::vector<double> row(static_cast<std::size_t>(active.width) * planes);
  const auto range = [&](int plane) { return raw.white_dn[plane] - mean[plane]; };
  with_writable(raw, [&]<class Sample>(PlaneView<Sample> samples) {
    for (int y = 0; y < active.height; ++y) {
      Sample* const dn = samples.row(active.y + y) + std::ptrdiff_t{active.x} * planes;
      for (int i = 0; i < std::ssize(row); ++i) {
        const int plane = i % planes;
        const double fraction = (dn[i] - black.at(i / planes, y, plane)) / range(plane);
        row[i] = dn[i] < raw.white_dn[plane] ? fraction : raw.is_float() ? std::max(fraction, 1.0) : 1;
      }
      change_row(changes, y, planes, row);
      for (int i = 0; i < std::ssize(row); ++i) {
        const int plane = i % planes;
        dn[i] = raw.is_float() ? sample_of<Sample>(black.at(i / planes, y, plane) + row[i] * range(plane))
                               : sample_of<Sample>(black_dn + row[i] * (largest_code - black_dn));
      }
    }
  });
  if (raw.is_float()) return std::nullopt;
  raw.black_tag = BlackLevel{.samples = planes, .pattern_dn = std::vector<double>(planes, black_dn)};
  raw.white_dn.fill(largest_code);
  raw.masked.clear();
  raw.masked_is_stated = false;
  return std::nullopt;
}

}  // namespace lowlux::capture
