#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "isp/base/executor.h"
#include "isp/base/look_grid.h"
#include "isp/bench/accuracy_time.h"
#include "isp/bench/stages/developing_stages.h"
#include "isp/metrics/picture_metrics.h"
#include "isp/model/appearance/appearance_model.h"
#include "isp/model/appearance/entropy_model.h"
#include "isp/model/vision/mesopic.h"
#include "isp/model/vision/night_eye.h"
#include "isp/render/colour_table.h"
#include "isp/render/night/eye_rows.h"
#include "isp/render/night/eye_tables.h"
#include "isp/render/night/night_look.h"

namespace lowlux::isp {
namespace {

constexpr PicturePart part{384, 256}, quick_part{96, 64};
constexpr double pixels_of_cell = LookGrid::cell * LookGrid::cell;
constexpr float dark = 1e-6f;
constexpr AccuracyTiming timing{.rounds = 5, .min_s = 1e-3};

const Matrix3& to_xyz() {
  static const Matrix3 matrix = rgb_to_xyz(primaries_rec709).value();  // cannot fail for constants
  return matrix;
}

const Xyz& white() {
  static const Xyz xyz = xyz_of(to_xyz() * Vector3{1, 1, 1});
  return xyz;
}

double scotopic_ratio_of_white() { return scotopic_luminance(white()); }

Lab lab_of_xyz(const Xyz& xyz) { return lab_of(xyz, white()); }

/// Colours of all images: linear Rec. 709 in one row, and their photopic and scotopic luminance relative to white.
struct Colours {
  SceneLinear rgb;
  std::vector<float> cones;
  std::vector<float> rods;

  std::size_t size() const { return cones.size(); }
  Vector3 at(std::size_t i) const { return {rgb.plane[0].data()[i], rgb.plane[1].data()[i], rgb.plane[2].data()[i]}; }
};

/// Returns every n-th colour, so that there are at most `most`.
Colours colours_of(const std::vector<BenchPicture>& pictures, std::size_t most) {
  std::vector<Vector3> all;
  for (const BenchPicture& picture : pictures) {
    const auto& plane = picture.linear.plane;
    all.reserve(all.size() + plane[0].size());
    for (std::size_t i = 0; i < plane[0].size(); ++i) {
      all.push_back({plane[0].data()[i], plane[1].data()[i], plane[2].data()[i]});
    }
  }
  const std::size_t every = (all.size() + most - 1) / most, count = all.size() / every;
  Colours out{SceneLinear(static_cast<int>(count), 1), {}, {}};
  out.cones.reserve(count);
  out.rods.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Vector3& rgb = all[i * every];
    const Xyz xyz = xyz_of(to_xyz() * rgb);
    const double own = scotopic_luminance(xyz) / scotopic_ratio_of_white();
    for (std::size_t c = 0; c < 3; ++c) out.rgb.plane[c].data()[i] = static_cast<float>(rgb[c]);
    out.cones.push_back(static_cast<float>(xyz.y));
    out.rods.push_back(static_cast<float>(std::max(own, std::min(LookGrid::min_rods * xyz.y, xyz.y))));
  }
  return out;
}

/// States of an eye adapted to each colour itself: three of the parts of LookGrid.
struct States {
  std::vector<float> cones_cd_m2, rods_cd_m2;  // fields of adaptation
  std::vector<float> rod_fraction, chroma, blue, variance_deg2;
};

States states_of(const Colours& colours, double white_cd_m2) {
  States out;
  const std::size_t n = colours.size();
  for (auto* part_of : {&out.rod_fraction, &out.chroma, &out.blue, &out.variance_deg2}) part_of->resize(n);
  out.cones_cd_m2.reserve(n);
  out.rods_cd_m2.reserve(n);
  for (std::size_t i = 0; i < n; ++i) {
    const double cones = white_cd_m2 * colours.cones[i];
    const double rods = white_cd_m2 * scotopic_ratio_of_white() * colours.rods[i];
    out.cones_cd_m2.push_back(static_cast<float>(cones));
    out.rods_cd_m2.push_back(static_cast<float>(std::max(rods, min_field_ratio * cones)));
  }
  return out;
}

void set_state(States& states, std::size_t i, const NightEye& eye) {
  const double share = (1 - eye.state.m) * scotopic_at_555_nm * scotopic_ratio_of_white();
  states.rod_fraction[i] = static_cast<float>(share / (eye.state.m + share));
  states.chroma[i] = static_cast<float>(eye.chroma);
  states.blue[i] = static_cast<float>(eye.blue);
  states.variance_deg2[i] = static_cast<float>(eye.blur_std_deg * eye.blur_std_deg);
}

void solve_each(States& states) {
  for (std::size_t i = 0; i < states.chroma.size(); ++i) {
    set_state(states, i, night_eye({states.cones_cd_m2[i], states.rods_cd_m2[i]}));
  }
}

void look_up_each(States& states) {
  rows::eye_row(eye_tables(), static_cast<float>(scotopic_ratio_of_white()), states.cones_cd_m2.data(),
                states.rods_cd_m2.data(), static_cast<int>(states.chroma.size()),
                {states.rod_fraction.data(), states.chroma.data(), states.blue.data(), states.variance_deg2.data()});
}

/// Sets one state for all colours, the state of the mean.
void solve_once(States& states) {
  LuminancePair sum;
  for (std::size_t i = 0; i < states.chroma.size(); ++i) {
    sum.photopic += static_cast<double>(states.cones_cd_m2[i]);
    sum.scotopic += static_cast<double>(states.rods_cd_m2[i]);
  }
  const auto count = static_cast<double>(states.chroma.size());
  set_state(states, 0, night_eye({sum.photopic / count, sum.scotopic / count}));
  for (auto* part_of : {&states.rod_fraction, &states.chroma, &states.blue, &states.variance_deg2}) {
    std::fill(part_of->begin(), part_of->end(), part_of->front());
  }
}

/// Applies LookGrid's change of colours without its blur, in double.
std::vector<Lab> seen(const Colours& colours, const States& states) {
  std::vector<Lab> out;
  out.reserve(colours.size());
  for (std::size_t i = 0; i < colours.size(); ++i) {
    const Vector3 v = colours.at(i);
    const double y = colours.cones[i], e = y + states.rod_fraction[i] * (colours.rods[i] - y);
    const double chroma = states.chroma[i] * (std::max(e, 0.0) + dark) / (std::max(y, 0.0) + dark);
    Vector3 rgb{};
    for (std::size_t c = 0; c < 3; ++c) rgb[c] = e * (1 + states.blue[i] * rod_tint[c]) + chroma * (v[c] - y);
    out.push_back(lab_of_xyz(xyz_of(to_xyz() * rgb)));
  }
  return out;
}

struct StateMethod {
  const char* name;
  void (*work)(States& states);
};
constexpr std::array state_methods{StateMethod{"one for the frame", solve_once}, StateMethod{"table", look_up_each},
                                   StateMethod{"exact", solve_each}};

std::vector<AccuracyRow> state_rows(const Colours& colours, double white_cd_m2) {
  States states = states_of(colours, white_cd_m2);
  solve_each(states);
  const std::vector<Lab> exact = seen(colours, states);
  AccuracyGroup group{
      fmt::format("state of the eye, white {:g} cd/m2", white_cd_m2), "mean CIEDE2000 against exact", {}};
  group.levels.reserve(state_methods.size());
  for (const StateMethod& method : state_methods) {
    method.work(states);
    const ColourDifference error = difference_of(seen(colours, states), exact);
    group.levels.push_back({.name = method.name,
                            .error = error.mean,
                            .run = [&states, method] { method.work(states); },
                            .megapixels = 1e-6 * pixels_of_cell * static_cast<double>(colours.size()),
                            .largest = error.largest});
  }
  return measure(group, timing);
}

struct ModelCase {
  const char* model;
  double white_cd_m2;
  double noise_to_signal = 0;  // above 0: tables over this ratio, equal noise in R, G and B
};
constexpr std::array<ModelCase, 7> model_cases{{{"entropy", 0.5},
                                                {"shin", 0.5},
                                                {"wanat_mantiuk", 0.5},
                                                {"icam06", 0.5},
                                                {"entropy", 5},
                                                {"hunt", 0.5},
                                                {"entropy", 100, 0.7}}};
constexpr std::size_t quick_models = 2;
constexpr std::array bounds{2.0, 0.5, 0.1, 0.02};
constexpr std::size_t quick_bounds = 2;

std::vector<Lab> lab_of_planes(const SceneLinear& rgb) {
  std::vector<Lab> out;
  out.reserve(rgb.plane[0].size());
  for (std::size_t i = 0; i < rgb.plane[0].size(); ++i) {
    const Vector3 v{rgb.plane[0].data()[i], rgb.plane[1].data()[i], rgb.plane[2].data()[i]};
    out.push_back(lab_of_xyz(xyz_of(to_xyz() * v)));
  }
  return out;
}

void map_each(const ColourMap& map, const SceneLinear& in, SceneLinear& out) {
  static const Matrix3 from_xyz = inverse(to_xyz()).value();  // cannot fail for constants
  for (std::size_t i = 0; i < in.plane[0].size(); ++i) {
    const Vector3 v{in.plane[0].data()[i], in.plane[1].data()[i], in.plane[2].data()[i]};
    const Vector3 mapped = from_xyz * vector_of(map(xyz_of(to_xyz() * v)));
    for (std::size_t c = 0; c < 3; ++c) out.plane[c].data()[i] = static_cast<float>(mapped[c]);
  }
}

/// A table, and the time taken to make it.
struct MadeTable {
  ColourTable table;
  double made_s = 0;
};

ViewingConditions scene_of(const ModelCase& of, double noise_to_signal) {
  ViewingConditions out{.white_cd_m2 = of.white_cd_m2, .white = white()};
  if (of.noise_to_signal > 0) {
    const ChannelNoise equal{.variance_e2 = {1, 1, 1}, .camera_to_xyz = to_xyz()};
    out.noise = ColourNoise{.covariance = noise_covariance_of_xyz(equal), .to_signal = noise_to_signal};
  }
  return out;
}

Result<ColourTable> table_within(const AppearanceModel& model, const ModelCase& of, double bound) {
  if (of.noise_to_signal > 0) {
    return make_noise_colour_table([&](double ratio) { return model.at(scene_of(of, ratio)); },
                                   {.error_bound = bound, .largest_bytes = std::size_t{4} << 20});
  }
  const Result<ColourMap> map = model.at(scene_of(of, 0));
  if (!map) return tl::make_unexpected(map.error());
  return make_colour_table(*map, {.error_bound = bound});
}

/// Returns tables of rising size; if several bounds give one size, only the first is kept.
Result<std::vector<MadeTable>> tables_of(const AppearanceModel& model, const ModelCase& of,
                                         std::span<const double> of_bounds) {
  std::vector<MadeTable> out;
  out.reserve(of_bounds.size());
  for (const double bound : of_bounds) {
    const auto start = std::chrono::steady_clock::now();
    auto table = table_within(model, of, bound);
    if (!table) return tl::make_unexpected(table.error());
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
    if (!out.empty() && out.back().table.node.size() == table->node.size()) continue;
    out.push_back({*std::move(table), took.count()});
  }
  return out;
}

Result<std::vector<AccuracyRow>> model_rows(const Colours& colours, const ModelCase& of,
                                            std::span<const double> of_bounds, std::vector<std::string>& remarks) {
  const auto model = appearance_model_named(of.model);
  if (!model) return tl::make_unexpected(model.error());
  const auto map = model->at(scene_of(of, of.noise_to_signal));
  if (!map) return tl::make_unexpected(map.error());
  const auto tables = tables_of(*model, of, of_bounds);
  if (!tables) return tl::make_unexpected(tables.error());
  InlineExecutor one;
  SceneLinear out(colours.rgb.width(), 1);
  map_each(*map, colours.rgb, out);
  const std::vector<Lab> exact = lab_of_planes(out);
  std::string name = fmt::format("{}, white {:g} cd/m2", of.model, of.white_cd_m2);
  if (of.noise_to_signal > 0) name += fmt::format(", noise of {:g} of the signal", of.noise_to_signal);
  AccuracyGroup group{std::move(name), "mean CIEDE2000 against exact", {}};
  Plane<float> ratio(cells_along(colours.rgb.width()), 1);
  std::fill_n(ratio.data(), ratio.size(), static_cast<float>(1 / of.noise_to_signal));
  const double megapixels = 1e-6 * static_cast<double>(colours.size());
  std::string made = group.name + ": tables made in";
  for (const MadeTable& each : *tables) {
    const auto look_up = [&] {
      if (each.table.by_noise) {
        apply_colour_table(each.table, colours.rgb.view(), NoiseGrid{ratio.view()}, out.view(), one);
      } else {
        apply_colour_table(each.table, colours.rgb.view(), out.view(), one);
      }
    };
    look_up();
    const ColourDifference error = difference_of(lab_of_planes(out), exact);
    group.levels.push_back({.name = fmt::format("table, {} cells x {} levels", each.table.cells, each.table.levels),
                            .error = error.mean,
                            .run = look_up,
                            .megapixels = megapixels,
                            .largest = error.largest});
    made += fmt::format(" {:.0f}", 1e3 * each.made_s);
  }
  remarks.push_back(made + " ms");
  const auto solve = [&] { map_each(*map, colours.rgb, out); };
  group.levels.push_back({.name = "exact", .run = solve, .megapixels = megapixels, .largest = 0});
  return measure(group, timing);
}

}  // namespace

Result<BenchOutcome> run_mesopic_bench(const BenchOptions& options) {
  PoolExecutor executor(options.threads);
  const auto pictures = read_bench_pictures(options.pictures_folder, files_of(options.pictures),
                                            options.quick ? quick_part : part, executor);
  if (!pictures) return tl::make_unexpected(pictures.error());
  const Colours colours = colours_of(*pictures, options.quick ? 3000 : 12000);
  const auto models = std::span(model_cases).first(options.quick ? quick_models : model_cases.size());
  std::vector<AccuracyRow> rows;
  std::vector<std::string> remarks;
  for (const double white_cd_m2 : {100.0, 1.0, 0.01}) {
    for (AccuracyRow& row : state_rows(colours, white_cd_m2)) rows.push_back(std::move(row));
  }
  for (const ModelCase& of : models) {
    const auto more =
        model_rows(colours, of, std::span(bounds).first(options.quick ? quick_bounds : bounds.size()), remarks);
    if (!more) return tl::make_unexpected(more.error());
    rows.insert(rows.end(), more->begin(), more->end());
    options.advance(1 / static_cast<double>(models.size()), std::string("appearance by ") + of.model);
  }
  BenchOutcome out = accuracy_outcome("mesopic", rows, timing, 1);
  out.remarks.push_back(fmt::format(
      "{} colours of the central {} x {} pixels of {} images. The eye is adapted to the colour itself, with one state "
      "for each cell of 16 pixels, by CIE 191 solved or looked up in a table. The displayed colours are compared, "
      "without blur",
      colours.size(), pictures->front().linear.width(), pictures->front().linear.height(), pictures->size()));
  out.remarks.insert(out.remarks.end(), remarks.begin(), remarks.end());
  return out;
}

}  // namespace lowlux::isp
