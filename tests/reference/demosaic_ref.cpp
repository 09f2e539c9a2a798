#include "tests/reference/demosaic_ref.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

namespace lowlux::reference {
namespace {

/// Holds a quantity of each pixel of a frame and of a border of mirrored pixels around it.
class Field {
 public:
  static constexpr int border = 24;

  Field(int width, int height, const std::function<double(int, int)>& value)
      : width_(width), height_(height), value_(static_cast<std::size_t>(stride()) * (height + 2 * border)) {
    for (int y = -border; y < height + border; ++y) {
      for (int x = -border; x < width + border; ++x) value_[place(x, y)] = value(x, y);
    }
  }
  /// Returns the value at a pixel; 0 beyond the border, on which no result inside the frame depends.
  double operator()(int x, int y) const {
    const bool known = x >= -border && y >= -border && x < width_ + border && y < height_ + border;
    return known ? value_[place(x, y)] : 0;
  }

 private:
  int stride() const { return width_ + 2 * border; }
  std::size_t place(int x, int y) const {
    return static_cast<std::size_t>(y + border) * static_cast<std::size_t>(stride()) +
           static_cast<std::size_t>(x + border);
  }
  int width_, height_;
  std::vector<double> value_;
};

struct Code {
  double offset;
  double root() const { return std::cbrt(offset); }
  double slope() const { return 1 / (3 * root() * root()); }
  double encoded(double x) const { return x < 0 ? root() + slope() * x : std::cbrt(x + offset); }
  double decoded(double u) const { return u < root() ? (u - root()) / slope() : u * u * u - offset; }
};

double limited(double value, double low, double high) {
  return std::isnan(value) ? high : std::clamp(value, low, high);
}

double sum_3x3(const Field& of, int x, int y, int step) {
  double sum = 0;
  for (int j = -1; j <= 1; ++j) {
    for (int i = -1; i <= 1; ++i) sum += of(x + step * i, y + step * j);
  }
  return sum;
}

/// Returns the bilinear interpolation at any pixel of a quantity known at the samples of one colour.
double bilinear(const Field& of, const std::function<bool(int, int)>& is_sample, int x, int y) {
  double sum = 0, weight = 0;
  for (int j = -1; j <= 1; ++j) {
    for (int i = -1; i <= 1; ++i) {
      if (!is_sample(x + i, y + j)) continue;
      const double w = (i == 0 ? 1 : 0.5) * (j == 0 ? 1 : 0.5);
      sum += w * of(x + i, y + j);
      weight += w;
    }
  }
  return sum / weight;
}

double median_3x3(const Field& of, int x, int y) {
  std::array<double, 9> v{};
  for (int k = 0; k < 9; ++k) v[static_cast<std::size_t>(k)] = of(x + k % 3 - 1, y + k / 3 - 1);
  std::nth_element(v.begin(), v.begin() + 4, v.end());
  return v[4];
}

std::vector<Rgb> by_residual(const LinearisedMosaic& mosaic, const LinearisedMosaic& codes, const Code& code,
                             const isp::Demosaic& how) {
  const int width = mosaic.width, height = mosaic.height;
  const auto field = [&](const std::function<double(int, int)>& value) { return Field(width, height, value); };
  const auto colour = [&](int x, int y) { return colour_at(mosaic.phase, x & 1, y & 1); };
  const auto is_green = [&](int x, int y) { return colour(x, y) == CfaColour::green; };
  const double scale = std::cbrt(limited(how.white, 1e-3, 1));
  const double ridge = 6e-4 * scale * scale;
  const double floor = 1e-4 * scale + 0.5 * 9 * std::sqrt(2 * 0.875) * limited(how.noise_std, 0, 1);

  const Field u = field([&](int x, int y) { return codes.at(x, y); });
  // Differences green - colour, along the row and along the column (Hamilton, Adams 1997).
  const auto difference = [&](int dx, int dy) {
    return field([&, dx, dy](int x, int y) {
      const double d = 0.5 * (u(x - dx, y - dy) + u(x + dx, y + dy)) -
                       0.25 * (u(x - 2 * dx, y - 2 * dy) + u(x + 2 * dx, y + 2 * dy)) - 0.5 * u(x, y);
      return is_green(x, y) ? -d : d;
    });
  };
  const Field dh = difference(1, 0), dv = difference(0, 1);
  const Field gh = field([&](int x, int y) { return std::fabs(dh(x + 1, y) - dh(x - 1, y)); });
  const Field gv = field([&](int x, int y) { return std::fabs(dv(x, y + 1) - dv(x, y - 1)); });
  // How far green shares the detail of the other colour: differences across a site in both directions.
  struct Detail {
    double own, green;
  };
  const auto detail = [&](int x, int y, int dx, int dy) -> Detail {
    const auto beside = [&](int k) {  // green at distance k: measured if odd, else the mean of those across
      const int px = x + k * dx, py = y + k * dy;
      return k % 2 != 0 ? u(px, py) : 0.5 * (u(px + dy, py + dx) + u(px - dy, py - dx));
    };
    return {u(x + 2 * dx, y + 2 * dy) - u(x - 2 * dx, y - 2 * dy),
            0.5 * (beside(1) - beside(-1)) + 0.5 * (beside(2) - beside(-2))};
  };
  const auto product = [&](double Detail::*a, double Detail::*b) {
    return field([&, a, b](int x, int y) {
      const Detail h = detail(x, y, 1, 0), v = detail(x, y, 0, 1);
      return h.*a * (h.*b) + v.*a * (v.*b);
    });
  };
  const Field own_squared = product(&Detail::own, &Detail::own), both = product(&Detail::own, &Detail::green),
              green_squared = product(&Detail::green, &Detail::green);
  const Field fine = field([&](int x, int y) {
    const double d = u(x - 1, y) + u(x + 1, y) - u(x, y - 1) - u(x, y + 1);
    return d * d;
  });
  const double noise = limited(how.noise_std, 0, 1), detail_floor = 1e-5 * scale * scale + 64 * noise * noise;
  const auto shared_detail = [&](int x, int y) {
    const double o = sum_3x3(own_squared, x, y, 2) / 9, g = sum_3x3(green_squared, x, y, 2) / 9;
    const double b = sum_3x3(both, x, y, 2) / 9, size = std::sqrt(o * g);
    const double alike = 1 + (2 * b - 1.25 * size) / (size + 4 * detail_floor);
    const double by_detail = std::min(alike, (2.5 * g + detail_floor) / (o + detail_floor));
    return std::clamp(std::max(by_detail, 4 * sum_3x3(fine, x, y, 2) / 9 / (o + detail_floor)), 0.0, 1.0);
  };
  // Green: four one-sided means, weighted by the gradients on their side (Pekkucuksen, Altunbasak 2010), as far as
  // green shares detail; for the rest the neighbouring greens with the same weights.
  const Field green = field([&](int x, int y) {
    if (is_green(x, y)) return u(x, y);
    double sum = 0, neighbours = 0, weights = 0;
    for (const auto& [dx, dy] : {std::pair{-1, 0}, std::pair{1, 0}, std::pair{0, -1}, std::pair{0, 1}}) {
      double mean = 0;
      for (int k = 0; k <= 4; ++k) mean += (dy == 0 ? dh : dv)(x + k * dx, y + k * dy) / 5;
      const double weight = std::pow(floor + sum_3x3(dy == 0 ? gh : gv, x + 2 * dx, y + 2 * dy, 1), -2);
      sum += weight * mean;
      neighbours += weight * (0.5 * (u(x - dx, y - dy) + u(x + dx, y + dy)) - u(x, y));
      weights += weight;
    }
    const double shared = shared_detail(x, y);
    return u(x, y) + (shared * sum + (1 - shared) * neighbours) / weights;
  });
  // Red and blue: residual interpolation (Kiku, Monno, Tanaka, Okutomi 2013) of the difference to green, with the slope
  // of a ridge regression in windows of 3x3 samples.
  std::array<std::vector<double>, 3> planes;
  for (const CfaColour c : {CfaColour::red, CfaColour::blue}) {
    const auto is_sample = [&](int x, int y) { return colour(x, y) == c; };
    const Field e = field([&](int x, int y) { return u(x, y) - green(x, y); });
    const Field raw_slope = field([&](int x, int y) {
      double g = 0, d = 0, gg = 0, gd = 0;
      for (int j = -2; j <= 2; j += 2) {
        for (int i = -2; i <= 2; i += 2) {
          g += green(x + i, y + j) / 9;
          d += e(x + i, y + j) / 9;
          gg += green(x + i, y + j) * green(x + i, y + j) / 9;
          gd += green(x + i, y + j) * e(x + i, y + j) / 9;
        }
      }
      return (gd - g * d) / (gg - g * g + ridge);
    });
    const Field slope = field([&](int x, int y) { return sum_3x3(raw_slope, x, y, 2) / 9; });
    const Field rest = field([&](int x, int y) { return e(x, y) - slope(x, y) * green(x, y); });
    const Field full = field(
        [&](int x, int y) { return bilinear(slope, is_sample, x, y) * green(x, y) + bilinear(rest, is_sample, x, y); });
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const double d = how.method == isp::DemosaicMethod::residual_median ? median_3x3(full, x, y) : full(x, y);
        planes[static_cast<std::size_t>(c)].push_back(code.decoded(green(x, y) + d));
      }
    }
  }
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) planes[1].push_back(code.decoded(green(x, y)));
  }
  std::vector<Rgb> out(planes[1].size());
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = {planes[0][i], planes[1][i], planes[2][i]};
  return out;
}

}  // namespace

std::vector<Rgb> demosaiced(const LinearisedMosaic& mosaic, const isp::Demosaic& how, double clip) {
  const Code code{limited(how.offset, 1e-6, 1)};
  LinearisedMosaic codes = mosaic;
  if (how.method != isp::DemosaicMethod::malvar) {
    for (double& value : codes.value) value = code.encoded(std::clamp(std::min(value, clip), -1.0, 1e9));
  }
  std::vector<Rgb> out;
  if (how.method >= isp::DemosaicMethod::residual) {
    out = by_residual(mosaic, codes, code, how);
  } else {
    for (int y = 0; y < mosaic.height; ++y) {
      for (int x = 0; x < mosaic.width; ++x) out.push_back(malvar(codes, x, y));
    }
    if (how.method == isp::DemosaicMethod::encoded_malvar) {
      for (Rgb& pixel : out) {
        for (double& value : pixel) value = code.decoded(value);
      }
    }
  }
  for (int y = 0; y < mosaic.height; ++y) {
    for (int x = 0; x < mosaic.width; ++x) {
      const auto measured = static_cast<std::size_t>(colour_at(mosaic.phase, x, y));
      out[static_cast<std::size_t>(y) * mosaic.width + x][measured] = mosaic.at(x, y);
    }
  }
  return out;
}

}  // namespace lowlux::reference
