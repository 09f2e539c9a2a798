#include "isp/render/profile_tables.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "isp/model/colour/colorimetry.h"

namespace lowlux::isp {
namespace {

constexpr std::uint16_t map_dims = 50937, map_data_1 = 50938, map_data_2 = 50939, map_encoding = 51107;
constexpr std::uint16_t look_dims = 50981, look_data = 50982, look_encoding = 51108;
constexpr std::uint16_t tone_curve = 50940;
constexpr std::uint16_t type_short = 3, type_long = 4, type_float = 11;
constexpr float max_shift = 360, max_factor = 1000;

std::uint32_t word_at(const SourceTag& tag, std::size_t i, std::size_t bytes) {
  std::uint32_t out = 0;
  for (std::size_t b = 0; b < bytes; ++b) out |= std::to_integer<std::uint32_t>(tag.values[i * bytes + b]) << (8 * b);
  return out;
}

/// Returns the values of a SHORT or LONG tag with `count` of them; nullopt otherwise.
std::optional<std::array<std::uint32_t, 3>> words_of(const SourceTag& tag, std::uint32_t count) {
  const std::size_t bytes = tag.type == type_short ? 2 : 4;
  if ((tag.type != type_short && tag.type != type_long) || tag.count != count || tag.values.size() != count * bytes) {
    return std::nullopt;
  }
  std::array<std::uint32_t, 3> out{};
  for (std::size_t i = 0; i < count; ++i) out[i] = word_at(tag, i, bytes);
  return out;
}

struct Form {
  int hues, saturations, values;
  bool srgb_encoded;
  std::size_t nodes() const {
    return static_cast<std::size_t>(hues) * static_cast<std::size_t>(saturations) * static_cast<std::size_t>(values);
  }
};

std::optional<Form> form_of(const SourceTags& tags, std::uint16_t dims_id, std::uint16_t encoding_id) {
  const SourceTag* const dims_tag = find_tag(tags.main, dims_id);
  const auto dims = dims_tag == nullptr ? std::nullopt : words_of(*dims_tag, 3);
  if (!dims) return std::nullopt;
  const auto [hues, saturations, values] = *dims;
  if (hues < 1 || hues > max_hue_divisions || saturations < 2 || saturations > max_saturation_divisions || values < 1 ||
      values > max_value_divisions) {
    return std::nullopt;
  }
  Form out{static_cast<int>(hues), static_cast<int>(saturations), static_cast<int>(values), false};
  if (out.nodes() > max_hue_sat_nodes) return std::nullopt;
  if (const SourceTag* const encoding = find_tag(tags.main, encoding_id)) {
    const auto which = words_of(*encoding, 1);
    if (!which || (*which)[0] > 1) return std::nullopt;
    out.srgb_encoded = (*which)[0] == 1;
  }
  return out;
}

std::optional<HueSatMap> table_of(const Form& form, const SourceTag* data) {
  const std::size_t count = 3 * form.nodes();
  if (data == nullptr || data->type != type_float || data->count != count || data->values.size() != 4 * count) {
    return std::nullopt;
  }
  HueSatMap out{form.hues, form.saturations, form.values, form.srgb_encoded, std::vector<float>(count)};
  for (std::size_t i = 0; i < count; ++i) {
    const auto v = std::bit_cast<float>(word_at(*data, i, 4));
    const bool is_valid = i % 3 == 0 ? std::fabs(v) <= max_shift : v >= 0 && v <= max_factor;
    if (!is_valid) return std::nullopt;
    out.node[i] = v;
  }
  const std::size_t row = 3 * static_cast<std::size_t>(form.saturations);
  for (std::size_t i = 2; i < count; i += row) out.node[i] = 1;
  return out;
}

/// Returns whether a table changes a colour: at saturation 0 only the factor of value counts, which is 1 there.
bool changes(const std::optional<HueSatMap>& map) {
  if (!map) return false;
  for (std::size_t i = 0; i < map->node.size(); i += 3) {
    if (map->node[i] != 0 || map->node[i + 1] != 1 || map->node[i + 2] != 1) return true;
  }
  return false;
}

void warn(const char* table, std::vector<std::string>& warnings) {
  warnings.push_back(std::string("the profile's ") + table +
                     " is not valid (divisions, count or values): it is not applied");
}

void read_maps(const SourceTags& tags, bool two_maps, ProfileTables& out, std::vector<std::string>& warnings) {
  const SourceTag* const first = find_tag(tags.main, map_data_1);
  const SourceTag* const second = find_tag(tags.main, map_data_2);
  if (first == nullptr && second == nullptr && find_tag(tags.main, map_dims) == nullptr) return;
  if (const auto form = form_of(tags, map_dims, map_encoding)) {
    out.low = table_of(*form, first);
    if (two_maps) out.high = table_of(*form, second);
  }
  if (!out.low || (two_maps && !out.high)) {
    warn("hue and saturation map", warnings);
    out.low.reset(), out.high.reset();
  }
  if (!changes(out.low) && !changes(out.high)) out.low.reset(), out.high.reset();
}

void read_look(const SourceTags& tags, ProfileTables& out, std::vector<std::string>& warnings) {
  if (find_tag(tags.main, look_data) == nullptr && find_tag(tags.main, look_dims) == nullptr) return;
  if (const auto form = form_of(tags, look_dims, look_encoding))
    out.look = table_of(*form, find_tag(tags.main, look_data));
  if (!out.look) warn("look table", warnings);
  if (!changes(out.look)) out.look.reset();
}

void read_curve(const SourceTags& tags, ProfileTables& out, std::vector<std::string>& warnings) {
  const SourceTag* const tag = find_tag(tags.main, tone_curve);
  if (tag == nullptr) return;
  const bool is_whole = tag->type == type_float && tag->count % 2 == 0 && tag->count <= 2 * max_curve_points &&
                        tag->values.size() == std::size_t{4} * tag->count;
  std::vector<CurvePoint> points;
  for (std::size_t i = 0; is_whole && i < tag->count; i += 2) {
    points.push_back({std::bit_cast<float>(word_at(*tag, i, 4)), std::bit_cast<float>(word_at(*tag, i + 1, 4))});
  }
  out.curve = make_profile_curve(points);
  if (!out.curve) warnings.emplace_back("the profile's tone curve is not valid: it is not applied");
}

using FloatMatrix = std::array<float, 9>;

FloatMatrix floats_of(const Matrix3& m, double factor) {
  FloatMatrix out{};
  for (int i = 0; i < 9; ++i) out[i] = static_cast<float>(factor * m[i / 3][i % 3]);
  return out;
}

void multiply(const FloatMatrix& m, float (&v)[3]) {
  const float x = v[0], y = v[1], z = v[2];
  for (int i = 0; i < 3; ++i) v[i] = m[3 * i] * x + m[3 * i + 1] * y + m[3 * i + 2] * z;
}

}  // namespace

std::shared_ptr<const ProfileTables> read_profile_tables(const SourceTags& tags, const ProfileParts& parts,
                                                         std::vector<std::string>& warnings) {
  ProfileTables out;
  read_maps(tags, parts.two_maps, out, warnings);
  read_look(tags, out, warnings);
  if (parts.with_curve) read_curve(tags, out, warnings);
  if (!out.low && !out.look && !out.curve) return nullptr;
  return std::make_shared<const ProfileTables>(std::move(out));
}

std::optional<HueSatMap> map_at(const ProfileTables& tables, double weight) {
  if (!tables.low || !tables.high) return tables.low;
  HueSatMap out = *tables.low;
  for (std::size_t i = 0; i < out.node.size(); ++i) {
    out.node[i] = static_cast<float>((1 - weight) * out.node[i] + weight * tables.high->node[i]);
  }
  return out;
}

Matrix3 xyz_to_prophoto() {
  constexpr RgbPrimaries prophoto{{0.7347, 0.2653}, {0.1596, 0.8404}, {0.0366, 0.0001}, white_d50};
  return *inverse(*rgb_to_xyz(prophoto)) * *bradford_adaptation(white_d65, white_d50);
}

void apply_profile(const ProfileRendering& profile, const RgbView<const float>& in, const RgbView<float>& out,
                   Executor& executor) {
  const FloatMatrix to_map = floats_of(profile.to_prophoto, 1 / profile.map_scale);
  const FloatMatrix from_look = floats_of(profile.from_prophoto, 1 / profile.limit);
  const auto to_look = static_cast<float>(profile.map_scale * profile.limit);
  for_each_band(executor, in[0].height, [&](RowBand band, int) {
    for (int y = band.first; y < band.last; ++y) {
      for (int x = 0; x < in[0].width; ++x) {
        float v[3];
        for (int c = 0; c < 3; ++c) v[c] = std::isfinite(in[c].row(y)[x]) ? in[c].row(y)[x] : 0;
        multiply(to_map, v);
        if (profile.map) apply_hue_sat_map(*profile.map, v);
        for (float& channel : v) channel *= to_look;
        if (profile.look) apply_hue_sat_map(*profile.look, v);
        if (profile.curve) apply_profile_curve(*profile.curve, v);
        multiply(from_look, v);
        for (int c = 0; c < 3; ++c) out[c].row(y)[x] = v[c];
      }
    }
  });
}

}  // namespace lowlux::isp
