#include "isp/bench/bench_stages.h"

#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "isp/bench/stages/denoise_bench.h"
#include "isp/bench/stages/developing_stages.h"
#include "isp/bench/stages/methods_bench.h"
#include "isp/bench/stages/simulation_stages.h"

namespace lowlux::isp {
namespace {

constexpr std::array registry{
    BenchStage{"denoise", "Noise reduction on the mosaic: error against time, compared with other methods",
               run_denoise_bench},
    BenchStage{"photon-sampling", "Photon counts: samplers compared with the Poisson distribution",
               run_photon_sampling_bench},
    BenchStage{"simulation-effects", "Simulated sensor: error caused by omitted noise sources",
               run_simulation_effects_bench},
    BenchStage{"black-point", "Black level: error by the number of dark pixels", run_black_point_bench},
    BenchStage{"dark-estimate", "Dark charge estimated from the frame itself: bias, standard error, refusals",
               run_dark_estimate_bench},
    BenchStage{"noise-fit", "System gain and noise from flats and from single images", run_noise_fit_bench},
    BenchStage{"simulate", "Whole simulated files: photon sampling and effects", run_simulate_bench},
    BenchStage{"chroma-start", "First chroma level of the denoiser: error against time", run_chroma_start_bench},
    BenchStage{"demosaic", "Demosaicing: error against time", run_demosaic_bench},
    BenchStage{"scenes", "Generated scenes: error and artefacts of every level and demosaicing method",
               run_scenes_bench},
    BenchStage{"mesopic", "Mesopic vision, exact and by tables: error against time", run_mesopic_bench},
    BenchStage{"scene-light", "Rods' luminance under every lamp, with the light unknown and stated",
               run_scene_light_bench},
    BenchStage{"retarget", "Retargeting to a dim display, exact and by tables: error against time", run_retarget_bench},
    BenchStage{"develop", "Whole plans of develop: error against time", run_develop_bench},
    BenchStage{"error-sources", "Sources of the error of develop: demosaicing, noise, black level, rendering",
               run_error_sources_bench},
    BenchStage{"merge", "Merging raw frames: gain, noise and time of each method", run_merge_bench},
    BenchStage{"methods", "Noise reduction by other programs on the same raw frames: leaderboards", run_methods_bench},
    BenchStage{"scaling", "Developing by frame size and number of threads: time and memory", run_scaling_bench},
};

std::string text_of(const BenchCell& cell, int digits) {
  if (const auto* text = std::get_if<std::string>(&cell)) return *text;
  const double value = std::get<double>(cell);
  return std::isfinite(value) ? fmt::format("{:.{}g}", value, digits) : std::string();
}

}  // namespace

std::span<const BenchStage> bench_stages() { return registry; }

Result<BenchStage> bench_stage_named(std::string_view id) {
  std::string names;
  for (const BenchStage& stage : registry) {
    if (stage.id == id) return stage;
    names += (names.empty() ? "" : ", ") + std::string(stage.id);
  }
  return fail(ErrorCode::not_found, fmt::format("unknown stage '{}'; the stages are: {}", id, names));
}

Table table_of(const BenchTable& table, int digits) {
  Table out{table.columns, {}};
  out.rows.reserve(table.rows.size());
  for (const auto& row : table.rows) {
    std::vector<std::string> cells;
    cells.reserve(row.size());
    for (const BenchCell& cell : row) cells.push_back(text_of(cell, digits));
    out.rows.push_back(std::move(cells));
  }
  return out;
}

}  // namespace lowlux::isp
