#include "isp/reproduce/reproduce.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "isp/base/text.h"

namespace lowlux::isp {
namespace {

constexpr std::array registry{
    Experiment{"few-photons", "Spectra seen through few photons (section 3.3, Fig. 3-1 and 3-2)", run_few_photons},
    Experiment{"chromaticity-clouds", "Chromaticities of ideal cones (section 3.4, Fig. 3-3 onwards)",
               run_chromaticity_clouds},
    Experiment{"frequency-of-seeing", "Seeing a flash of few photons (Eq. 2.1 to 2.7)", run_frequency_of_seeing},
    Experiment{"retina", "Light at the retina, and flashes that observers saw (Eq. 2.3, 3.3, Fig. 2-2)", run_retina},
    Experiment{"sensor-scenarios", "Noise of the image sensor (section 4, scenarios I to III)", run_sensor_scenarios},
    Experiment{"dark-desaturation", "Dark current desaturates (Eq. 4.16 to 4.24)", run_dark_desaturation},
    Experiment{"snr-sensitivity", "What the signal-to-noise ratio depends on (Eq. 4.12, 4.13)", run_snr_sensitivity},
    Experiment{"mesopic-photometry", "Adaptation between rods and cones by CIE 191 (Eq. 2.8, 2.9, Fig. 5-5)",
               run_mesopic_photometry},
    Experiment{"mesopic-tracks", "Colours under falling light by all models (section 5.2, Table 5-1)",
               run_mesopic_tracks},
    Experiment{"mesopic-fixed-gamma", "The spectral model without adaptation, gamma = 2 (Table 5-2)",
               run_mesopic_fixed_gamma},
    Experiment{"retargeting", "Pictures made for dim displays (section 5.3, Eq. 5.13 to 5.16)", run_retargeting, true},
};

constexpr std::array left_out{
    NotReproduced{
        "MetaCow's image and the second halves of its objects (Fig. 3-4, 3-7, 3-8)",
        "its spectra are published for research only and are not bundled: the first halves are 24 ColorChecker "
        "reflectances, and the smoothest lights of the same colours under D65 stand for the second halves, "
        "whose difference under illuminant A is the largest possible"},
    NotReproduced{"the thesis' 598 spectra, its seven images, Shin's table of coefficients",
                  "they are not public: README.md of isp/reproduce names the substitutes"},
    NotReproduced{"the extrapolation of Cao's weights below 0.1 cd/m2 in Table 5-1",
                  "it is not published; none of three extrapolations in either direction gives the published figures: "
                  "see mesopic-tracks/cao-extrapolated"},
    NotReproduced{"observers' judgements of retargeted images", "lowlux computes, it asks no observers"},
};

}  // namespace

std::span<const NotReproduced> not_reproduced() { return left_out; }

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
