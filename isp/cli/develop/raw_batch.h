#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/x_trans/x_trans_frame.h"
#include "isp/base/camera_profile.h"
#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"
#include "isp/cli/develop/calibration_files.h"
#include "isp/cli/develop/cost_file.h"
#include "isp/cli/develop/dark_files.h"
#include "isp/cli/develop/develop_args.h"
#include "isp/cli/develop/memory_gate.h"
#include "isp/cli/noise/noise_origin.h"
#include "isp/cli/shared/noise_maps.h"
#include "isp/cli/shared/outputs.h"
#include "isp/cli/shared/progress.h"
#include "isp/cli/shared/report.h"
#include "isp/output/atomic_file.h"
#include "isp/pipeline/render/pipeline_memory.h"
#include "isp/pipeline/stage_clock.h"

/// Processes raw files one after the other, several at a time, each to its own output: `develop` and `denoise`.
namespace lowlux::cli {

/// Estimates the peak memory of the work on one frame.
using EstimateBytes = std::size_t (*)(const RawDn& raw, const isp::DevelopOptions& options, int threads);

/// Returns the raw frame of a job's input; X-Trans mosaics are shown before they are interpolated. It may be called
/// from several threads.
using ReadRaw = std::function<Result<RawFrame>(const std::string& input, const capture::XTransUse& x_trans_use)>;

/// Reads a raw file, see capture::read_raw.
Result<RawFrame> read_file(const std::string& file, const capture::XTransUse& x_trans_use);

/// Holds the data that all files have in common.
struct RawBatch {
  const DevelopArgs& args;
  isp::DevelopOptions options;
  std::vector<Job> jobs;
  std::optional<CameraProfile> profile = std::nullopt;
  std::shared_ptr<DarkSource> darks = nullptr;
  std::shared_ptr<const calib::FlatField> flat = nullptr;
  isp::Sync sync = isp::Sync::no;
  std::shared_ptr<MemoryGate> memory = nullptr;   // absent: --jobs limits the files at a time
  EstimateBytes bytes_of = isp::expected_bytes;   // for one file
  std::shared_ptr<MachineSpeed> speed = nullptr;  // set with a budget: files are then processed one by one
  std::shared_ptr<const isp::CostModel> kept_cost =
      nullptr;  // set without a budget, where decisions are printed and it is known
  ReadRaw read = read_file;
};

/// Makes the data of looks and displays, reads profile, darks and flats, and makes the output folder. Errors name their
/// file or option.
Result<RawBatch> make_batch(const DevelopArgs& args, isp::DevelopOptions options, std::vector<Job> jobs,
                            const CalibrationFiles& calibration);

/// Returns all files written for one input: the output, and its maps.
std::vector<std::string> files_of(const RawBatch& batch, const Job& job);

/// Holds a raw frame ready for processing, with its options: profile, darks, the noise of its image.
struct ReadyFrame {
  RawFrame frame;
  isp::DevelopOptions options;
  std::optional<NoiseOrigin> noise = std::nullopt;  // set by ready_frame where it is known
  double merged_exposure_ev = 0;                    // BaselineExposure that a merge adds to that of the source
};

/// Reads one file with its profile, darks and flats. Existing
/// outputs, including maps, are an error before any work is done; a job without an output writes none.
Result<ReadyFrame> read_frame(const RawBatch& batch, const Job& job, Executor& executor, isp::StageClock& clock);

/// Sets the tables of the profile in the source where they are applied: to images for viewing, without a look, with
/// the colours of the file. Tables that are not valid are left out with a warning.
void set_profile_tables(const DevelopArgs& args, ReadyFrame& ready);

/// Does read_frame, then finds the noise of the frame (find_noise) and sets the cost of the machine (set_cost).
Result<ReadyFrame> ready_frame(const RawBatch& batch, const Job& job, Executor& executor, isp::StageClock& clock);

/// Returns the options of the batch with what is predicted and allowed for a frame.
isp::DevelopOptions options_of_goal(const RawBatch& batch, const RawFrame& frame);

/// Sets the cost of the machine as it is now, where there is a budget. Errors: those of MachineSpeed::now.
Result<void> set_cost(const RawBatch& batch, isp::DevelopOptions& options, Executor& executor, isp::StageClock& clock);

/// Advances the progress bar for one file: roughly by the fraction of its time that has passed, to 1 in the end.
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

/// Fills the outcome of one job; an error without a place refers to the input file.
using RawWork = std::function<Result<void>(const Job&, Executor&, FileProgress&, DevelopOutcome&)>;

/// Does the work for every job and prints its outcome. @return the exit code
int run_batch(const RawBatch& batch, const RawWork& work);

}  // namespace lowlux::cli
