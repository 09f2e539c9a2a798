#include "isp/render/night/night_look.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include "isp/render/night/eye_rows.h"
#include "isp/render/night/eye_tables.h"
#include "isp/render/night/grid.h"
#include "isp/render/night/light_fields.h"
#include "isp/render/night/visual_noise.h"

namespace lowlux::isp {
namespace {

// Box and linear interpolation of a cell of 4 pixels blur it by half its side, 2 pixels.
constexpr double cell_variance_px2 = 0.25 * LookGrid::cell * LookGrid::cell;

double mean_of(const PlaneView<const float>& plane) {
  double sum = 0;
  for (int y = 0; y < plane.height; ++y) {
    double row = 0;
    for (int x = 0; x < plane.width; ++x) row += plane.row(y)[x];
    sum += row;
  }
  return sum / plane.width / plane.height;
}

float largest_of(const PlaneView<const float>& plane) {
  float largest = 0;
  for (int y = 0; y < plane.height; ++y) {
    for (int x = 0; x < plane.width; ++x) largest = std::max(largest, plane.row(y)[x]);
  }
  return largest;
}

}  // namespace

float gain_within_noise_limit(double y, double noise_std, double lightness) {
  const double allowed = lightness / (1.3 * std::max(noise_std, 1e-12));
  const double in_line = allowed / 903.3;
  // Solves 116/3 (0.7 g y)^(-2/3) g = allowed.
  const double root = allowed * 3 / 116 * std::cbrt(0.49 * std::max(y, 0.0) * std::max(y, 0.0));
  return static_cast<float>(std::clamp(std::max(in_line, root * root * root), 0.0, 1.0));
}

struct NightLookGrid::State {
  State(int width, int height)
      : levels(levels_of(width, height)),
        photopic(width, height, levels),
        scotopic(width, height, levels),
        rod_fraction(width, height, levels),
        chroma(width, height, levels),
        blue(width, height, levels),
        seen(width, height, levels),
        variance(width, height, levels),
        between(width, height, levels),
        base(width, height),
        detail(width, height),
        grain(width, height) {}

  void fit(int width, int height) {
    for (Pyramid* p : {&photopic, &scotopic, &rod_fraction, &chroma, &blue, &seen, &variance, &between}) {
      p->fit(width, height);
    }
  }
  PlaneView<float> part(LookGrid::Part part) {
    switch (part) {
      case LookGrid::rod_fraction:
        return rod_fraction[0];
      case LookGrid::chroma:
        return chroma[0];
      case LookGrid::blue:
        return blue[0];
      case LookGrid::detail:
        return detail.view().crop(0, 0, seen[0].width, seen[0].height);
      case LookGrid::base:
        break;
    }
    return base.view().crop(0, 0, seen[0].width, seen[0].height);
  }

  void take_light(const RgbView<const float>& camera, const rows::LightWeights& weights, const NightLook& look,
                  Executor& executor);
  void adapt(const NightLook& look, Executor& executor);
  void see(const NightLook& look, Executor& executor);
  void soften(Executor& executor);
  void scatter(const NightLook& look, Executor& executor);
  void add_veil(Executor& executor);
  void draw_noise(const NightLook& look, Executor& executor);
  void weight_noise(Executor& executor);
  void add_noise(Executor& executor);
  void add_detail_noise(Executor& executor);
  void bound_noise(const NoiseLimit& limit, Executor& executor);

  int levels;
  Pyramid photopic, scotopic;  // light, then the field of adaptation [cd/m2]
  int smooth = 0;              // level on which the field of adaptation is still smooth
  Pyramid rod_fraction, chroma, blue;
  Pyramid seen;      // E of LookGrid
  Pyramid variance;  // variance of the blur [px^2]
  Pyramid between;
  Plane<float> base, detail;
  Plane<float> grain;  // deviation of E by the noise of vision
};

// Computes the light in the pixels' unit, photopic into `seen` and scotopic into `variance`, and the non-negative
// fields [cd/m2] into the two pyramids.
void NightLookGrid::State::take_light(const RgbView<const float>& camera, const rows::LightWeights& weights,
                                      const NightLook& look, Executor& executor) {
  const PlaneView<float> y = seen[0], s = variance[0], field_y = photopic[0], field_s = scotopic[0];
  for_each_row(executor, y.height, [&](int row) {
    rows::light_row({{camera[0].row(row), camera[1].row(row), camera[2].row(row)}}, weights, y.width, y.row(row),
                    s.row(row));
    field_row(look, y.width, y.row(row), s.row(row), field_y.row(row), field_s.row(row));
  });
}

// Computes the field of adaptation: it is blurred on the level whose cells are 0.5 to 1 times its Gaussian's size, and
// interpolated to cells of half that size, between which it is linear.
void NightLookGrid::State::adapt(const NightLook& look, Executor& executor) {
  double std_cells = adaptation_field_std_deg * look.pixels_per_degree / LookGrid::cell;
  int level = 0;
  for (; std_cells > 2 && level + 1 < levels; ++level) std_cells /= 2;
  smooth = std::max(0, level - 1);
  for (Pyramid* field : {&photopic, &scotopic}) {
    field->halve_to(level, executor);
    const PlaneView<float> coarse = (*field)[level];
    const auto mean = static_cast<float>(adaptation_fraction_of_mean * mean_of(coarse));
    blur(coarse, std::min(std_cells, 8.0), between[level], executor);
    for_each_row(executor, coarse.height, [&](int row) {
      for (int x = 0; x < coarse.width; ++x) {
        float& light = coarse.row(row)[x];
        light = mean + static_cast<float>(1 - adaptation_fraction_of_mean) * light;
      }
    });
    field->interpolate(level, smooth, executor);
  }
}

// Computes the eye's response at each position, on the smooth level and then on every cell; E then replaces the light.
void NightLookGrid::State::see(const NightLook& look, Executor& executor) {
  const PlaneView<float> cones = photopic[smooth], rods = scotopic[smooth];
  const auto white = static_cast<float>(look.scotopic_ratio_of_white);
  const PlaneView<float> blur_deg2 = between[smooth];
  for_each_row(executor, cones.height, [&](int y) {
    rows::eye_row(eye_tables(), white, cones.row(y), rods.row(y), cones.width,
                  {rod_fraction[smooth].row(y), chroma[smooth].row(y), blue[smooth].row(y), blur_deg2.row(y)});
  });
  const auto everywhere = [&](Pyramid& part, bool wanted, float without) {
    if (wanted) {
      part.interpolate(smooth, 0, executor);
    } else {
      for_each_row(executor, part[0].height, [&](int y) { std::fill_n(part[0].row(y), part[0].width, without); });
    }
  };
  const bool noise = look.effects.visual_noise;
  everywhere(rod_fraction, look.effects.purkinje || noise, 0);
  if (noise) weight_noise(executor);
  if (noise && !look.effects.purkinje) everywhere(rod_fraction, false, 0);
  everywhere(chroma, look.effects.chroma, 1);
  everywhere(blue, look.effects.hue, 0);
  const PlaneView<float> e = seen[0], s = variance[0], share = rod_fraction[0];
  for_each_row(executor, e.height, [&](int y) {
    for (int x = 0; x < e.width; ++x) e.row(y)[x] += share.row(y)[x] * (s.row(y)[x] - e.row(y)[x]);
  });
  const double px_per_deg = look.effects.acuity ? look.pixels_per_degree : 0;
  for_each_row(executor, blur_deg2.height, [&](int y) {
    for (int x = 0; x < blur_deg2.width; ++x) {
      variance[smooth].row(y)[x] = static_cast<float>(px_per_deg * px_per_deg) * blur_deg2.row(y)[x];
    }
  });
}

// Computes detail and base: the remaining fraction of the pixels' own light, and the blurred light that replaces the
// rest, with the blur that each cell requires. Coarser cells stand for wider Gaussians; interpolation between two of
// them matches the variance.
void NightLookGrid::State::soften(Executor& executor) {
  const float widest = largest_of(variance[smooth]);
  variance.interpolate(smooth, 0, executor);
  int last = 0;
  while (last + 1 < levels && widest > cell_variance_px2 * std::exp2(2.0 * last)) ++last;
  seen.halve_to(last, executor);
  variance.halve_to(last, executor);
  for (int k = last; k-- > 0;) {
    const PlaneView<float> fine = seen[k], wide = between[k], wanted = variance[k];
    interpolate_twice(seen[k + 1], wide, executor);
    const auto own = static_cast<float>(1 / (cell_variance_px2 * std::exp2(2.0 * k)));
    for_each_row(executor, fine.height, [&](int y) {
      for (int x = 0; x < fine.width; ++x) {
        const float share = std::clamp((wanted.row(y)[x] * own - 1) / 3, 0.0f, 1.0f);
        fine.row(y)[x] += share * (wide.row(y)[x] - fine.row(y)[x]);
      }
    });
  }
  const PlaneView<float> wanted = variance[0], light = seen[0];
  for_each_row(executor, light.height, [&](int y) {
    float* const own = detail.row(y);
    float* const wide = base.row(y);
    for (int x = 0; x < light.width; ++x) {
      const float share = std::min(1.0f, wanted.row(y)[x] * static_cast<float>(1 / cell_variance_px2));
      own[x] = 1 - share;
      wide[x] = share * light.row(y)[x];
    }
  });
}

// Adds light scattered in the eye, 10 / angle^2 per lux and degree^2 (Stiles & Holladay), from 1 degree on: Gaussians
// of 1, 2, 4... degrees, each with the scatter of its octave of angles. The result is in `photopic`.
void NightLookGrid::State::scatter(const NightLook& look, Executor& executor) {
  constexpr int octaves = 5;
  constexpr double steradians_per_deg2 = (std::numbers::pi / 180) * (std::numbers::pi / 180);
  constexpr auto share = static_cast<float>(10 * steradians_per_deg2 * 2 * std::numbers::pi * std::numbers::ln2);
  double std_cells = look.pixels_per_degree / LookGrid::cell;
  int first = 0;
  for (; std_cells > 2 && first + 1 < levels; ++first) std_cells /= 2;
  const int last = std::min(first + octaves, levels) - 1;
  for_each_row(executor, seen[0].height, [&](int y) {
    for (int x = 0; x < seen[0].width; ++x) between[0].row(y)[x] = std::max(0.0f, seen[0].row(y)[x]);
  });
  between.halve_to(last, executor);
  for (int k = last; k >= 0; --k) {
    const PlaneView<float> veil = photopic[k], light = between[k];
    if (k == last) {
      for_each_row(executor, veil.height, [&](int y) { std::fill_n(veil.row(y), veil.width, 0.0f); });
    } else {
      interpolate_twice(photopic[k + 1], veil, executor);
    }
    if (k < first) continue;
    blur(light, std::min(std_cells, 8.0), scotopic[k], executor);
    for_each_row(executor, veil.height, [&](int y) {
      for (int x = 0; x < veil.width; ++x) veil.row(y)[x] += share * light.row(y)[x];
    });
  }
}

void NightLookGrid::State::add_veil(Executor& executor) {
  for_each_row(executor, photopic[0].height, [&](int y) {
    for (int x = 0; x < photopic[0].width; ++x) base.row(y)[x] += photopic[0].row(y)[x];
  });
}

// Draws the noise of rods into `detail` and of cones into `base`: soften() writes both only later. Needs the light of
// take_light().
void NightLookGrid::State::draw_noise(const NightLook& look, Executor& executor) {
  const VisualNoise noise = visual_noise(look);
  const PlaneView<float> cones = photopic[0], rods = scotopic[0];
  for_each_row(executor, cones.height, [&](int y) {
    visual_noise_row(noise, y, cones.width, cones.row(y), rods.row(y), base.row(y), detail.row(y), grain.row(y));
  });
}

// Weights the noise of rods and cones as E weights their light, into `grain`.
void NightLookGrid::State::weight_noise(Executor& executor) {
  const PlaneView<float> share = rod_fraction[0];
  for_each_row(executor, share.height, [&](int y) {
    for (int x = 0; x < share.width; ++x) {
      grain.row(y)[x] = base.row(y)[x] + share.row(y)[x] * (detail.row(y)[x] - base.row(y)[x]);
    }
  });
}

// Adds the noise to E, so that it is pooled like the light.
void NightLookGrid::State::add_noise(Executor& executor) {
  const PlaneView<float> e = seen[0];
  for_each_row(executor, e.height, [&](int y) {
    for (int x = 0; x < e.width; ++x) e.row(y)[x] += grain.row(y)[x];
  });
}

// Adds the noise of the fraction of light that is not pooled, which the pixels show as they are.
void NightLookGrid::State::add_detail_noise(Executor& executor) {
  for_each_row(executor, seen[0].height, [&](int y) {
    for (int x = 0; x < seen[0].width; ++x) base.row(y)[x] += detail.row(y)[x] * grain.row(y)[x];
  });
}

// Computes the gain limit on cells of 64 pixels and more, from coarse to fine: gain rises with the square of the light,
// and would triple the noise that means of cells have. A cell's own gain counts only where it differs from that of the
// coarser cells by more than such noise: by 0.2 in its logarithm, and in full from 0.4 on. The noise follows the cube
// root of the gain, and changes by at most 7 %, less than the margin of gain_within_noise_limit.
void NightLookGrid::State::bound_noise(const NoiseLimit& limit, Executor& executor) {
  const int finest = std::min(4, levels - 1);
  const PlaneView<float> e = between[0], v = variance[0];
  for_each_row(executor, e.height, [&](int y) {
    std::copy_n(seen[0].row(y), e.width, e.row(y));
    for (int x = 0; x < e.width; ++x) {
      const float noise = limit.variance.row(y)[x];
      v.row(y)[x] = noise >= 0 && noise < 1e9f ? noise : 0.0f;
    }
  });
  between.halve_to(levels - 1, executor);
  variance.halve_to(levels - 1, executor);
  Pyramid& gain = photopic;  // logarithms
  for (int k = levels - 1; k >= finest; --k) {
    const PlaneView<float> light = between[k], noise = variance[k], log_gain = gain[k];
    const bool is_coarsest = k == levels - 1;
    if (!is_coarsest) interpolate_twice(gain[k + 1], log_gain, executor);
    for_each_row(executor, light.height, [&](int y) {
      for (int x = 0; x < light.width; ++x) {
        const double on_display = limit.display_per_unit * light.row(y)[x];
        const double noise_std = limit.display_per_unit * std::sqrt(noise.row(y)[x]);
        const float own = std::log(std::max(gain_within_noise_limit(on_display, noise_std, limit.lightness), 1e-9f));
        float& value = log_gain.row(y)[x];
        const float d = own - value;
        value = is_coarsest ? own : value + d * std::clamp((std::fabs(d) - 0.2f) / 0.2f, 0.0f, 1.0f);
      }
    });
  }
  const PlaneView<float> log_gain = gain[finest];
  for_each_row(executor, log_gain.height, [&](int y) {
    for (int x = 0; x < log_gain.width; ++x) log_gain.row(y)[x] = std::exp(log_gain.row(y)[x]);
  });
  gain.interpolate(finest, 0, executor);
  const PlaneView<float> factor = gain[0];
  for_each_row(executor, factor.height, [&](int y) {
    for (float* const part_row : {base.row(y), detail.row(y), chroma[0].row(y)}) {
      for (int x = 0; x < factor.width; ++x) part_row[x] *= factor.row(y)[x];
    }
  });
}

NightLookGrid::NightLookGrid(int max_width, int max_height)
    : state_(std::make_unique<State>(cells_along(max_width), cells_along(max_height))) {}
NightLookGrid::~NightLookGrid() = default;

LookGrid NightLookGrid::make(const RgbView<const float>& camera, const std::array<float, 9>& matrix, float clip,
                             const NightLook& look, const std::optional<NoiseLimit>& limit, Executor& executor) {
  State& s = *state_;
  assert(camera[0].width <= s.base.width() && camera[0].height <= s.base.height());
  s.fit(camera[0].width, camera[0].height);
  const VisionEffects& effects = look.effects;
  s.take_light(camera, light_weights(look, matrix, clip), look, executor);
  if (effects.visual_noise) s.draw_noise(look, executor);
  s.adapt(look, executor);
  s.see(look, executor);
  if (effects.glare) s.scatter(look, executor);
  if (effects.visual_noise) s.add_noise(executor);
  s.soften(executor);
  if (effects.glare) s.add_veil(executor);
  if (effects.visual_noise) s.add_detail_noise(executor);
  if (limit) s.bound_noise(*limit, executor);
  LookGrid out{{}, look.luminance, look.rods, look.tint, look.dark};
  for (int k = 0; k < LookGrid::parts; ++k) out.part[k] = s.part(static_cast<LookGrid::Part>(k));
  return out;
}

}  // namespace lowlux::isp
