#include "isp/reproduce/retargeting_scores.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "isp/metrics/gamut_ratio.h"
#include "isp/metrics/picture_comparison.h"
#include "isp/model/appearance/appearance_model.h"
#include "isp/model/appearance/icam06.h"
#include "isp/model/colour/colorimetry.h"
#include "isp/render/output_space.h"
#include "isp/reproduce/bench_picture.h"

namespace lowlux::isp {
namespace {

/// Holds sRGB's primaries, and the white that results from them.
struct DisplaySpace {
  Matrix3 to_xyz = rgb_to_xyz(primaries_rec709).value();  // cannot fail for constants
  Xyz white = xyz_of(to_xyz * Vector3{1, 1, 1});
};

const DisplaySpace& display_space() {
  static const DisplaySpace space;
  return space;
}

PictureColours colours_of(const BenchPicture& picture, std::size_t most) {
  const auto& plane = picture.linear.plane;
  const int width = plane[0].width(), height = plane[0].height();
  const auto count = [&](int step) {
    return static_cast<std::size_t>((width + step - 1) / step) * static_cast<std::size_t>((height + step - 1) / step);
  };
  int step = 1;
  while (count(step) > most && step < std::max(width, height)) ++step;
  PictureColours out{picture.name, {}};
  out.codes.reserve(count(step));
  for (int y = 0; y < height; y += step) {
    for (int x = 0; x < width; x += step) {
      Vector3 code{};
      for (std::size_t c = 0; c < 3; ++c) {
        code[c] = encode_transfer(OutputSpace::srgb, std::clamp(static_cast<double>(plane[c].at(x, y)), 0.0, 1.0));
      }
      out.codes.push_back(code);
    }
  }
  return out;
}

Result<ColourMap> eye_at(double white_cd_m2, const Criterion& judge) {
  const auto model = appearance_model_named(judge.model);
  if (!model) return tl::make_unexpected(model.error());
  ViewingConditions conditions;
  conditions.white_cd_m2 = white_cd_m2;
  conditions.white = display_space().white;
  conditions.shin_units = judge.units;
  return model->at(conditions);
}

Lab seen(const ColourMap& eye, const Vector3& code) {
  Vector3 light{};
  for (std::size_t c = 0; c < 3; ++c) light[c] = decode_transfer(OutputSpace::srgb, code[c]);
  return lab_of(eye(xyz_of(display_space().to_xyz * light)), display_space().white);
}

struct Scoring {
  const std::vector<PictureColours>& pictures;
  const RetargetTable& shown;
  ColourMap by_source, by_display;
  std::vector<RetargetScore> scores;

  void score(std::size_t index) {
    const auto& codes = pictures[index].codes;
    std::vector<Lab> original, retargeted;
    original.reserve(codes.size());
    retargeted.reserve(codes.size());
    for (const Vector3& code : codes) {
      original.push_back(seen(by_source, code));
      retargeted.push_back(seen(by_display, looked_up(shown, code)));
    }
    scores[index].delta_e_94c = mean_delta_e_94c(original, retargeted);
    scores[index].gamut_percent = gamut_ratio(original, retargeted).convex_percent;
  }
};

double mean(const PictureScores& scores, double RetargetScore::*figure) {
  double sum = 0;
  for (const RetargetScore& score : scores) sum += score.*figure;
  return sum / static_cast<double>(scores.size());
}

Result<RetargetTable> table_of(RetargetMethod method, double display_cd_m2, ShinUnits units,
                               const RetargetingWork& work) {
  if (method == RetargetMethod::icam06) {
    return tabulated(icam06_forward(display_cd_m2), work.table_levels, work.executor);
  }
  RetargetOptions options;
  options.method = method;
  options.source_cd_m2 = retargeting_source_cd_m2;
  options.display_cd_m2 = display_cd_m2;
  options.units = units;
  const auto map = retargeting(options);
  if (!map) return tl::make_unexpected(map.error());
  return tabulated([&map](const Vector3& code) { return (*map)(code).code; }, work.table_levels, work.executor);
}

Plot plot_over(const std::string& id, const std::string& title, const std::string& x_label,
               double RetargetScore::*figure, std::span<const DisplayScores> all, bool pictures) {
  Plot plot{fmt::format("retargeting-{}", id), title, x_label,
            figure == &RetargetScore::delta_e_94c ? "mean Delta E 94c" : "EGR [%]",
            pictures ? AxisScale::linear : AxisScale::logarithmic};
  for (const RetargetMethod method : retargeting_rows) {
    Series series{std::string(name_of(method)), {}, {}, pictures ? Mark::points : Mark::line};
    for (const DisplayScores& at : all) {
      const PictureScores& scores = at.of(method);
      if (!pictures) {
        series.x.push_back(at.display_cd_m2);
        series.y.push_back(mean(scores, figure));
      }
      for (std::size_t i = 0; pictures && i < scores.size(); ++i) {
        series.x.push_back(static_cast<double>(i + 1));
        series.y.push_back(scores[i].*figure);
      }
    }
    plot.series.push_back(std::move(series));
  }
  return plot;
}

}  // namespace

Result<std::vector<PictureColours>> retargeting_pictures(const std::string& folder, const Sampling& sampling,
                                                         Executor& executor) {
  assert(sampling.colours > 0);
  std::error_code ignored;
  if (!std::filesystem::is_directory(folder, ignored)) {
    return fail(ErrorCode::not_found,
                "there is no such folder of images: --pictures-folder names the testdata/pictures of lowlux's sources",
                folder);
  }
  const auto files = files_of(PictureSet::all);
  std::vector<PictureColours> out;
  out.reserve(files.size());
  for (const std::string_view file : files) {
    const std::string path = (std::filesystem::path(folder) / file).string();
    const auto picture = read_bench_picture(path, sampling.crop_px, sampling.crop_px, executor);
    if (!picture) return tl::make_unexpected(picture.error());
    out.push_back(colours_of(*picture, sampling.colours));
  }
  return out;
}

Result<std::vector<RetargetScore>> retarget_scores(const std::vector<PictureColours>& pictures, const Showing& showing,
                                                   const Criterion& judge, Executor& executor) {
  assert(showing.shown != nullptr);
  auto source = eye_at(showing.source_cd_m2, judge);
  if (!source) return tl::make_unexpected(source.error());
  auto display = eye_at(showing.display_cd_m2, judge);
  if (!display) return tl::make_unexpected(display.error());
  Scoring scoring{pictures, *showing.shown, *std::move(source), *std::move(display),
                  std::vector<RetargetScore>(pictures.size())};
  for_each_index(executor, static_cast<int>(pictures.size()),
                 [&](int index) { scoring.score(static_cast<std::size_t>(index)); });
  return std::move(scoring.scores);
}

CodeMap icam06_forward(double display_cd_m2) {
  const Matrix3 to_xyz = rgb_to_xyz(primaries_rec709).value();  // cannot fail for constants
  const Matrix3 adapt = *bradford_adaptation(white_d65, white_e);
  const Matrix3 to_cd_m2 = display_cd_m2 * adapt * to_xyz;
  const Matrix3 to_rgb = *inverse(adapt * to_xyz);
  const Icam06State state{.white_cd_m2 = display_cd_m2, .scotopic_white_cd_m2 = display_cd_m2};
  const double white_response = icam06_compress(to_cd_m2 * Vector3{1, 1, 1}, state).xyz_tc[1];
  return [=](const Vector3& code) {
    Vector3 light{}, out{};
    for (std::size_t c = 0; c < 3; ++c) light[c] = decode_transfer(OutputSpace::srgb, code[c]);
    const Vector3 rgb = to_rgb * icam06_compress(to_cd_m2 * light, state).xyz_tc;
    for (std::size_t c = 0; c < 3; ++c) {
      out[c] = encode_transfer(OutputSpace::srgb, std::clamp(rgb[c] / white_response, 0.0, 1.0));
    }
    return out;
  };
}

double mean_delta_e(const PictureScores& scores) { return mean(scores, &RetargetScore::delta_e_94c); }
double mean_gamut(const PictureScores& scores) { return mean(scores, &RetargetScore::gamut_percent); }

const DisplayScores::Row& DisplayScores::row(RetargetMethod method) const {
  const auto found = std::ranges::find(rows, method, &Row::method);
  assert(found != rows.end());
  return *found;
}

Result<DisplayScores> scores_on(double display_cd_m2, ShinUnits units, std::span<const RetargetMethod> which,
                                const RetargetingWork& work) {
  DisplayScores out{.display_cd_m2 = display_cd_m2, .units = units, .rows = {}};
  out.rows.reserve(which.size());
  for (const RetargetMethod method : which) {
    auto table = table_of(method, display_cd_m2, units, work);
    if (!table) return tl::make_unexpected(table.error());
    auto scores = retarget_scores(work.pictures, {retargeting_source_cd_m2, display_cd_m2, &*table}, {"shin", units},
                                  work.executor);
    if (!scores) return tl::make_unexpected(scores.error());
    out.rows.push_back({method, *std::move(table), *std::move(scores)});
  }
  return out;
}

std::string measurement_method(const RetargetingWork& work) {
  std::size_t colours = 0;
  for (const PictureColours& picture : work.pictures) colours += picture.codes.size();
  return fmt::format(
      "SHIN-SUB-1 looked up in cd/m2; images made by Shin's model are scored by Shin's model, which tests consistency, "
      "not perception; {} colours of {} images (the seven images of the thesis are not public), tables of {} levels",
      colours, work.pictures.size(), work.table_levels);
}

std::vector<Plot> plots_of_retargeting(std::span<const DisplayScores> all, const DisplayScores& one,
                                       const RetargetingWork& work) {
  constexpr auto delta_e = &RetargetScore::delta_e_94c;
  constexpr auto gamut = &RetargetScore::gamut_percent;
  std::vector<Plot> out{
      plot_over("delta-e", "Images for 250 cd/m2 on dim displays", "display [cd/m2]", delta_e, all, false),
      plot_over("gamut", "Remaining gamut on dim displays", "display [cd/m2]", gamut, all, false),
      plot_over("delta-e-pictures", "Each image at 2 cd/m2", "picture", delta_e, {&one, 1}, true),
      plot_over("gamut-pictures", "Remaining gamut of each image at 2 cd/m2", "picture", gamut, {&one, 1}, true)};
  std::string names = "Pictures:";
  for (const PictureColours& picture : work.pictures) names += " " + picture.name;
  for (Plot& plot : out) plot.caption = names + ". " + measurement_method(work) + ".";
  return out;
}

}  // namespace lowlux::isp
