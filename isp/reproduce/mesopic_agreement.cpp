#include "isp/reproduce/mesopic_agreement.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <optional>
#include <set>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "isp/model/colour/colour_difference.h"
#include "isp/reproduce/reproduce.h"
#include "isp/reproduce/sampled_light.h"

namespace lowlux::isp {
namespace {

constexpr auto as_is = ShinUnits::luminance_as_is;
constexpr auto lux = ShinUnits::lux;
constexpr auto whites_kept = EntropyVariant::rendering;
constexpr auto printed = EntropyVariant::thesis;

constexpr std::array<TrackReading, readings> all_readings{{{1, as_is, whites_kept},
                                                           {1, as_is, printed},
                                                           {1, lux, whites_kept},
                                                           {1, lux, printed},
                                                           {0.2, as_is, whites_kept},
                                                           {0.2, as_is, printed},
                                                           {0.2, lux, whites_kept},
                                                           {0.2, lux, printed}}};

static_assert(all_readings[reading_by_lux].shin_units == lux && all_readings[reading_by_lux].adaptation_fraction == 1 &&
              all_readings[reading_by_lux].variant == whites_kept);
static_assert(all_readings[reading_as_printed].shin_units == as_is &&
              all_readings[reading_as_printed].adaptation_fraction == 1 &&
              all_readings[reading_as_printed].variant == printed);

std::vector<NamedSpectrum> patch_alone() {
  std::vector<NamedSpectrum> out = track_chips();
  std::erase_if(out, [](const NamedSpectrum& chip) { return chip.name != agreement_chip; });
  assert(out.size() == 1);
  return out;
}

/// Computes the appearance of the patch by all models of the pairs.
Result<std::vector<AppearanceTracks>> patch_tracks(std::span<const PublishedPair> pairs, const TrackReading& reading,
                                                   std::optional<double> gamma_fixed) {
  std::set<std::string_view> models;
  for (const PublishedPair& pair : pairs) models.insert({pair.first, pair.second});
  const auto patch = patch_alone();
  const auto levels = track_levels_cd_m2();
  std::vector<AppearanceTracks> out;
  out.reserve(models.size());
  for (const std::string_view model : models) {
    auto tracks = model == spectral_model ? tracks_by_spectrum(std::string(model), reading, gamma_fixed, patch, levels)
                                          : tracks_by_colour(model, reading, patch, levels);
    if (!tracks) return tl::make_unexpected(tracks.error());
    out.push_back(*std::move(tracks));
  }
  return out;
}

const AppearanceTracks& tracks_of(const std::vector<AppearanceTracks>& all, std::string_view model) {
  const auto found = std::ranges::find(all, model, &AppearanceTracks::model);
  assert(found != all.end());
  return *found;
}

bool has(const PublishedPair& pair, std::string_view model) { return pair.first == model || pair.second == model; }

/// Returns the reason why the values computed here differ.
std::string note_on(const Agreement& a) {
  if (has(a.pair, "cao")) {
    return "the scale of Cao's rods is not published; the weights end at 0.1 cd/m2 and are held below, where the "
           "thesis "
           "extrapolated them: see mesopic-tracks/cao-extrapolated";
  }
  if (has(a.pair, "khan_pattanaik")) {
    return "Khan & Pattanaik do not define luminance and the mixture with daylight: both are our choice";
  }
  if (has(a.pair, "icam06")) {
    return fmt::format(
        "Shin's table is not public, and iCAM06 is used without local contrast: a* and b* alone differ "
        "by {:.2f} by the first interpretation",
        a.without_lightness);
  }
  return fmt::format(
      "Shin's table is not public: SHIN-SUB-1 fades chroma evenly from 1000 cd/m2 down, where the spectral model has "
      "daylight still; the first interpretation with the table looked up in lux gives {:.2f}",
      a.ours[reading_by_lux]);
}

}  // namespace

std::span<const TrackReading> track_readings() { return all_readings; }

Result<std::vector<Agreement>> agreements(std::span<const PublishedPair> pairs, std::optional<double> gamma_fixed) {
  std::vector<Agreement> out;
  out.reserve(pairs.size());
  for (const PublishedPair& pair : pairs) out.push_back({.pair = pair});
  for (std::size_t i = 0; i < readings; ++i) {
    const auto tracks = patch_tracks(pairs, all_readings[i], gamma_fixed);
    if (!tracks) return tl::make_unexpected(tracks.error());
    for (Agreement& a : out) {
      a.ours[i] = mean_mutual_delta_e(tracks_of(*tracks, a.pair.first), tracks_of(*tracks, a.pair.second), 0);
      if (i == 0) {
        a.without_lightness =
            mean_chromatic_difference(tracks_of(*tracks, a.pair.first), tracks_of(*tracks, a.pair.second), 0);
      }
    }
  }
  return out;
}

const Agreement& agreement_of(std::span<const Agreement> all, std::string_view first, std::string_view second) {
  const auto found =
      std::ranges::find_if(all, [&](const Agreement& a) { return has(a.pair, first) && has(a.pair, second); });
  assert(found != all.end());
  return *found;
}

Finding figure_of(const std::string& experiment, const std::string& table, const Agreement& agreement) {
  const auto [least, most] = std::ranges::minmax(agreement.ours);
  const PublishedPair& pair = agreement.pair;
  const double first = agreement.ours.front(), as_printed = agreement.ours[reading_as_printed];
  const bool near = figures_agree({{pair.delta_e, first}}) || figures_agree({{pair.delta_e, as_printed}});
  const std::string printed_text = has(pair, spectral_model) ? fmt::format(", {:.2f} as printed", as_printed) : "";
  return {fmt::format("{}/{}-{}", experiment, pair.first, pair.second),
          fmt::format("mean Delta E ab of {} and {}, 10GY 6/10 at 14 levels ({})", pair.first, pair.second, table),
          fmt::format("{:.2f}", pair.delta_e),
          fmt::format("{:.2f}{}; {:.2f} to {:.2f} in {} interpretations", first, printed_text, least, most, readings),
          near || (least <= pair.delta_e && pair.delta_e <= most),
          note_on(agreement),
          Finding::Kind::published,
          !near};
}

Plot track_plot(const std::string& id, const AppearanceTracks& tracks, const std::vector<NamedSpectrum>& chips) {
  Plot plot{id, fmt::format("Ten Munsell chips by {}", tracks.model), "x", "y"};
  plot.equal_scales = true;
  plot.series = {spectral_locus()};
  int points = 0, left_out = 0;
  for (std::size_t chip = 0; chip < chips.size(); ++chip) {
    Series series{std::string(chips[chip].name), {}, {}, Mark::line};
    for (const Xyz& seen : tracks.seen[chip]) {
      const auto xy = xy_of(seen);
      const bool inside = xy && xy->x >= 0 && xy->x <= 1 && xy->y >= 0 && xy->y <= 1;
      ++points;
      left_out += inside ? 0 : 1;
      series.x.push_back(inside ? xy->x : white_e.x);
      series.y.push_back(inside ? xy->y : std::nan(""));
    }
    plot.series.push_back(std::move(series));
  }
  plot.caption = "From 0.002 to 1000 cd/m2 of an equal-energy white, 14 levels evenly spaced in the logarithm.";
  if (left_out > 0) {
    plot.caption += fmt::format(" {} of {} points are left out: x or y is not within 0 and 1.", left_out, points);
  }
  return plot;
}

Result<Plot> difference_plot(const std::string& id, std::span<const PublishedPair> pairs,
                             std::optional<double> gamma_fixed) {
  const auto tracks = patch_tracks(pairs, all_readings.front(), gamma_fixed);
  if (!tracks) return tl::make_unexpected(tracks.error());
  Plot plot{id, "10GY 6/10 by two models each", "luminance [cd/m2]", "Delta E ab", AxisScale::logarithmic};
  for (const PublishedPair& pair : pairs) {
    const auto& first = tracks_of(*tracks, pair.first).seen.front();
    const auto& second = tracks_of(*tracks, pair.second).seen.front();
    Series series{fmt::format("{}, {}", pair.first, pair.second), track_levels_cd_m2(), {}, Mark::line};
    for (std::size_t i = 0; i < first.size(); ++i) {
      series.y.push_back(delta_e_ab(lab_of_track(first[i]), lab_of_track(second[i])));
    }
    plot.series.push_back(std::move(series));
  }
  plot.caption = "By the first interpretation; their means are the first figures of the findings.";
  return plot;
}

namespace {

constexpr double fixed_gamma = 2;
constexpr std::array<PublishedPair, 3> table_5_2{
    {{"shin", spectral_model, 17.91}, {"shin", "icam06", 10.15}, {spectral_model, "icam06", 23.24}}};
// These are the values of Table 5-1 for the pairs of Table 5-2.
constexpr std::array<PublishedPair, 3> adaptive_pairs{
    {{"shin", spectral_model, 9.14}, {"shin", "icam06", 10.15}, {spectral_model, "icam06", 15.78}}};

Finding agrees_less(std::span<const Agreement> fixed, std::span<const Agreement> adaptive, std::string_view model,
                    const std::string& note) {
  const Agreement &with = agreement_of(adaptive, spectral_model, model),
                  &without = agreement_of(fixed, spectral_model, model);
  std::size_t less = 0;
  for (std::size_t i = 0; i < readings; ++i) less += without.ours[i] > with.ours[i] ? 1 : 0;
  return {fmt::format("mesopic-fixed-gamma/less-{}", model),
          fmt::format("without adaptation the spectral model agrees less with {} (Tables 5-1 and 5-2)", model),
          fmt::format("{:.2f} for {:.2f}", without.pair.delta_e, with.pair.delta_e),
          fmt::format("{:.2f} for {:.2f}; less in {} of {} interpretations", without.ours.front(), with.ours.front(),
                      less, readings),
          less == readings,
          note,
          Finding::Kind::published,
          !figures_agree({{without.pair.delta_e, without.ours.front()}, {with.pair.delta_e, with.ours.front()}})};
}

double chroma(const Xyz& seen) {
  const Lab lab = lab_of_track(seen);
  return std::hypot(lab.a, lab.b);
}

Finding fades_by_day(const AppearanceTracks& fixed, const AppearanceTracks& adaptive) {
  constexpr double faded = 0.5;
  double most = 0;
  for (std::size_t chip = 0; chip < fixed.seen.size(); ++chip) {
    most = std::max(most, chroma(fixed.seen[chip].back()) / chroma(adaptive.seen[chip].back()));
  }
  return {"mesopic-fixed-gamma/by-day",
          "gamma = 2 fades all chips by day too",
          "faded",
          fmt::format("{:.0f} % of the chroma at most", 100 * most),
          most <= faded,
          "at 1000 cd/m2, against the adaptive model; faded: half or less",
          Finding::Kind::check};
}

}  // namespace

Result<Outcome> run_mesopic_fixed_gamma(const RunOptions& /*options*/) {
  const auto adaptive = agreements(adaptive_pairs, std::nullopt);
  const auto fixed = agreements(table_5_2, fixed_gamma);
  if (!adaptive || !fixed) return tl::make_unexpected(adaptive ? fixed.error() : adaptive.error());
  const auto chips = track_chips();
  const auto levels = track_levels_cd_m2();
  const TrackReading reading = track_readings().front();
  const auto grown = tracks_by_spectrum(std::string(spectral_model), reading, std::nullopt, chips, levels);
  const auto stiff = tracks_by_spectrum("the spectral model, gamma = 2", reading, fixed_gamma, chips, levels);
  if (!grown || !stiff) return tl::make_unexpected(grown ? stiff.error() : grown.error());
  auto differences = difference_plot("mesopic-fixed-gamma-differences", table_5_2, fixed_gamma);
  if (!differences) return tl::make_unexpected(differences.error());
  Outcome out;
  for (const Agreement& a : *fixed) out.findings.push_back(figure_of("mesopic-fixed-gamma", "Table 5-2", a));
  out.findings.push_back(agrees_less(*fixed, *adaptive, "shin",
                                     "by Eq. 5.1 as printed and with coefficients by cd/m2, it is better in twilight, "
                                     "where gamma = 2 removes the green, by as much as it is worse by day"));
  out.findings.push_back(agrees_less(*fixed, *adaptive, "icam06", "10GY 6/10 at 14 levels"));
  out.findings.push_back(fades_by_day(*stiff, *grown));
  out.plots = {track_plot("mesopic-fixed-gamma-tracks", *stiff, chips), *std::move(differences)};
  return out;
}

}  // namespace lowlux::isp
