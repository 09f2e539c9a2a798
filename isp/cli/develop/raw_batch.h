#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "isp/base/camera_profile.h"
#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"
#include "isp/cli/develop/cost_file.h"
#include "isp/cli/develop/dark_files.h"
#include "isp/cli/develop/develop_args.h"
#include "isp/cli/develop/memory_gate.h"
#include "isp/cli/shared/noise_maps.h"
#include "isp/cli/shared/outputs.h"
#include "isp/cli/shared/progress.h"
#include "isp/cli/shared/report.h"
#include "isp/output/atomic_file.h"
#include "isp/pipeline/render/pipeline_memory.h"
#include "isp/pipeline/stage_clock.h"

/// Raw files one after the other, several at a time, each to a file of its own: `develop` and `denoise`.
namespace lowlux::cli {

/// About the most memory that the work on one frame takes.
using EstimateBytes = std::size_t (*)(const RawDn& raw, const isp::DevelopOptions& options, int threads);

/// What all files share.
struct RawBatch {
  const DevelopArgs& args;
  isp::DevelopOptions options;
  std::vector<Job> jobs;
  std::optional<CameraProfile> profile = std::nullopt;
  std::shared_ptr<DarkSource> darks = nullptr;
  isp::Sync sync = isp::Sync::no;
  std::shared_ptr<MemoryGate> memory = nullptr;   // absent: --jobs says how many files at a time
  EstimateBytes bytes_of = isp::expected_bytes;   // of one file
  std::shared_ptr<MachineSpeed> speed = nullptr;  // with a budget: files then come one after the other
  std::shared_ptr<const isp::CostModel> kept_cost =
      nullptr;  // without one, where decisions are printed and it is known
};

/// Reads profile and darks and makes the output folder. Errors name their file.
Result<RawBatch> make_batch(const DevelopArgs& args, const isp::DevelopOptions& options, std::vector<Job> jobs,
                            const std::vector<std::string>& darks);

/// All that is written for one file: the output, and its maps.
std::vector<std::string> files_of(const RawBatch& batch, const Job& job);

/// A raw file ready to be worked on, with what holds for it: profile, darks, the noise of its picture.
struct ReadyFrame {
  RawFrame frame;
  isp::DevelopOptions options;
};

/// Reads one file. Existing outputs, maps' too, are an error before any work is done.
Result<ReadyFrame> ready_frame(const RawBatch& batch, const Job& job, Executor& executor, isp::StageClock& clock);

/// Writes the maps beside the output; nothing if there are none.
Result<void> write_noise_maps(const RawBatch& batch, const Job& job, isp::NoiseMaps maps, const RawDn& raw,
                              Executor& executor);

/// One file's part of the progress bar: roughly how much of its time is over, all of it in the end.
class FileProgress {
 public:
  FileProgress(Progress& whole, const std::string& file) : whole_(whole), file_(file) {}
  ~FileProgress() { reach(1); }
  FileProgress(const FileProgress&) = delete;
  FileProgress& operator=(const FileProgress&) = delete;
  void reach(double share);

 private:
  Progress& whole_;
  const std::string& file_;
  double reached_ = 0;
};

/// Fills the outcome of one job; an error without a place is the input file's.
using RawWork = std::function<Result<void>(const Job&, Executor&, FileProgress&, DevelopOutcome&)>;

/// Does the work for every job and prints what became of it. @return the exit code
int run_batch(const RawBatch& batch, const RawWork& work);

}  // namespace lowlux::cli
