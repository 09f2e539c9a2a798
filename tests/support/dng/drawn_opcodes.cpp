#include "tests/support/dng/drawn_opcodes.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

namespace lowlux::test {
namespace {

struct Area {
  int top = 0, left = 0, bottom = 0, right = 0, plane = 0, planes = 1, row_pitch = 1, column_pitch = 1;

  bool includes(int x, int y, int p) const {
    return x >= left && x < right && (x - left) % column_pitch == 0 && y >= top && y < bottom &&
           (y - top) % row_pitch == 0 && p >= plane && p < plane + planes;
  }
};

int below(int count, std::mt19937& draw) { return static_cast<int>(draw() % static_cast<unsigned>(count)); }

double between(double least, double most, std::mt19937& draw) {
  return std::uniform_real_distribution<double>(least, most)(draw);
}

/// Half of the areas are all of the image, in all planes.
Area draw_area(const OpcodeImage& image, std::mt19937& draw) {
  Area area{.bottom = image.height, .right = image.width, .planes = image.planes};
  if (below(2, draw) == 0) {
    area.top = below(image.height / 3, draw), area.left = below(image.width / 3, draw);
    area.bottom = image.height + 4 - below(image.height / 3, draw);  // some reach beyond the image
    area.right = image.width + 4 - below(image.width / 3, draw);
    area.plane = below(image.planes, draw);
    area.planes = 1 + below(3, draw);
  }
  area.row_pitch = 1 + below(3, draw), area.column_pitch = 1 + below(3, draw);
  return area;
}

void append_area(std::vector<std::byte>& out, const Area& a) {
  for (const int n : {a.top, a.left, a.bottom, a.right, a.plane, a.planes, a.row_pitch, a.column_pitch}) {
    append_u32(out, static_cast<std::uint32_t>(n));
  }
}

template <class Function>
auto inside(const Area& area, Function function) {
  return [area, function](double value, int x, int y, int plane) {
    return area.includes(x, y, plane) ? function(value, x, y, plane) : value;
  };
}

DrawnOpcode lines(std::uint32_t id, const OpcodeImage& image, std::mt19937& draw) {
  const Area area = draw_area(image, draw);
  const bool of_rows = id == 10 || id == 12, is_gain = id >= 12;
  const int first = of_rows ? area.top : area.left, pitch = of_rows ? area.row_pitch : area.column_pitch;
  const int count = ((of_rows ? area.bottom : area.right) - first + pitch - 1) / pitch;
  const double size = image.list == 1 ? 40 : 0.01;
  std::vector<float> values;
  for (int i = 0; i < count; ++i) {
    values.push_back(static_cast<float>(is_gain ? between(0.95, 1.05, draw) : between(-size, size, draw)));
  }
  DrawnOpcode out{.encoded = {.id = id}, .is_gain = is_gain};
  append_area(out.encoded.parameters, area);
  append_u32(out.encoded.parameters, static_cast<std::uint32_t>(count));
  for (const float value : values) append_f32(out.encoded.parameters, value);
  out.truth = inside(area, [=](double v, int x, int y, int) {
    const auto number = static_cast<double>(values[static_cast<std::size_t>(((of_rows ? y : x) - first) / pitch)]);
    return is_gain ? v * number : v + number;
  });
  return out;
}

/// Below black a function continues as its mirror image, and above white with slope 1.
template <class Function>
auto continued(int list, Function f) {
  return [=](double v, int, int, int) {
    if (list == 1) return f(v);
    return v < 0 ? 2 * f(0.0) - f(-v) : v > 1 ? f(1.0) + v - 1 : f(v);
  };
}

DrawnOpcode polynomial(const OpcodeImage& image, std::mt19937& draw) {
  const Area area = draw_area(image, draw);
  std::vector<double> k;
  if (image.list == 1) {
    k = {between(-20, 20, draw), between(0.95, 1.02, draw), between(-1e-7, 1e-7, draw)};
  } else {
    const double square = between(0, 0.2, draw), cube = between(0, 0.1, draw);
    k = {between(0, 0.01, draw), 0.98 - square - cube, square, cube};
  }
  DrawnOpcode out{.encoded = {.id = 8}, .is_map = true};
  append_area(out.encoded.parameters, area);
  append_u32(out.encoded.parameters, static_cast<std::uint32_t>(k.size() - 1));
  for (const double number : k) append_f64(out.encoded.parameters, number);
  out.truth = inside(area, continued(image.list, [k](double x) {
                       double sum = 0;
                       for (std::size_t i = 0; i < k.size(); ++i) sum += k[i] * std::pow(x, static_cast<double>(i));
                       return sum;
                     }));
  return out;
}

DrawnOpcode table(const OpcodeImage& image, std::mt19937& draw) {
  const Area area = draw_area(image, draw);
  const int size = 40000 + below(25536, draw);
  const double bend = between(0.9, 1.1, draw);
  std::vector<int> entries;
  for (int i = 0; i < size; ++i) entries.push_back(static_cast<int>(std::lround(65000 * std::pow(i / 65535.0, bend))));
  DrawnOpcode out{.encoded = {.id = 7}, .is_map = true};
  append_area(out.encoded.parameters, area);
  append_u32(out.encoded.parameters, static_cast<std::uint32_t>(size));
  for (const int entry : entries) {
    out.encoded.parameters.push_back(static_cast<std::byte>(entry >> 8));
    out.encoded.parameters.push_back(static_cast<std::byte>(entry & 255));
  }
  const double scale = image.list == 1 ? 1 : 65535;
  out.truth =
      inside(area, continued(image.list, [=](double x) {
               const double at = std::min(x * scale, size - 1.0);
               const int before = static_cast<int>(std::floor(at)), after = std::min(before + 1, size - 1);
               return ((after - at) * entries[static_cast<std::size_t>(before)] +
                       (before == after ? 1 + at - after : at - before) * entries[static_cast<std::size_t>(after)]) /
                      scale;
             }));
  return out;
}

DrawnOpcode gain_map(const OpcodeImage& image, std::mt19937& draw) {
  const Area area = draw_area(image, draw);
  const int rows = 1 + below(4, draw), columns = 1 + below(4, draw), planes = 1 + below(3, draw);
  const double spacing_v = between(0.2, 0.5, draw), spacing_h = between(0.2, 0.5, draw);
  const double origin_v = between(0, 0.2, draw), origin_h = between(0, 0.2, draw);
  std::vector<float> gain;
  for (int i = 0; i < rows * columns * planes; ++i) gain.push_back(static_cast<float>(between(0.9, 1.2, draw)));
  DrawnOpcode out{.encoded = {.id = 9}, .is_gain = true};
  append_area(out.encoded.parameters, area);
  append_u32(out.encoded.parameters, static_cast<std::uint32_t>(rows));
  append_u32(out.encoded.parameters, static_cast<std::uint32_t>(columns));
  for (const double number : {spacing_v, spacing_h, origin_v, origin_h}) append_f64(out.encoded.parameters, number);
  append_u32(out.encoded.parameters, static_cast<std::uint32_t>(planes));
  for (const float g : gain) append_f32(out.encoded.parameters, g);
  out.truth = inside(area, [=](double v, int x, int y, int plane) {
    const double row = std::clamp(((y + 0.5) / image.height - origin_v) / spacing_v, 0.0, rows - 1.0);
    const double column = std::clamp(((x + 0.5) / image.width - origin_h) / spacing_h, 0.0, columns - 1.0);
    double sum = 0;
    for (int i = 0; i < rows; ++i) {
      for (int j = 0; j < columns; ++j) {
        const double weight = std::max(0.0, 1 - std::fabs(row - i)) * std::max(0.0, 1 - std::fabs(column - j));
        sum += weight * gain[static_cast<std::size_t>((i * columns + j) * planes + std::min(plane, planes - 1))];
      }
    }
    return v * sum;
  });
  return out;
}

DrawnOpcode vignette(const OpcodeImage& image, std::mt19937& draw) {
  std::vector<double> k;
  for (int i = 0; i < 5; ++i) k.push_back(between(0, 0.05, draw));
  const double cx = between(0, 1, draw), cy = between(0, 1, draw);
  DrawnOpcode out{.encoded = {.id = 3}, .is_gain = true};
  for (const double number : k) append_f64(out.encoded.parameters, number);
  append_f64(out.encoded.parameters, cx);
  append_f64(out.encoded.parameters, cy);
  out.truth = [=](double v, int x, int y, int) {
    const double w = image.width - 1, h = image.height - 1;
    const double far = std::hypot(std::max(cx, 1 - cx) * w, std::max(cy, 1 - cy) * h);
    const double r = std::hypot(x - cx * w, y - cy * h) / far;
    double gain = 1;
    for (std::size_t i = 0; i < k.size(); ++i) gain += k[i] * std::pow(r, 2 * static_cast<double>(i) + 2);
    return v * gain;
  };
  return out;
}

}  // namespace

DrawnOpcode draw_opcode(std::uint32_t id, const OpcodeImage& image, std::mt19937& draw) {
  switch (id) {
    case 3:
      return vignette(image, draw);
    case 7:
      return table(image, draw);
    case 8:
      return polynomial(image, draw);
    case 9:
      return gain_map(image, draw);
    default:
      return lines(id, image, draw);
  }
}

}  // namespace lowlux::test
