#include "tests/reference/retarget_ref.h"

#include <cmath>

namespace lowlux::reference {

Vector3 looked_up(const isp::RetargetTable& table, const Vector3& code) {
  const int n = table.levels;
  int cell[3];
  double f[3];
  for (int c = 0; c < 3; ++c) {
    cell[c] = static_cast<int>(std::fmin(std::floor(code[c] * (n - 1)), n - 2));
    f[c] = code[c] * (n - 1) - cell[c];
  }
  const auto corner = [&](int i, int j, int k) {
    const int number = ((cell[0] + i) * n + cell[1] + j) * n + cell[2] + k;
    const std::int64_t first = static_cast<std::uint32_t>(table.nodes[2 * number]);
    const std::int64_t second = static_cast<std::uint32_t>(table.nodes[2 * number + 1]);
    return Vector3{static_cast<double>(first % 65536) / 65535, static_cast<double>(first / 65536) / 65535,
                   static_cast<double>(second) / 65535};
  };
  const auto sum = [](double w0, const Vector3& v0, double w1, const Vector3& v1, double w2, const Vector3& v2,
                      double w3, const Vector3& v3) {
    Vector3 out{};
    for (int c = 0; c < 3; ++c) out[c] = w0 * v0[c] + w1 * v1[c] + w2 * v2[c] + w3 * v3[c];
    return out;
  };
  const double x = f[0], y = f[1], z = f[2];
  const Vector3 p000 = corner(0, 0, 0), p111 = corner(1, 1, 1);
  if (x > y && y > z) return sum(1 - x, p000, x - y, corner(1, 0, 0), y - z, corner(1, 1, 0), z, p111);
  if (x > z && z >= y) return sum(1 - x, p000, x - z, corner(1, 0, 0), z - y, corner(1, 0, 1), y, p111);
  if (z >= x && x > y) return sum(1 - z, p000, z - x, corner(0, 0, 1), x - y, corner(1, 0, 1), y, p111);
  if (y >= x && x > z) return sum(1 - y, p000, y - x, corner(0, 1, 0), x - z, corner(1, 1, 0), z, p111);
  if (y > z && z >= x) return sum(1 - y, p000, y - z, corner(0, 1, 0), z - x, corner(0, 1, 1), x, p111);
  return sum(1 - z, p000, z - y, corner(0, 0, 1), y - x, corner(0, 1, 1), x, p111);
}

}  // namespace lowlux::reference
