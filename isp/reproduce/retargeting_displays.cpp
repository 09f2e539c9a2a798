#include "isp/reproduce/retargeting_displays.h"

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <utility>

#include <fmt/format.h>

#include "isp/model/appearance/icam06.h"
#include "isp/model/colour/colorimetry.h"
#include "isp/render/output_space.h"

namespace lowlux::isp {
namespace {

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

std::string measured_how(const RetargetingWork& work) {
  std::size_t colours = 0;
  for (const PictureColours& picture : work.pictures) colours += picture.codes.size();
  return fmt::format(
      "SHIN-SUB-1 looked up in cd/m2; Shin's model judges what was made by it: consistency, not perception; {} colours "
      "of {} pictures (the thesis' seven are not public), tables of {} levels",
      colours, work.pictures.size(), work.table_levels);
}

std::vector<Plot> plots_of_retargeting(std::span<const DisplayScores> all, const DisplayScores& one,
                                       const RetargetingWork& work) {
  constexpr auto delta_e = &RetargetScore::delta_e_94c;
  constexpr auto gamut = &RetargetScore::gamut_percent;
  std::vector<Plot> out{
      plot_over("delta-e", "Pictures of 250 cd/m2 on dim displays", "display [cd/m2]", delta_e, all, false),
      plot_over("gamut", "Gamut left on dim displays", "display [cd/m2]", gamut, all, false),
      plot_over("delta-e-pictures", "Each picture at 2 cd/m2", "picture", delta_e, {&one, 1}, true),
      plot_over("gamut-pictures", "Gamut left of each picture at 2 cd/m2", "picture", gamut, {&one, 1}, true)};
  std::string names = "Pictures:";
  for (const PictureColours& picture : work.pictures) names += " " + picture.name;
  for (Plot& plot : out) plot.caption = names + ". " + measured_how(work) + ".";
  return out;
}

}  // namespace lowlux::isp
