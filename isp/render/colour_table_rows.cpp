#include "isp/render/colour_table_rows.h"

#include <cstddef>
#include <cstdint>
#include <cstring>

#if defined(__aarch64__)  // NEON only, as in isp/raw
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#endif
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isp/render/colour_table_rows.cpp"
#include <hwy/foreach_target.h>  // compiles this file once more for each instruction set
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace lowlux::isp::table_rows::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = HWY_CAPPED(float, 16);
using Ints = hn::RebindToSigned<Floats>;
using VF = hn::Vec<Floats>;
using VI = hn::Vec<Ints>;

HWY_INLINE VF constant(float x) { return hn::Set(Floats(), x); }

struct Colour {
  VF c[3];
};

/// Replaces values that are not numbers with 0 and limits the rest to +-1e30, so that no sum is infinite.
HWY_INLINE VF usable(VF x) {
  const VF number = hn::IfThenElseZero(hn::Eq(x, x), x);
  return hn::Min(hn::Max(number, constant(-1e30f)), constant(1e30f));
}

/// Returns a + t (b - a) of the values at two nodes.
HWY_INLINE VF between(const float* a, const float* b, VI at, VF t) {
  const VF first = hn::GatherIndex(Floats(), a, at), second = hn::GatherIndex(Floats(), b, at);
  return hn::MulAdd(t, hn::Sub(second, first), first);
}

/// Locates a value on an axis of nodes: the lower node, as a float, and the fraction of the way to the next.
struct Place {
  VF node;
  VF t;
};
HWY_INLINE Place place_of(VF x, std::int32_t cells) {
  const VF inside = hn::Min(hn::Max(x, constant(0)), constant(static_cast<float>(cells)));
  const VF whole = hn::ConvertTo(Floats(), hn::ConvertTo(Ints(), inside));
  const VF node = hn::Min(whole, constant(static_cast<float>(cells - 1)));
  return {node, hn::Sub(inside, node)};
}

struct Kernel {
  const Table& table;
  std::size_t row;    // floats from a node to the one with the next fraction of green
  std::size_t level;  // floats from a node to the one at the next level

  explicit HWY_INLINE Kernel(const Table& from)
      : table(from),
        row(4 * (static_cast<std::size_t>(from.cells) + 1)),
        level(row * (static_cast<std::size_t>(from.cells) + 1)) {}

  HWY_INLINE VF of_level(const float* node, VI at, const Place& x, const Place& y) const {
    const VF low = between(node, node + 4, at, x.t), high = between(node + row, node + row + 4, at, x.t);
    return hn::MulAdd(y.t, hn::Sub(high, low), low);
  }

  /// Returns the table's result for a colour within it, for a sum of 1.
  HWY_INLINE Colour looked_up(const Colour& in, VF sum, VF level_value) const {
    const VF per_sum = hn::Div(constant(table.nodes_per_fraction), sum);
    const VF first = constant(table.margin * table.nodes_per_fraction);
    const Place x = place_of(hn::MulAdd(in.c[0], per_sum, first), table.cells);
    const Place y = place_of(hn::MulAdd(in.c[1], per_sum, first), table.cells);
    const VF side = constant(static_cast<float>(table.cells + 1));
    const auto index = [](VF node) HWY_ATTR { return hn::ShiftLeft<2>(hn::ConvertTo(Ints(), node)); };
    Colour out{{hn::Zero(Floats()), hn::Zero(Floats()), hn::Zero(Floats())}};
    if (table.levels == 1) {
      const VI at = index(hn::MulAdd(y.node, side, x.node));
      for (int c = 0; c < 3; ++c) out.c[c] = of_level(table.node + c, at, x, y);
      return out;
    }
    const VI bits = hn::Sub(hn::BitCast(Ints(), level_value), hn::Set(Ints(), table.first_level_bits));
    const Place z = place_of(hn::Mul(hn::ConvertTo(Floats(), bits), constant(table.levels_per_bit)), table.levels - 1);
    const VI at = index(hn::MulAdd(hn::MulAdd(z.node, side, y.node), side, x.node));
    for (int c = 0; c < 3; ++c) {
      const VF low = of_level(table.node + c, at, x, y), high = of_level(table.node + level + c, at, x, y);
      out.c[c] = hn::MulAdd(z.t, hn::Sub(high, low), low);
    }
    return out;
  }

  /// @param level_value  null: the sum
  HWY_INLINE Colour operator()(const Colour& from, const float* level_value) const {
    const VF zero = hn::Zero(Floats());
    Colour in{{usable(from.c[0]), usable(from.c[1]), usable(from.c[2])}};
    const VF y =
        hn::MulAdd(constant(table.luminance[2]), in.c[2],
                   hn::MulAdd(constant(table.luminance[1]), in.c[1], hn::Mul(constant(table.luminance[0]), in.c[0])));
    const auto lit = hn::Gt(y, constant(1e-30f));
    const VF least = hn::Min(hn::Min(in.c[0], in.c[1]), in.c[2]);
    // Fractions below -margin move to -margin, towards the grey of equal luminance.
    const VF beyond = hn::MulAdd(constant(table.margin), hn::Add(hn::Add(in.c[0], in.c[1]), in.c[2]), least);
    const VF room = hn::Mul(y, constant(1 + 3 * table.margin));
    const VF t = hn::IfThenElse(hn::And(lit, hn::Lt(beyond, zero)), hn::Div(room, hn::Sub(room, beyond)), constant(1));
    const VF grey = hn::IfThenElse(hn::Lt(t, constant(1)), y, zero);  // 0 + 1 (c - 0) keeps every bit
    for (VF& c : in.c) c = hn::MulAdd(t, hn::Sub(c, grey), grey);
    const VF sum = hn::IfThenElse(lit, hn::Add(hn::Add(in.c[0], in.c[1]), in.c[2]), constant(1));
    for (VF& c : in.c) c = hn::IfThenElseZero(lit, c);
    Colour out = looked_up(in, sum, level_value == nullptr ? sum : hn::LoadU(Floats(), level_value));
    for (int c = 0; c < 3; ++c) {
      out.c[c] = hn::IfThenElse(lit, hn::Mul(out.c[c], sum), hn::Mul(constant(table.grey[c]), y));
    }
    return out;
  }
};

void ConvertRow(const float* const (&in)[3], const float* level_value, int width, const Table& table,
                float* const (&out)[3]) {
  const Floats f;
  const Kernel kernel(table);
  const int n = static_cast<int>(hn::Lanes(f));
  HWY_ALIGN float ends[2][3][hn::MaxLanes(Floats())] = {};
  HWY_ALIGN float end_of_levels[hn::MaxLanes(Floats())] = {};
  for (int x = 0; x < width; x += n) {
    const float* from[3] = {in[0] + x, in[1] + x, in[2] + x};
    float* to[3] = {out[0] + x, out[1] + x, out[2] + x};
    const float* level = level_value == nullptr ? nullptr : level_value + x;
    const bool whole = x + n <= width;
    const std::size_t bytes = static_cast<std::size_t>(width - x) * sizeof(float);
    if (!whole) {
      for (int c = 0; c < 3; ++c) {
        std::memcpy(ends[0][c], from[c], bytes);
        from[c] = ends[0][c];
        to[c] = ends[1][c];
      }
      if (level != nullptr) {
        std::memcpy(end_of_levels, level, bytes);
        level = end_of_levels;
      }
    }
    const Colour seen = kernel({{hn::LoadU(f, from[0]), hn::LoadU(f, from[1]), hn::LoadU(f, from[2])}}, level);
    for (int c = 0; c < 3; ++c) hn::StoreU(seen.c[c], f, to[c]);
    if (!whole) {
      for (int c = 0; c < 3; ++c) std::memcpy(out[c] + x, to[c], bytes);
    }
  }
}

const char* TargetName() { return hwy::TargetName(HWY_TARGET); }

}  // namespace lowlux::isp::table_rows::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lowlux::isp::table_rows {

HWY_EXPORT(ConvertRow);
HWY_EXPORT(TargetName);

void convert_row(const float* const (&in)[3], const float* level_value, int width, const Table& table,
                 float* const (&out)[3]) {
  HWY_DYNAMIC_DISPATCH(ConvertRow)(in, level_value, width, table, out);
}
const char* target_name() { return HWY_DYNAMIC_DISPATCH(TargetName)(); }

}  // namespace lowlux::isp::table_rows
#endif
