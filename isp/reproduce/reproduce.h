#pragma once

#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "isp/base/result.h"
#include "isp/output/report/report.h"

namespace lowlux::isp {

/// One finding, published or this project's own, with the value computed here.
struct Finding {
  /// The claim is either published or a check by this project: of published equations, or of the sampling.
  enum class Kind : std::uint8_t { published, check };

  std::string id;         // EXPERIMENT/what
  std::string claim;      // published or checked claim, with its figure, equation or section
  std::string published;  // the claim's value, for a check the expected one; "-" where the claim has none
  std::string ours;       // the same quantity, computed
  bool holds = false;
  std::string note;  // how it was computed; why it does not hold
  Kind kind = Kind::published;
  bool direction_only = false;  // the claim holds, but the values differ from the published ones
};

/// A published value and the same quantity, computed.
struct FigurePair {
  double published;
  double ours;
};

/// Returns whether each computed value agrees with the published one: within a tenth of it.
bool figures_agree(std::initializer_list<FigurePair> figures);

/// Holds the results of one experiment.
struct Outcome {
  std::vector<Finding> findings;
  std::vector<Plot> plots;
};

/// Holds the options of an experiment.
struct RunOptions {
  std::uint64_t seed = 1;
  bool quick = false;           // fewer samples: the same findings with wider confidence intervals
  std::string pictures_folder;  // folder of testdata/pictures, for the experiments that use images
};

/// A published experiment: its result depends on the options only. Errors: a quantity cannot be computed, the images it
/// uses are missing.
struct Experiment {
  std::string_view id;
  std::string_view title;
  Result<Outcome> (*run)(const RunOptions& options);
  bool looks_at_pictures = false;  // uses the images of RunOptions::pictures_folder
};

/// Returns all experiments, in the order of the thesis.
std::span<const Experiment> experiments();

/// Returns the experiment of an id. Error: no such experiment; the message names similar ids.
Result<Experiment> experiment_named(std::string_view id);

/// A part of the thesis that no experiment reproduces.
struct NotReproduced {
  std::string_view what;  // with its figures and equations
  std::string_view why;
};

/// Returns the parts of the thesis that are not reproduced, in its order.
std::span<const NotReproduced> not_reproduced();

/// Returns findings as a table: finding, kind, claim, published, ours, verdict, note.
Table table_of(std::span<const Finding> findings);

/// Returns "published" or "check".
std::string_view kind_of(const Finding& finding);

/// Returns "agrees" (the claim holds, and its values within their tolerance), "same direction" (the claim holds, its
/// values do not) or "does not hold".
std::string_view verdict_of(const Finding& finding);

/// States the tolerances of the verdict "agrees".
inline constexpr std::string_view tolerance_of_verdicts =
    "agrees: the order, sign or pattern is as claimed, published values are met within a tenth, sampled ones within "
    "five standard errors, unless the note states another tolerance";

/// Returns the number of findings of a kind with each verdict: "20 agree, 10 have the same direction, 2 do not hold".
std::string count_of_verdicts(std::span<const Finding> findings, Finding::Kind kind);

/// These are the experiments of the registry, one file each; the claims are in their findings.
Result<Outcome> run_few_photons(const RunOptions& options);
Result<Outcome> run_chromaticity_clouds(const RunOptions& options);
Result<Outcome> run_frequency_of_seeing(const RunOptions& options);
Result<Outcome> run_retina(const RunOptions& options);
Result<Outcome> run_sensor_scenarios(const RunOptions& options);
Result<Outcome> run_dark_desaturation(const RunOptions& options);
Result<Outcome> run_snr_sensitivity(const RunOptions& options);
Result<Outcome> run_mesopic_photometry(const RunOptions& options);
Result<Outcome> run_mesopic_tracks(const RunOptions& options);
Result<Outcome> run_mesopic_fixed_gamma(const RunOptions& options);
Result<Outcome> run_retargeting(const RunOptions& options);

}  // namespace lowlux::isp
