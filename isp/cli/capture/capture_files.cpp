#include <algorithm>
#include <optional>
#include <utility>

#include "capture/camera/camera_frame.h"
#include "isp/base/camera_profile.h"
#include "isp/cli/capture/capture_sink.h"
#include "isp/cli/noise/noise_source.h"
#include "isp/cli/shared/exit_code.h"
#include "isp/cli/shared/machine.h"
#include "isp/cli/shared/outputs.h"
#include "isp/cli/shared/picture_options.h"
#include "isp/cli/shared/profile_option.h"
#include "isp/output/dng/dng_writer.h"
#include "isp/output/picture/image_writer.h"
#include "isp/pipeline/plan/plan_develop.h"
#include "isp/pipeline/render/pipeline.h"
#include "isp/pipeline/stage_clock.h"

namespace lowlux::cli {
namespace {

class PictureSink final : public CaptureSink {
 public:
  PictureSink(const CaptureArgs& args, CaptureStream stream, isp::DevelopOptions options,
              std::optional<CameraProfile> profile, Executor& executor)
      : args_(args),
        stream_(std::move(stream)),
        options_(std::move(options)),
        profile_(std::move(profile)),
        executor_(executor),
        pipeline_(executor) {}

  Result<bool> take(const capture::CameraFrame& frame, CaptureWork& work) override {
    std::vector<isp::StageTime> times;
    isp::StageClock clock(times);
    Result<Picture> picture = developed(frame, work);
    if (!picture) return tl::make_unexpected(picture.error());
    clock.lap("process");
    const std::string file = frame_file(args_, work.files.size() + 1);
    const auto written =
        isp::write_picture(*picture, options_.space, info_, file, write_options(args_.develop), executor_);
    if (!written) return tl::make_unexpected(with_file(written.error(), file));
    clock.lap("write");
    work.process_s += times[0].seconds;
    work.write_s += times[1].seconds;
    work.files.push_back(file);
    return true;
  }

 private:
  Result<Picture> developed(const capture::CameraFrame& camera_frame, CaptureWork& work) {
    RawFrame frame = capture::raw_frame_of(camera_frame, stream_.format, stream_.camera);
    isp::DevelopOptions options = options_;
    options.effects = args_.develop.effects.effects;
    if (profile_) {
      const bool everything = !args_.develop.profile.empty();
      const ProfileChoice choice{.everything = everything, .gain_setting = args_.develop.gain_setting};
      if (const auto used = use_profile(*profile_, choice, frame, options); !used) {
        return tl::make_unexpected(
            with_file(used.error(), everything ? args_.develop.profile : args_.develop.black_profile));
      }
      if (everything && !profile_->colours.empty()) std::erase(frame.warnings, capture::colours_unknown);
    }
    if (const auto found = find_noise(options, args_.develop.noise, frame, executor_); !found)
      return tl::make_unexpected(found.error());
    auto plan = isp::plan_develop(frame, options, executor_);
    if (!plan) return tl::make_unexpected(plan.error());
    for (std::string& warning : plan->warnings) warn_once(std::move(warning), work);
    Picture picture = isp::make_picture(*plan);
    pipeline_.render(frame, *plan, picture);
    info_ = std::move(frame.raw.info);
    return picture;
  }

  const CaptureArgs& args_;
  CaptureStream stream_;
  isp::DevelopOptions options_;
  std::optional<CameraProfile> profile_;
  Executor& executor_;
  isp::Pipeline pipeline_;
  FrameInfo info_;  // info of the last frame developed
};

class RawSink final : public CaptureSink {
 public:
  RawSink(const CaptureArgs& args, CaptureStream stream) : args_(args), stream_(std::move(stream)) {}

  Result<bool> take(const capture::CameraFrame& frame, CaptureWork& work) override {
    std::vector<isp::StageTime> times;
    isp::StageClock clock(times);
    RawFrame raw = capture::raw_frame_of(frame, stream_.format, stream_.camera);
    const isp::BlackRequest& black = args_.develop.options.black;
    if (black.choice == isp::BlackChoice::given) {
      raw.raw.black_tag = BlackLevel{.rows = 2, .columns = 2};
      raw.raw.black_tag->pattern_dn.assign(black.given_dn.begin(), black.given_dn.end());
    }
    for (std::string& warning : raw.warnings) warn_once(std::move(warning), work);
    clock.lap("process");
    const std::string file = frame_file(args_, work.files.size() + 1);
    const isp::DngWriteOptions options{args_.develop.force ? isp::Overwrite::yes : isp::Overwrite::no,
                                       "lowlux " + version_number()};
    if (auto written = isp::write_dng(raw, file, options); !written) {
      return tl::make_unexpected(with_file(written.error(), file));
    }
    clock.lap("write");
    work.process_s += times[0].seconds;
    work.write_s += times[1].seconds;
    work.files.push_back(file);
    return true;
  }

 private:
  const CaptureArgs& args_;
  CaptureStream stream_;
};

}  // namespace

void warn_once(std::string warning, CaptureWork& work) {
  if (std::ranges::find(work.warnings, warning) == work.warnings.end()) work.warnings.push_back(std::move(warning));
}

Result<std::unique_ptr<CaptureSink>> make_picture_sink(const CaptureArgs& args, const CaptureStream& stream,
                                                       Executor& executor) {
  const DevelopArgs& develop = args.develop;
  const auto format = isp::format_of(frame_file(args, 1));
  if (!format) return tl::make_unexpected(format.error());
  auto options = complete_options(develop, *format);
  if (!options) return tl::make_unexpected(options.error());
  if (const auto made = make_for_display(develop, *options); !made) return tl::make_unexpected(made.error());
  std::optional<CameraProfile> profile;
  if (const std::string& file = develop.profile.empty() ? develop.black_profile : develop.profile; !file.empty()) {
    auto read = read_profile(file);
    if (!read) return tl::make_unexpected(with_file(read.error(), file));
    profile = *std::move(read);
  }
  return std::make_unique<PictureSink>(args, stream, *std::move(options), std::move(profile), executor);
}

std::unique_ptr<CaptureSink> make_raw_sink(const CaptureArgs& args, const CaptureStream& stream) {
  return std::make_unique<RawSink>(args, stream);
}

}  // namespace lowlux::cli
