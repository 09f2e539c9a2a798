#include "isp/reproduce/reproduce.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "isp/base/text.h"

namespace lowlux::isp {
namespace {

constexpr std::array registry{
    Experiment{"few-photons", "Spectra seen through few photons (section 3.2, Fig. 3-1 and 3-2)", run_few_photons},
    Experiment{"chromaticity-clouds", "Chromaticities of ideal cones (section 3.3, Fig. 3-3 onwards)",
               run_chromaticity_clouds},
    Experiment{"frequency-of-seeing", "Seeing a flash of few photons (Eq. 2.1 to 2.7)", run_frequency_of_seeing},
    Experiment{"sensor-scenarios", "Noise of the image sensor (section 4, scenarios I to III)", run_sensor_scenarios},
    Experiment{"dark-desaturation", "Dark current desaturates (Eq. 4.16 to 4.24)", run_dark_desaturation},
    Experiment{"snr-sensitivity", "What the signal-to-noise ratio depends on (Eq. 4.12, 4.13)", run_snr_sensitivity},
    Experiment{"mesopic-tracks", "Colours under falling light by all models (section 5.2, Table 5-1)",
               run_mesopic_tracks},
    Experiment{"mesopic-fixed-gamma", "The spectral model without adaptation, gamma = 2 (Table 5-2)",
               run_mesopic_fixed_gamma},
    Experiment{"retargeting", "Pictures made for dim displays (section 5.3, Eq. 5.13 to 5.16)", run_retargeting, true},
};

}  // namespace

std::span<const Experiment> experiments() { return registry; }

Result<Experiment> experiment_named(std::string_view id) {
  std::vector<std::string_view> ids;
  for (const Experiment& experiment : registry) {
    if (experiment.id == id) return experiment;
    ids.push_back(experiment.id);
  }
  std::string near;
  for (const std::string_view match : near_matches(id, ids)) {
    near += near.empty() ? ", did you mean " : " or ";
    near += match;
  }
  return fail(
      ErrorCode::not_found,
      "there is no experiment '" + std::string(id) + "'" + near + (near.empty() ? "" : "?") + "; --list names all",
      std::string(id));
}

Table table_of(std::span<const Finding> findings) {
  Table table{{"finding", "kind", "claim", "published", "ours", "verdict", "note"}, {}};
  for (const Finding& f : findings) {
    table.rows.push_back(
        {f.id, std::string(kind_of(f)), f.claim, f.published, f.ours, std::string(verdict_of(f)), f.note});
  }
  return table;
}

std::string_view kind_of(const Finding& finding) {
  return finding.kind == Finding::Kind::published ? "published" : "check";
}

std::string_view verdict_of(const Finding& finding) {
  if (!finding.holds) return "does not hold";
  return finding.direction_only ? "same direction" : "agrees";
}

bool figures_agree(std::initializer_list<FigurePair> figures) {
  constexpr double tolerance = 0.1;  // relative to the published value
  return std::ranges::all_of(figures, [](const FigurePair& f) {
    return std::fabs(f.ours - f.published) <= tolerance * std::fabs(f.published);
  });
}

std::string count_of_verdicts(std::span<const Finding> findings, Finding::Kind kind) {
  int agree = 0, same_direction = 0, failed = 0;
  for (const Finding& f : findings) {
    if (f.kind != kind) continue;
    ++(!f.holds ? failed : f.direction_only ? same_direction : agree);
  }
  return fmt::format("{} agree, {} have the same direction, {} do not hold", agree, same_direction, failed);
}

}  // namespace lowlux::isp
