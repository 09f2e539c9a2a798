#include "tests/reference/night_look_ref.h"

#include <algorithm>
#include <cmath>

#include "isp/model/vision/night_eye.h"

namespace lowlux::reference {
namespace {

Field halved(const Field& in) {
  Field out((in.width + 1) / 2, (in.height + 1) / 2);
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) {
      out.at(x, y) = 0.25 * (in.clamped(2 * x, 2 * y) + in.clamped(2 * x + 1, 2 * y) + in.clamped(2 * x, 2 * y + 1) +
                             in.clamped(2 * x + 1, 2 * y + 1));
    }
  }
  return out;
}

Field doubled(const Field& in, int width, int height) {
  Field out(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const int beside_x = x / 2 + (x % 2 != 0 ? 1 : -1), beside_y = y / 2 + (y % 2 != 0 ? 1 : -1);
      out.at(x, y) = 0.5625 * in.clamped(x / 2, y / 2) +
                     0.1875 * (in.clamped(beside_x, y / 2) + in.clamped(x / 2, beside_y)) +
                     0.0625 * in.clamped(beside_x, beside_y);
    }
  }
  return out;
}

Field blurred(const Field& in, double std_cells) {
  if (std_cells < 1e-3) return in;
  const int reach = static_cast<int>(std::ceil(3 * std_cells));
  double sum = 0;
  for (int k = -reach; k <= reach; ++k) sum += std::exp(-0.5 * k * k / (std_cells * std_cells));
  const auto weight = [&](int k) { return std::exp(-0.5 * k * k / (std_cells * std_cells)) / sum; };
  Field across(in.width, in.height), out(in.width, in.height);
  for (int y = 0; y < in.height; ++y) {
    for (int x = 0; x < in.width; ++x) {
      for (int k = -reach; k <= reach; ++k) across.at(x, y) += weight(k) * in.clamped(x + k, y);
    }
  }
  for (int y = 0; y < in.height; ++y) {
    for (int x = 0; x < in.width; ++x) {
      for (int k = -reach; k <= reach; ++k) out.at(x, y) += weight(k) * across.clamped(x, y + k);
    }
  }
  return out;
}

// Returns the field of adaptation: 1 degree around each position, and a fraction of the mean of the entire image.
Field adapted(const Field& light, const isp::NightLook& look) {
  std::vector<Field> level{light};
  double std_cells = isp::adaptation_field_std_deg * look.pixels_per_degree / LookGrid::cell;
  for (; std_cells > 2 && std::max(level.back().width, level.back().height) > 1; std_cells /= 2) {
    level.push_back(halved(level.back()));
  }
  double mean = 0;
  for (const double v : level.back().value) mean += v / static_cast<double>(level.back().value.size());
  Field field = blurred(level.back(), std::min(std_cells, 8.0));
  for (double& v : field.value) {
    v = isp::adaptation_fraction_of_mean * mean + (1 - isp::adaptation_fraction_of_mean) * v;
  }
  for (std::size_t k = level.size() - 1; k-- > 0;) field = doubled(field, level[k].width, level[k].height);
  return field;
}

// Returns the perceived light, blurred as far as each cell requires [px^2] beyond the cells' own blur.
Field softened(const Field& seen, const Field& variance_px2) {
  const double widest = *std::ranges::max_element(variance_px2.value);
  std::vector<Field> light{seen}, wanted{variance_px2};
  double own = 0.25 * LookGrid::cell * LookGrid::cell;
  for (; widest > own && std::max(light.back().width, light.back().height) > 1; own *= 4) {
    light.push_back(halved(light.back()));
    wanted.push_back(halved(wanted.back()));
  }
  Field out = light.back();
  for (std::size_t k = light.size() - 1; k-- > 0;) {
    own /= 4;
    const Field wide = doubled(out, light[k].width, light[k].height);
    out = light[k];
    for (std::size_t i = 0; i < out.value.size(); ++i) {
      const double share = std::clamp((wanted[k].value[i] / own - 1) / 3, 0.0, 1.0);
      out.value[i] += share * (wide.value[i] - out.value[i]);
    }
  }
  return out;
}

}  // namespace

double Field::clamped(int x, int y) const {
  return value[static_cast<std::size_t>(std::clamp(y, 0, height - 1)) * width + std::clamp(x, 0, width - 1)];
}

std::vector<Field> night_look(const RgbView<const float>& camera, const std::array<float, 9>& matrix, float clip,
                              const isp::NightLook& look) {
  const int width = camera[0].width, height = camera[0].height;
  Field light(width, height), rods(width, height), photopic(width, height), scotopic(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int j = 0; j < 3; ++j) {
        double v = 0;
        for (int c = 0; c < 3; ++c) v += matrix[3 * j + c] * std::min<double>(camera[c].at(x, y), clip);
        light.at(x, y) += look.luminance[j] * v;
        rods.at(x, y) += look.rods[j] * v;
      }
      rods.at(x, y) = std::max(rods.at(x, y), std::min(LookGrid::min_rods * light.at(x, y), light.at(x, y)));
      photopic.at(x, y) = std::clamp(look.cd_m2_per_unit * light.at(x, y), 0.0, 1e9);
      scotopic.at(x, y) =
          std::clamp(look.cd_m2_per_unit * look.scotopic_ratio_of_white * rods.at(x, y), 0.27 * photopic.at(x, y), 1e9);
    }
  }
  const Field cones_field = adapted(photopic, look), rods_field = adapted(scotopic, look);
  std::vector<Field> part(LookGrid::parts, Field(width, height));
  Field seen(width, height), variance_px2(width, height);
  for (std::size_t i = 0; i < seen.value.size(); ++i) {
    const isp::NightEye eye = isp::night_eye({cones_field.value[i], rods_field.value[i]});
    const double share = (1 - eye.state.m) * isp::scotopic_at_555_nm * look.scotopic_ratio_of_white;
    part[LookGrid::rod_fraction].value[i] = look.effects.purkinje ? share / (eye.state.m + share) : 0;
    part[LookGrid::chroma].value[i] = look.effects.chroma ? eye.chroma : 1;
    part[LookGrid::blue].value[i] = look.effects.hue ? eye.blue : 0;
    seen.value[i] = light.value[i] + part[LookGrid::rod_fraction].value[i] * (rods.value[i] - light.value[i]);
    const double blur_px = look.effects.acuity ? eye.blur_std_deg * look.pixels_per_degree : 0;
    variance_px2.value[i] = blur_px * blur_px;
  }
  const Field base = softened(seen, variance_px2);
  for (std::size_t i = 0; i < seen.value.size(); ++i) {
    const double share = std::min(1.0, variance_px2.value[i] / (0.25 * LookGrid::cell * LookGrid::cell));
    part[LookGrid::detail].value[i] = 1 - share;
    part[LookGrid::base].value[i] = share * base.value[i];
  }
  return part;
}

LookGrid look_grid(const std::vector<Field>& parts, const isp::NightLook& look, std::vector<Plane<float>>& memory) {
  LookGrid out{{}, look.luminance, look.rods, look.tint, look.dark};
  memory.clear();
  for (std::size_t k = 0; k < parts.size(); ++k) {
    memory.emplace_back(parts[k].width, parts[k].height);
    std::ranges::copy(parts[k].value, memory.back().data());
    out.part[k] = memory.back().view();
  }
  return out;
}

}  // namespace lowlux::reference
