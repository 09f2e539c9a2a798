#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "isp/bench/experiments.h"
#include "isp/bench/mesopic_agreement.h"

namespace lowlux::isp {
namespace {

constexpr double fixed_gamma = 2;
constexpr std::array<PublishedPair, 3> table_5_2{
    {{"shin", spectral_model, 17.91}, {"shin", "icam06", 10.15}, {spectral_model, "icam06", 23.24}}};
// The same pairs of Table 5-1.
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
          fmt::format("{:.2f} for {:.2f}; less in {} of {} readings", without.ours.front(), with.ours.front(), less,
                      readings),
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
                                     "by Eq. 5.1 as printed and coefficients by cd/m2 it gains in twilight, where "
                                     "gamma = 2 takes the green away, what it loses by day"));
  out.findings.push_back(agrees_less(*fixed, *adaptive, "icam06", "10GY 6/10 at 14 levels"));
  out.findings.push_back(fades_by_day(*stiff, *grown));
  out.plots = {track_plot("mesopic-fixed-gamma-tracks", *stiff, chips), *std::move(differences)};
  return out;
}

}  // namespace lowlux::isp
