#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/packed/raw_format.h"
#include "isp/raw/measure/thumbnail.h"
#include "isp/raw/measure/tile_noise.h"

namespace lowlux::isp {

/// Statistics of the codes of one frame's active area before any processing, for exposure and white balance of the next
/// frames. Black is included in all of them.
struct FrameStatistics {
  static constexpr int bins = 1024;
  std::array<std::uint64_t, 3> sum{};    // sums of the codes of R, G, B; for monochrome frames all three are the same
  std::array<std::uint64_t, 3> count{};  // numbers of sites in each sum
  std::uint64_t pixels = 0;
  std::uint64_t clipped = 0;  // number of codes of white or more
  std::uint64_t zero = 0;     // number of codes 0
  /// Histogram of the complete 2x2 cells of every second row of cells, by luma (77 R + 75 G1 + 75 G2 + 29 B) / 256
  /// (Rec. 601), in even bins from 0 to 2^bits.
  std::array<std::uint32_t, bins> luma{};
};

/// Selects what is measured of a frame in addition to reading its codes.
struct MeterWants {
  bool light = true;       // thumbnail
  bool noise = true;       // tiles
  bool statistics = true;  // FrameStatistics
};

/// Reads frames from a camera's memory, each row once and in order, and measures them in the same pass. All memory is
/// allocated in the constructor. Sums are integers: the result is the same for every number of threads.
class FrameMeter {
 public:
  /// @param raw  describes the frames: layout, phase, active area, white; its plane is as large as a camera's frame
  FrameMeter(const RawDn& raw, const RawFormat& format, int threads);

  /// @param bytes  rows from their first byte on, `stride` apart; large enough for raw.dn's rows
  /// @param raw    as in the constructor; its plane receives the codes
  void read(std::span<const std::byte> bytes, std::size_t stride, RawDn& raw, Executor& executor,
            const MeterWants& wants = {});

  const FrameStatistics& statistics() const { return statistics_; }  // empty where they were not requested
  const MeterWants& wanted() const { return wanted_; }               // measurements of the last frame read
  ThumbnailSums& thumbnail() { return thumbnail_; }
  TileNoise& tiles() { return tiles_; }
  const TileNoise& tiles() const { return tiles_; }
  /// Returns the mean codes of the sites (of the active area's cells) on the masked pixels; nullopt if there are none.
  std::optional<PerSite<double>> masked_dn() const;

 private:
  /// Statistics gathered by one thread.
  struct Tally {
    PerSite<std::uint64_t> masked_sum{};
    PerSite<std::uint64_t> masked_count{};
    PerSite<std::uint64_t> sum{};  // sum of the codes
    std::uint64_t clipped = 0;
    std::uint64_t zero = 0;
    std::array<std::array<std::uint32_t, FrameStatistics::bins>, 2> luma{};  // histograms of even and of odd cells
  };
  /// Sums of columns, separate for even and odd rows.
  struct Columns {
    std::array<std::vector<std::uint32_t>, 2> sum;
    std::array<std::vector<std::uint32_t>, 2> square;
    std::vector<std::uint16_t> bin;
  };
  struct Job;
  void read_rows(const Job& job, RowBand rows, int thread);
  void measure_row(const RawDn& raw, int y, const MeterWants& wants, int thread);
  void count_cells(const RawDn& raw, int y, int thread);
  void measure_block(const RawDn& raw, int y, const MeterWants& wants, int thread);
  void add_up(const RawDn& raw, int threads, const MeterWants& wants);

  RawFormat format_;
  ThumbnailSums thumbnail_;
  TileNoise tiles_;
  std::vector<Tally> tallies_;    // one per thread
  std::vector<Columns> columns_;  // one per thread
  PerSite<std::uint64_t> masked_sum_{};
  PerSite<std::uint64_t> masked_count_{};
  MeterWants wanted_;
  FrameStatistics statistics_;
};

}  // namespace lowlux::isp
