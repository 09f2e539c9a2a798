#pragma once

#include <array>
#include <future>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"
#include "isp/pipeline/merge/frame_electrons.h"
#include "isp/pipeline/merge/merged_raw.h"
#include "isp/pipeline/stage_clock.h"

namespace lowlux::isp {

/// Names the time in which the work waits for files.
inline constexpr std::string_view waiting_stage = "read";

/// Reads the frames of a merge in a given order, each while the one before is processed, checks that they fit the
/// reference, and converts them to electrons.
class FrameLoader {
 public:
  FrameLoader(const FrameReader& read, Executor& executor, StageClock& clock)
      : read_(read), executor_(executor), clock_(clock) {}
  ~FrameLoader();
  FrameLoader(const FrameLoader&) = delete;
  FrameLoader& operator=(const FrameLoader&) = delete;

  /// Reads the frame that the others have to fit. Its level of saturation, or the lowest that frames of its gain showed
  /// to brightest(), is that of all frames of its gain.
  Result<FrameElectrons> read_reference(int index);
  const RawFrame& reference() const { return reference_.frame; }
  RawFrame& reference() { return reference_.frame; }
  const DevelopOptions& reference_options() const { return reference_.options; }
  const std::string& reference_name() const { return reference_.name; }
  /// Returns the name of the frame that next() returned last.
  const std::string& last_name() const { return last_name_; }

  /// States the frames that next() returns, in this order.
  void expect(std::vector<int> order);
  /// States that FrameElectrons::gain is not wanted of the frames that next() returns.
  void omit_gains() { with_gain_ = false; }
  /// Returns the next frame. Errors: those of reading and of frame_electrons; a frame that does not fit.
  Result<FrameElectrons> next();

  /// Reads all frames, and returns the index of that with the most light, of those that are not saturated in more than
  /// half of their sites; the first if none states its exposure, or all are. The levels at which frames show that the
  /// sensor saturates are kept: for each gain, the lowest one holds for the frames that show none.
  Result<int> brightest(int count);

  /// Returns the frame of the reference's gain that showed first at which level the sensor saturates, and its charges
  /// at that level, for a reference that shows none. They hold for the frames read after it.
  struct ShownSaturation {
    SaturationLevel level;
    std::array<double, 3> charge_e{};  // FrameElectrons::saturation_e
  };
  const std::optional<ShownSaturation>& shown_saturation() const { return saturation_; }
  /// Returns the lowest level of saturation that frames of the gain of the reference showed to brightest().
  std::optional<SaturationLevel> lowest_saturation() const { return lowest_saturation(reference_.frame.raw.info.iso); }

  /// Returns whether a frame that was read differed from the reference in exposure time, aperture or gain.
  bool exposures_differ() const { return exposures_differ_; }
  /// Returns the ratio of the light of the frame last read to that of the reference, by the stated exposures. Error: a
  /// frame that does not state its exposure time.
  Result<double> stated_light() const;

 private:
  void begin();
  /// Converts the frame that was read last, with the dark charge of the series.
  Result<FrameElectrons> electrons_of(const FrameToMerge& read);

  const FrameReader& read_;
  Executor& executor_;
  StageClock& clock_;
  FrameToMerge reference_;
  FrameInfo last_;  // information of the frame that was read last
  std::string last_name_;
  bool exposures_differ_ = false;
  bool with_gain_ = true;
  /// Holds the dark charge that the reference shows, or, if it shows none, the first frame of another exposure that
  /// does: one decision for all, since frames that differ by dark charge would not match.
  struct SeriesDark {
    PerSite<double> charge_e{};
    FrameInfo info;
    bool is_of_reference = false;
  };
  std::optional<SeriesDark> dark_;
  std::optional<SaturationLevel> lowest_saturation(const std::optional<double>& iso) const;
  std::optional<ShownSaturation> saturation_;  // for all frames of the ISO of the reference
  /// Holds the level of saturation that a frame shows.
  struct FrameSaturation {
    std::optional<double> iso;
    std::optional<SaturationLevel> level;
  };
  std::vector<FrameSaturation> surveyed_;  // by brightest(), each frame; empty: not called
  std::vector<int> order_;
  std::size_t position_ = 0;
  std::future<Result<FrameToMerge>> next_;
};

/// Returns the error with the name of the frame as its place, unless it has one.
Error at_frame(Error error, const std::string& name);

}  // namespace lowlux::isp
