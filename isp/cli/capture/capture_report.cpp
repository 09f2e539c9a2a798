#include "isp/cli/capture/capture_report.h"

#include <unistd.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "isp/base/json_text.h"
#include "isp/base/packed/raw_format.h"
#include "isp/cli/shared/lines.h"

namespace lowlux::cli {
namespace {

using Json = nlohmann::ordered_json;

double ms_for_each(double seconds, std::uint64_t frames) {
  return frames == 0 ? 0 : 1000 * seconds / static_cast<double>(frames);
}

/// Returns the frames received per second, including skipped and damaged ones; the first one starts the clock.
std::optional<double> rate_hz(const capture::LoopCount& count) {
  const std::uint64_t came = count.taken + count.skipped + count.damaged;
  if (came < 2 || count.seconds <= 0) return std::nullopt;
  return static_cast<double>(came - 1) / count.seconds;
}

constexpr std::array step_names{"all", "standard", "draft", "frames_before", "plain"};  // LOWLUX_STAGE_STEP_...

/// Returns "; all 28, draft 2" for a budget.
std::string step_text(const CaptureWork& work) {
  std::string out;
  if (!work.steps) return out;
  for (std::size_t i = 0; i < step_names.size(); ++i) {
    const std::uint64_t frames = (*work.steps)[i];
    if (frames > 0) out += fmt::format("{} {} {}", out.empty() ? ";" : ",", step_names[i], frames);
  }
  return out;
}

/// Returns "; exposure 0.04 s, gain 8" for automatic exposure.
std::string exposure_state_text(const std::optional<ExposureState>& exposure) {
  if (!exposure) return "";
  const std::string gain = exposure->gain ? fmt::format(", gain {:.3g}", *exposure->gain) : "";
  return fmt::format("; exposure {:.4g} s{}", exposure->exposure_s, gain);
}

Json exposure_json(const ExposureState& exposure) {
  static constexpr const char* limits[] = {"time", "converter range", "full well"};
  return {{"exposure_s", exposure.exposure_s}, {"analogue_gain", exposure.gain ? Json(*exposure.gain) : Json(nullptr)},
          {"snr_db", exposure.snr_db},         {"limit", limits[static_cast<int>(exposure.limit)]},
          {"highlight_clips", exposure.clips}, {"changes", exposure.changes}};
}

}  // namespace

std::string progress_text(const CaptureState& state) {
  const capture::LoopCount& count = state.count;
  const auto rate = rate_hz(count);
  return fmt::format("{}{} frames, {} lost, {} damaged; ms for each: wait {:.1f}, process {:.1f}, write {:.1f}{}{}",
                     rate ? fmt::format("{:.1f} frames/s, ", *rate) : std::string(), count.taken, count.lost,
                     count.damaged, ms_for_each(count.wait_s, count.taken),
                     ms_for_each(state.work.process_s, count.taken), ms_for_each(state.work.write_s, count.taken),
                     step_text(state.work), exposure_state_text(state.exposure));
}

std::string capture_json(const CaptureState& state, const Error* error) {
  const auto& [stream, count, work, exposure] = state;
  Json json;
  if (error != nullptr) json["file"] = "";  // there is no input file
  json["ok"] = error == nullptr;
  if (error != nullptr) {
    json["error"] = error->message;
    json["where"] = error->where;
  }
  const auto& rate = stream.format.frame_rate_hz;
  const auto measured = rate_hz(count);
  json["camera"] = stream.camera;
  json["format"] = text_of(stream.format.raw);
  json["width"] = stream.format.width;
  json["height"] = stream.format.height;
  json["frame_rate_hz"] = rate ? Json(*rate) : Json(nullptr);
  json["measured_rate_hz"] = measured ? Json(*measured) : Json(nullptr);
  json["frames"] = count.taken;
  json["skipped"] = count.skipped;
  json["lost"] = count.lost;
  json["damaged"] = count.damaged;
  json["stopped"] = count.stopped;
  json["seconds"] = count.seconds;
  json["frame_ms"] = {{"wait", ms_for_each(count.wait_s, count.taken)},
                      {"process", ms_for_each(work.process_s, count.taken)},
                      {"write", ms_for_each(work.write_s, count.taken)}};
  if (work.steps) {
    for (std::size_t i = 0; i < step_names.size(); ++i) json["steps"][step_names[i]] = (*work.steps)[i];
  }
  if (exposure) json["auto_exposure"] = exposure_json(*exposure);
  json["files"] = work.files;
  json["warnings"] = work.warnings;
  return json_text(json, 2);
}

CaptureProgress::CaptureProgress(bool wanted) : wanted_(wanted && ::isatty(STDERR_FILENO) == 1) {}

CaptureProgress::~CaptureProgress() { clear(); }

void CaptureProgress::show(const CaptureState& state) {
  const auto now = std::chrono::steady_clock::now();
  if (!wanted_ || now < next_) return;
  next_ = now + std::chrono::seconds(1);
  print_err(fmt::format("\r\033[K{}", progress_text(state)));
  std::fflush(stderr);
  shown_ = true;
}

void CaptureProgress::clear() {
  if (!shown_) return;
  print_err("\r\033[K");
  std::fflush(stderr);
  shown_ = false;
}

}  // namespace lowlux::cli
