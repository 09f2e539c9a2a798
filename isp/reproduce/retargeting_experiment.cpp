#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "isp/reproduce/reproduce.h"
#include "isp/reproduce/retargeting_scores.h"

namespace lowlux::isp {
namespace {

constexpr double main_display_cd_m2 = 2;
constexpr std::array<double, 4> displays_cd_m2{1, 2, 5, 10};
constexpr std::array inverse_and_ours{RetargetMethod::shin, RetargetMethod::constrained};
constexpr std::array<std::string_view, 3> other_judges{"wanat_mantiuk", "mikamo", "icam06"};
constexpr std::size_t enough_pictures = 7, enough_judges = 2;

// Means over seven images of the thesis' own: Delta E 94c from its Table 5-5, EGR from its Table 5-6.
struct PublishedMeans {
  double delta_e_94c, gamut_percent;
};
constexpr PublishedMeans unprocessed{8.49, 9.5}, inverse{5.72, 26.2}, by_cao{8.16, 11.0}, by_icam06{10.90, 13.9};

std::string percent_text(double percent) { return fmt::format("{:.1f} %", percent); }

std::string both(const PictureScores& scores) {
  return fmt::format("{:.2f} and {}", mean_delta_e(scores), percent_text(mean_gamut(scores)));
}

std::string both(const PublishedMeans& means) {
  return fmt::format("{:.2f} and {:.1f} %", means.delta_e_94c, means.gamut_percent);
}

bool agree(const PublishedMeans& means, const PictureScores& scores) {
  return figures_agree({{means.delta_e_94c, mean_delta_e(scores)}, {means.gamut_percent, mean_gamut(scores)}});
}

Finding forward_is_farther(const DisplayScores& at) {
  const double none = mean_delta_e(at.of(RetargetMethod::none)), icam = mean_delta_e(at.of(RetargetMethod::icam06));
  const double published = by_icam06.delta_e_94c / unprocessed.delta_e_94c;
  return {"retargeting/icam06-farther",
          "iCAM06, applied forward, leaves images farther from their look at 250 cd/m2 than unprocessed ones: mean "
          "Delta E 94c (Table 5-5)",
          fmt::format("{:.2f} for {:.2f}, {:.2f} times", by_icam06.delta_e_94c, unprocessed.delta_e_94c, published),
          fmt::format("{:.2f} for {:.2f}, {:.2f} times", icam, none, icam / none),
          icam > none,
          "max_L = 2 cd/m2, p = 0.7, gamma = 1 (section 5.4.2), without local contrast; factors are compared, because "
          "the images differ from those of the thesis",
          Finding::Kind::published,
          !figures_agree({{published, icam / none}})};
}

Finding forward_shows_more(const DisplayScores& at) {
  const double none = mean_gamut(at.of(RetargetMethod::none)), icam = mean_gamut(at.of(RetargetMethod::icam06));
  return {"retargeting/icam06-gamut",
          "iCAM06, applied forward, shows more of the images' gamut than unprocessed ones: mean EGR (Table 5-6)",
          fmt::format("{:.1f} % for {:.1f} %", by_icam06.gamut_percent, unprocessed.gamut_percent),
          fmt::format("{} for {}", percent_text(icam), percent_text(none)),
          icam > none,
          "the thesis does not state how responses are converted to light; here they are relative to the response to "
          "white, so the contribution of the rods desaturates all colours; the colourfulness adjustment of iCAM06 is "
          "not applied",
          Finding::Kind::published,
          !figures_agree({{by_icam06.gamut_percent, icam}})};
}

std::vector<Finding> published_findings(const DisplayScores& at, const RetargetingWork& work) {
  const PictureScores &none = at.of(RetargetMethod::none), &shin = at.of(RetargetMethod::shin);
  const PictureScores& cao = at.of(RetargetMethod::cao);
  return {{"retargeting/closer",
           "Shin's inverse brings images at 2 cd/m2 closer to their look at 250: mean Delta E 94c (Table 5-5)",
           fmt::format("{:.2f} for {:.2f}", inverse.delta_e_94c, unprocessed.delta_e_94c),
           fmt::format("{:.2f} for {:.2f}", mean_delta_e(shin), mean_delta_e(none)),
           mean_delta_e(shin) < mean_delta_e(none), measurement_method(work), Finding::Kind::published,
           !figures_agree({{inverse.delta_e_94c, mean_delta_e(shin)}, {unprocessed.delta_e_94c, mean_delta_e(none)}})},
          {"retargeting/gamut", "Shin's inverse shows more of the images' gamut at 2 cd/m2: mean EGR (Table 5-6)",
           fmt::format("{:.1f} % for {:.1f} %", inverse.gamut_percent, unprocessed.gamut_percent),
           fmt::format("{} for {}", percent_text(mean_gamut(shin)), percent_text(mean_gamut(none))),
           mean_gamut(shin) > mean_gamut(none), "convex hulls in a*, b*", Finding::Kind::published,
           !figures_agree({{inverse.gamut_percent, mean_gamut(shin)}, {unprocessed.gamut_percent, mean_gamut(none)}})},
          {"retargeting/cao",
           "Cao's model, which the thesis attributes to Wanat & Mantiuk, improves both metrics less than Shin's "
           "(Tables 5-5 and 5-6)",
           both(by_cao), both(cao), mean_delta_e(cao) > mean_delta_e(shin) && mean_gamut(cao) < mean_gamut(shin),
           fmt::format("mean Delta E 94c and EGR; unprocessed {}", both(none)), Finding::Kind::published,
           !agree(by_cao, cao)},
          forward_is_farther(at),
          forward_shows_more(at)};
}

/// Numbers of images in which this project's method is better than the published inverse.
struct Wins {
  std::size_t delta_e = 0, gamut = 0;
};

Wins wins_of(const DisplayScores& at) {
  const PictureScores &ours = at.of(RetargetMethod::constrained), &shin = at.of(RetargetMethod::shin);
  Wins out;
  for (std::size_t i = 0; i < ours.size(); ++i) {
    out.delta_e += ours[i].delta_e_94c < shin[i].delta_e_94c ? 1 : 0;
    out.gamut += ours[i].gamut_percent > shin[i].gamut_percent ? 1 : 0;
  }
  return out;
}

Finding check_of(std::string what, std::string claim, std::string expected, std::string ours, bool holds,
                 std::string note) {
  return {"retargeting/" + std::move(what),
          std::move(claim),
          std::move(expected),
          std::move(ours),
          holds,
          std::move(note),
          Finding::Kind::check};
}

std::vector<Finding> our_findings(const DisplayScores& at, const RetargetingWork& work) {
  const PictureScores &ours = at.of(RetargetMethod::constrained), &shin = at.of(RetargetMethod::shin);
  const Wins wins = wins_of(at);
  const std::string unit = at.units == ShinUnits::lux ? "-by-lux" : "";
  const std::string by = at.units == ShinUnits::lux ? ", coefficients by lux" : "";
  const std::string least = fmt::format("{} of {} images", enough_pictures, work.pictures.size());
  const std::string note =
      at.units == ShinUnits::lux
          ? "a white of 250 cd/m2 is 873 lx and nearly daylight to Shin's model, one of 2 cd/m2 is 7 lx"
          : "coefficients looked up with 250 and 2 cd/m2 without conversion to lux, as in the thesis";
  const auto gamut_text = [&](const PictureScores& scores) { return percent_text(mean_gamut(scores)); };
  std::vector<Finding> out{
      check_of("ours-delta-e" + unit,
               "the method constrained is better than Shin's inverse in Delta E 94c at 2 cd/m2" + by, least,
               fmt::format("{} of {}, mean {:.2f} for {:.2f}", wins.delta_e, ours.size(), mean_delta_e(ours),
                           mean_delta_e(shin)),
               wins.delta_e >= enough_pictures, note),
      check_of("ours-gamut" + unit, "the method constrained is better than Shin's inverse in EGR at 2 cd/m2" + by,
               least,
               fmt::format("{} of {}, mean {} for {}", wins.gamut, ours.size(), gamut_text(ours), gamut_text(shin)),
               wins.gamut >= enough_pictures, note)};
  if (at.units == ShinUnits::lux) return out;  // the other methods are not measured in this unit
  const PictureScores& wanat = at.of(RetargetMethod::wanat);
  out.push_back(check_of("wanat",
                         "the saturation and the luminance curve of Wanat & Mantiuk are worse than Shin's inverse",
                         "farther", both(wanat), mean_delta_e(wanat) > mean_delta_e(shin),
                         "mean Delta E 94c and EGR; the thesis uses Cao's model under that name"));
  return out;
}

/// Mean Delta E 94c according to one judge.
struct JudgedMeans {
  double ours = 0, inverse = 0, none = 0;
};

Result<JudgedMeans> means_by(std::string_view judge, const DisplayScores& at, const RetargetingWork& work) {
  JudgedMeans out;
  const std::array<std::pair<RetargetMethod, double*>, 3> wanted{{{RetargetMethod::constrained, &out.ours},
                                                                  {RetargetMethod::shin, &out.inverse},
                                                                  {RetargetMethod::none, &out.none}}};
  for (const auto& [method, figure] : wanted) {
    const auto scores =
        retarget_scores(work.pictures, {retargeting_source_cd_m2, at.display_cd_m2, &at.row(method).table},
                        {judge, at.units}, work.executor);
    if (!scores) return tl::make_unexpected(scores.error());
    *figure = mean_delta_e(*scores);
  }
  return out;
}

Result<std::vector<Finding>> by_other_judges(const DisplayScores& at, const RetargetingWork& work) {
  std::string against_inverse, against_none;
  std::size_t no_worse = 0, closer = 0;
  for (const std::string_view judge : other_judges) {
    const auto means = means_by(judge, at, work);
    if (!means) return tl::make_unexpected(means.error());
    no_worse += means->ours <= means->inverse ? 1 : 0;
    closer += means->ours < means->none ? 1 : 0;
    const char* comma = against_none.empty() ? "" : ", ";
    against_inverse += fmt::format("{}{} {:.2f} for {:.2f}", comma, judge, means->ours, means->inverse);
    against_none += fmt::format("{}{} {:.2f} for {:.2f}", comma, judge, means->ours, means->none);
  }
  const std::string enough = fmt::format("{} of {} models", enough_judges, other_judges.size());
  return std::vector<Finding>{
      check_of("ours-by-others", "the method constrained is not worse than Shin's inverse by other models than Shin's",
               enough, against_inverse, no_worse >= enough_judges,
               "mean Delta E 94c at 2 cd/m2, constrained for the inverse"),
      check_of("closer-by-others",
               "the method constrained is closer than the unprocessed image by other models than Shin's", enough,
               against_none, closer >= enough_judges,
               "constrained for unprocessed; between 250 and 2 cd/m2 colours fade far less by Wanat & Mantiuk than by "
               "SHIN-SUB-1, so compensation by the latter is too colourful by the former; by Mikamo's model saturated "
               "colours are far outside all gamuts")};
}

/// Reports the four claims on Figure 5-16 about displays of 1, 2, 5 and 10 cd/m2.
std::vector<Finding> of_figure_5_16(std::span<const DisplayScores> all) {
  bool closer = true, wider = true, falls = true, rises = true;
  std::string delta_e, gamut;
  const DisplayScores* dimmer = nullptr;
  for (const DisplayScores& at : all) {
    const PictureScores &shin = at.of(RetargetMethod::shin), &none = at.of(RetargetMethod::none);
    closer = closer && mean_delta_e(shin) < mean_delta_e(none);
    wider = wider && mean_gamut(shin) > mean_gamut(none);
    falls = falls && (dimmer == nullptr || mean_delta_e(shin) < mean_delta_e(dimmer->of(RetargetMethod::shin)));
    rises = rises && (dimmer == nullptr || mean_gamut(shin) > mean_gamut(dimmer->of(RetargetMethod::shin)));
    dimmer = &at;
    delta_e += fmt::format("{}{:.2f} for {:.2f}", delta_e.empty() ? "" : ", ", mean_delta_e(shin), mean_delta_e(none));
    gamut += fmt::format("{}{} for {}", gamut.empty() ? "" : ", ", percent_text(mean_gamut(shin)),
                         percent_text(mean_gamut(none)));
  }
  const std::string on = "on displays of 1, 2, 5 and 10 cd/m2 (Fig. 5-16)", note = "Shin's inverse for unprocessed";
  const std::string order = "no figures are published with this claim; order of the means over the images";
  return {{"retargeting/displays-closer", "compensated images are closer than unprocessed ones " + on, "closer",
           delta_e, closer, note + "; " + order},
          {"retargeting/displays-gamut", "compensated images show more of the gamut than unprocessed ones " + on,
           "more", gamut, wider, note + "; " + order},
          {"retargeting/displays-delta-e-falls", "Delta E 94c of compensated images falls with luminance " + on,
           "falls", delta_e, falls, order},
          {"retargeting/displays-gamut-rises", "EGR of compensated images rises with luminance " + on, "rises", gamut,
           rises, order}};
}

Finding on_other_displays(std::span<const DisplayScores> all) {
  bool holds = true;
  std::string text;
  for (const DisplayScores& at : all) {
    const PictureScores &ours = at.of(RetargetMethod::constrained), &shin = at.of(RetargetMethod::shin);
    holds = holds && mean_delta_e(ours) < mean_delta_e(shin) && mean_gamut(ours) > mean_gamut(shin);
    text += fmt::format("{}{:g} cd/m2: {} for {}", text.empty() ? "" : "; ", at.display_cd_m2, both(ours), both(shin));
  }
  return check_of("ours-displays",
                  "the method constrained is better than Shin's inverse on average on displays of other luminances",
                  "in both", text, holds, "mean Delta E 94c and EGR, constrained for the inverse");
}

}  // namespace

Result<Outcome> run_retargeting(const RunOptions& options) {
  PoolExecutor executor(std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 8));
  const Sampling sampling{.crop_px = options.quick ? 192 : 0, .colours = options.quick ? 4000U : 60000U};
  const auto pictures = retargeting_pictures(options.pictures_folder, sampling, executor);
  if (!pictures) return tl::make_unexpected(pictures.error());
  const RetargetingWork work{*pictures, options.quick ? 17 : 33, options, executor};
  std::vector<DisplayScores> all;
  all.reserve(displays_cd_m2.size());
  for (const double display : displays_cd_m2) {
    if (options.quick && display != main_display_cd_m2) continue;
    auto scores = scores_on(display, ShinUnits::luminance_as_is, retargeting_rows, work);
    if (!scores) return tl::make_unexpected(scores.error());
    all.push_back(*std::move(scores));
  }
  const auto by_lux = scores_on(main_display_cd_m2, ShinUnits::lux, inverse_and_ours, work);
  if (!by_lux) return tl::make_unexpected(by_lux.error());
  const DisplayScores& at = *std::ranges::find(all, main_display_cd_m2, &DisplayScores::display_cd_m2);
  const auto judged = by_other_judges(at, work);
  if (!judged) return tl::make_unexpected(judged.error());
  Outcome out{published_findings(at, work), plots_of_retargeting(all, at, work)};
  for (const Finding& finding : our_findings(at, work)) out.findings.push_back(finding);
  for (const Finding& finding : *judged) out.findings.push_back(finding);
  for (const Finding& finding : our_findings(*by_lux, work)) out.findings.push_back(finding);
  if (options.quick) return out;  // one display only
  for (const Finding& finding : of_figure_5_16(all)) out.findings.push_back(finding);
  out.findings.push_back(on_other_displays(all));
  return out;
}

}  // namespace lowlux::isp
