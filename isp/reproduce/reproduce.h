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

/// One finding, published or our own, beside what is computed here.
struct Finding {
  /// Whether its authors published the claim, or whether it is a check of ours: of their equations, or of the sampling.
  enum class Kind : std::uint8_t { published, check };

  std::string id;         // EXPERIMENT/what
  std::string claim;      // what was published or is checked, with its figure, equation or section
  std::string published;  // the figure in it, of a check what is expected; "-" where the claim has none
  std::string ours;       // the same quantity, computed
  bool holds = false;
  std::string note;  // how it was computed; why it does not hold
  Kind kind = Kind::published;
  bool direction_only = false;  // the claim holds, and its figures are not ours
};

/// A published figure and the same quantity, computed.
struct FigurePair {
  double published;
  double ours;
};

/// Whether each of our figures is within a tenth of the published one.
bool figures_agree(std::initializer_list<FigurePair> figures);

/// What one experiment yields.
struct Outcome {
  std::vector<Finding> findings;
  std::vector<Plot> plots;
};

struct RunOptions {
  std::uint64_t seed = 1;
  bool quick = false;           // fewer samples: the same findings with wider confidence intervals
  std::string pictures_folder;  // that of testdata/pictures, for the experiments that look at pictures
};

/// A published experiment: its result depends on the options only. Errors: what it computes cannot be computed, the
/// pictures it looks at are not there.
struct Experiment {
  std::string_view id;
  std::string_view title;
  Result<Outcome> (*run)(const RunOptions& options);
  bool looks_at_pictures = false;  // those of RunOptions::pictures_folder
};

/// All of them, in the order of the thesis.
std::span<const Experiment> experiments();

/// The experiment of an id. Error: there is none; the message names near ones.
Result<Experiment> experiment_named(std::string_view id);

/// Findings as a table: finding, kind, claim, published, ours, verdict, note.
Table table_of(std::span<const Finding> findings);

/// "published" or "check".
std::string_view kind_of(const Finding& finding);

/// "agrees", "same direction" (the claim holds, its figures do not) or "does not hold".
std::string_view verdict_of(const Finding& finding);

/// How many findings of a kind have each verdict: "20 agree, 10 have the same direction, 2 do not hold".
std::string count_of_verdicts(std::span<const Finding> findings, Finding::Kind kind);

/// The experiments of the registry, one file each; the claims are in their findings.
Result<Outcome> run_few_photons(const RunOptions& options);
Result<Outcome> run_chromaticity_clouds(const RunOptions& options);
Result<Outcome> run_frequency_of_seeing(const RunOptions& options);
Result<Outcome> run_sensor_scenarios(const RunOptions& options);
Result<Outcome> run_dark_desaturation(const RunOptions& options);
Result<Outcome> run_snr_sensitivity(const RunOptions& options);
Result<Outcome> run_mesopic_tracks(const RunOptions& options);
Result<Outcome> run_mesopic_fixed_gamma(const RunOptions& options);
Result<Outcome> run_retargeting(const RunOptions& options);

}  // namespace lowlux::isp
