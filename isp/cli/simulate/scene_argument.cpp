#include "isp/cli/simulate/scene_argument.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "capture/file/picture_source.h"
#include "capture/file/spectra_file.h"
#include "isp/base/file_extension.h"
#include "isp/base/text.h"
#include "isp/cli/shared/option_values.h"
#include "isp/model/spectrum/cie_data.h"
#include "isp/model/spectrum/spectral_response.h"

namespace lowlux::cli {
namespace {

bool names_table(const std::string& text) { return has_extension(text, ".csv"); }

/// Resamples a light to at most 5 nm where sensors and eyes may respond: integrals use the light's own nodes alone.
Result<Spectrum> finely_sampled(const Spectrum& light) {
  constexpr double step_nm = 5, min_nm = 200, max_nm = 2500;
  std::vector<double> nodes;
  for (const double node : light.wavelengths_nm()) {
    if (!nodes.empty() && node - nodes.back() > step_nm) {
      const double end = std::min(node, max_nm);
      const int last = static_cast<int>(std::ceil(end / step_nm));
      for (int i = static_cast<int>(std::max(nodes.back(), min_nm) / step_nm); i < last; ++i) {
        if (i * step_nm > nodes.back()) nodes.push_back(i * step_nm);
      }
    }
    nodes.push_back(node);
  }
  return resample(light, nodes);
}

Result<capture::SceneSetup> setup_of(const SceneArgs& args) {
  auto light = light_of(args.light, "--light");
  if (!light) return tl::make_unexpected(light.error());
  return capture::SceneSetup{args.reduction * args.width, args.reduction * args.height, *std::move(light),
                             std::filesystem::path(args.light).filename().string(), args.luminance_cd_m2};
}

Result<std::vector<capture::SpectrumColumn>> read_reflectances(const std::string& file) {
  constexpr double largest = 2;  // fluorescence and highlights exceed 1, percentages far more
  auto table = capture::read_spectra(file);
  if (!table) return table;
  for (const capture::SpectrumColumn& column : *table) {
    const auto values = column.spectrum.values();
    if (const double most = *std::max_element(values.begin(), values.end()); most > largest) {
      return fail(ErrorCode::malformed,
                  fmt::format("the reflectance of {} is {:g}, the maximum is {:g}: is the table in percent?",
                              column.name, most, largest),
                  file);
    }
  }
  return table;
}

Result<capture::Scene> chart_of(const SceneArgs& args, const capture::SceneSetup& setup) {
  const std::string which = args.what == "chart" ? "colorchecker" : args.what.substr(6);
  if (names_table(which)) {
    const auto table = read_reflectances(which);
    if (!table) return tl::make_unexpected(table.error());
    std::vector<isp::NamedSpectrum> patches;
    for (const capture::SpectrumColumn& column : *table) patches.push_back({column.name, column.spectrum});
    return capture::chart_scene(setup, patches);
  }
  static const Names<isp::SpectrumSet> charts{{"colorchecker", isp::SpectrumSet::colorchecker},
                                              {"macbeth", isp::SpectrumSet::macbeth},
                                              {"munsell", isp::SpectrumSet::munsell_ten}};
  const auto found = charts.find(which);
  if (found == charts.end()) {
    return fail(
        ErrorCode::invalid_argument,
        fmt::format("unknown chart '{}': the charts are {}, or a table (chart:FILE.csv)", which, joined(charts)),
        "SCENE");
  }
  return capture::chart_scene(setup, isp::spectra_of(found->second));
}

Result<SceneOfArgs> picture_of(const SceneArgs& args, Executor& executor) {
  auto picture = args.picture ? Result<capture::ScenePicture>(std::move(*args.picture))
                              : capture::read_picture(args.what, executor);
  if (!picture) {
    Error error = picture.error();
    static constexpr std::array<std::string_view, 5> made{"dark", "flat", "chart", "chart:macbeth", "chart:munsell"};
    const auto near = near_matches(args.what, made);
    if (error.code == ErrorCode::not_found && !near.empty()) {
      error.message += fmt::format("; scenes near it: {}", fmt::join(near, ", "));
    }
    return tl::make_unexpected(std::move(error));
  }
  if (args.size_given) return fail(ErrorCode::invalid_argument, "an image has its own size", "--size");
  if (args.light_given) return fail(ErrorCode::invalid_argument, "an image has its own light", "--light");
  const double luminance =
      picture->absolute && !args.luminance_given ? picture->white_luminance_cd_m2 : args.luminance_cd_m2;
  auto scene = capture::picture_scene(std::move(picture->xyz), luminance);
  if (!scene) return tl::make_unexpected(scene.error());
  return SceneOfArgs{*std::move(scene), luminance, std::move(picture->warnings)};
}

Result<SceneOfArgs> extended_scene(const SceneArgs& args, Executor& executor) {
  const bool made =
      args.what == "dark" || args.what == "flat" || args.what == "chart" || args.what.starts_with("chart:");
  if (args.picture || !made) return picture_of(args, executor);
  if (args.what == "dark" && args.light_given) {
    return fail(ErrorCode::invalid_argument, "the scene dark has no light; flat and charts have", "--light");
  }
  const auto setup = setup_of(args);
  if (!setup) return tl::make_unexpected(setup.error());
  auto scene = args.what == "dark"   ? capture::dark_scene(*setup)
               : args.what == "flat" ? capture::flat_scene(*setup)
                                     : chart_of(args, *setup);
  if (!scene) return tl::make_unexpected(scene.error());
  return SceneOfArgs{*std::move(scene), args.luminance_cd_m2, {}};
}

}  // namespace

Result<Spectrum> light_of(const std::string& name, const std::string& option) {
  if (names_table(name)) {
    auto table = capture::read_spectra(name);
    if (!table) return tl::make_unexpected(table.error());
    if (table->size() != 1) {
      return fail(ErrorCode::malformed, fmt::format("a light must be one spectrum, the table has {}", table->size()),
                  name);
    }
    const auto power = table->front().spectrum.values();
    if (*std::min_element(power.begin(), power.end()) < 0) {
      return fail(ErrorCode::malformed, "the power of a light must not be negative", name);
    }
    return finely_sampled(table->front().spectrum);
  }
  if (auto light = isp::light_named(name)) return *std::move(light);
  const auto near = near_matches(name, isp::light_names());
  return fail(ErrorCode::invalid_argument,
              fmt::format("unknown light '{}'; {}", name,
                          near.empty() ? "`lowlux simulate --list` names them"
                                       : fmt::format("near it: {}", fmt::join(near, ", "))),
              option);
}

Result<SceneOfArgs> scene_of(const SceneArgs& args, std::uint64_t seed, Executor& executor) {
  auto out = extended_scene(args, executor);
  if (!out) return out;
  for (const LampArgs& lamp : args.lamps) {
    const auto light = light_of(lamp.light, "--lamp");
    if (!light) return tl::make_unexpected(light.error());
    const auto lit = capture::add_lamp(out->scene, lamp.x_px, lamp.y_px, *light, lamp.luminance_cd_m2);
    if (!lit) return fail(lit.error().code, lit.error().message, "--lamp");
  }
  const double faintest = args.star_luminance_cd_m2.value_or(args.luminance_cd_m2 / 10);
  if (const auto stars = capture::add_stars(out->scene, args.stars, faintest, seed, args.reduction); !stars) {
    return tl::make_unexpected(stars.error());
  }
  return out;
}

}  // namespace lowlux::cli
