#include "denoise/temporal/temporal.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include "denoise/spatial/bands.h"
#include "denoise/temporal/frame_motion.h"
#include "denoise/temporal/temporal_rows.h"
#include "denoise/temporal/temporal_thresholds.h"

namespace lowlux::denoise {
namespace {

using rows::blocks_of_strip;
using rows::motion_block;
using rows::sites_of_strip;

constexpr double largest_fraction = FrameMotion::no_content;  // relative variance of a history without value
constexpr double max_light = 1e6;                             // ratio, up or down, beyond which a history has no value
constexpr double min_moved = 0.02;  // fraction of the blocks, from which on their motion is looked for
constexpr int search_frames = 8;    // for so many frames after motion was last seen

constexpr int rounded_up(int n, int unit) { return (n + unit - 1) / unit * unit; }

/// Areas of 4 x 4 blocks that are compared with the mean as a whole. They begin at every second block.
constexpr int area_blocks = 4;
constexpr int area_step = 2;
constexpr float no_step = std::numeric_limits<float>::max();  // of an area without sites that count

/// Sums of rows::BlockSteps over blocks, of R, G, B.
struct AreaSums {
  std::array<float, 3> sum{};
  std::array<float, 3> variance{};
  std::array<float, 3> count{};

  void add(const AreaSums& other) {
    for (int c = 0; c < 3; ++c) sum[c] += other.sum[c];
    for (int c = 0; c < 3; ++c) variance[c] += other.variance[c];
    for (int c = 0; c < 3; ++c) count[c] += other.count[c];
  }
};

/// Buffers for a strip at the end of rows, which is copied in and out.
struct StripMemory {
  std::array<std::array<float, sites_of_strip>, motion_block> raw{};
  std::array<std::array<float, sites_of_strip>, motion_block> out{};
  std::array<std::array<float, sites_of_strip>, motion_block> before{};
  float sums[2][sites_of_strip]{};
  rows::BlockSteps steps{};
};

[[maybe_unused]] bool usable(const RawNoise& noise, double light, const TemporalOptions& options) {
  const auto within = [](double x, double least, double most) { return x >= least && x <= most; };
  bool good = light > 0 && std::isfinite(light) && within(options.false_alarm, 1e-6, 0.5);
  for (const double saturation : noise.saturation_e) good = good && saturation > 0;
  for (const double variance : noise.variance_e2) good = good && within(variance, 0, largest_value_e);
  for (const double dark : noise.dark_mean_e) good = good && within(dark, 0, largest_value_e);
  return good && within(options.max_frames, 2, 256);
}

/// State that is kept between frames, sized for the largest one.
struct Memory {
  Memory(int largest_width, int largest_height, int threads)
      // Rows are an odd number of cache lines: at a power of two, those that are read together would share cache sets.
      : max_width(largest_width),
        max_height(largest_height),
        mean_e(rounded_up(largest_width, sites_of_strip) + 16, rounded_up(largest_height, motion_block)),
        share(rounded_up(largest_width, sites_of_strip) / motion_block, mean_e.height() / motion_block),
        moved(share.width(), share.height()),
        steps(share.width() / area_step, share.height()),
        offset(steps.width(), rounded_up(share.height(), area_step) / area_step),
        step_of_site(share.width() / area_blocks * (rounded_up(share.height(), area_blocks) / area_blocks), 3),
        motion(largest_width, largest_height),
        next_mean_e(mean_e.width(), mean_e.height()),
        next_share(share.width(), share.height()),
        strip(static_cast<std::size_t>(threads)),
        count(static_cast<std::size_t>(threads)) {
    std::fill(mean_e.data(), mean_e.data() + mean_e.size(), 0.0f);
    std::fill(next_mean_e.data(), next_mean_e.data() + next_mean_e.size(), 0.0f);
    std::fill(share.data(), share.data() + share.size(), 1.0f);
    std::fill(next_share.data(), next_share.data() + next_share.size(), 1.0f);
  }

  void forget_motion() {
    motion.forget();
    frames_to_search = 0;
  }
  void take_next() {
    std::swap(mean_e, next_mean_e);
    std::swap(share, next_share);
  }

  int max_width;
  int max_height;
  Plane<float> mean_e;  // without dark charge
  Plane<float> share;   // variance of the mean over that of a raw value, for each block
  Plane<std::uint8_t> moved;
  Plane<AreaSums> steps;  // areas of area_step blocks side by side
  Plane<float> offset;    // of each area: mean square of its difference from the mean, over the variance of raw values
  Plane<float> step_of_site;  // of R, G, B: mean difference over its variance, of areas that do not overlap
  FrameMotion motion;
  Plane<float> next_mean_e;  // mean and shares that follow, while the previous ones are displaced
  Plane<float> next_share;
  int frames_to_search = 0;        // for motion
  std::vector<StripMemory> strip;  // one for each thread
  std::vector<long long> count;    // number of blocks that moved, for each thread
  bool empty = true;
  int width = 0;  // width of the previous frame
  int height = 0;
  BayerPhase phase = BayerPhase::rggb;
  rows::SiteNoise noise{};
};

/// State of one call of TemporalMean::run.
struct Frame {
  Memory& memory;
  const RawElectronsView& raw;
  rows::SiteNoise noise;
  double light;
  TemporalOptions options;
  bool first;
  bool displaced;  // the mean of the previous frames is, by memory.motion
  int columns = (raw.value.width + motion_block - 1) / motion_block;  // number of blocks
  int rows = (raw.value.height + motion_block - 1) / motion_block;

  Plane<float>& new_mean_e() const { return displaced ? memory.next_mean_e : memory.mean_e; }
  Plane<float>& new_share() const { return displaced ? memory.next_share : memory.share; }
  float min_weight() const { return 1 / static_cast<float>(options.max_frames); }
  std::array<const float*, motion_block> raw_rows(int x, int y, StripMemory& strip) const;
  std::array<const float*, motion_block> before_rows(int x, int y, StripMemory& strip) const;
  std::size_t colour_of(int site) const { return static_cast<std::size_t>(colour_at(raw.phase, site % 2, site / 2)); }
  double fraction_now(double share, const std::array<const float*, 2>& sums, int width, int height) const;
  void rescale(int y, StripMemory& strip) const;
  void displace(const Workers& workers, bool same) const;
  void find(int y, const MotionThresholds& at, StripMemory& strip) const;
  bool has_moved(int x, int y) const;
  AreaSums sums_of_area(int x, int y) const;
  std::array<float, 3> common_step(const Workers& workers) const;
  float offset_of_area(int x, int y, const std::array<float, 3>& common, double threshold) const;
  void add_offsets(int y) const;
  long long update(int y, PlaneView<float> out, StripMemory& strip) const;
  void put_fractions(int y, PlaneView<float> map) const;
  void take_in(const Workers& workers, PlaneView<float> out, PlaneView<float> shares) const;
};

/// Returns eight rows of a strip; the last row of the frame replaces those beyond it. A strip that extends beyond the
/// end of rows is copied.
std::array<const float*, motion_block> Frame::raw_rows(int x, int y, StripMemory& strip) const {
  const int width = std::min(sites_of_strip, raw.value.width - x);
  std::array<const float*, motion_block> out{};
  for (int r = 0; r < motion_block; ++r) {
    out[r] = raw.value.row(std::min(motion_block * y + r, raw.value.height - 1)) + x;
    if (width == sites_of_strip) continue;
    std::memcpy(strip.raw[r].data(), out[r], width * sizeof(float));
    out[r] = strip.raw[r].data();
  }
  return out;
}

/// Returns eight rows of a strip of the mean of the previous frames, which are copied where blocks are displaced
/// differently.
std::array<const float*, motion_block> Frame::before_rows(int x, int y, StripMemory& strip) const {
  std::array<const float*, motion_block> out{};
  const int left_block = x / motion_block, blocks = std::min(blocks_of_strip, columns - left_block);
  const FrameMotion::Displacement by = displaced ? memory.motion.at(left_block, y) : FrameMotion::Displacement{};
  bool as_one = x + by.x >= 0 && x + by.x + sites_of_strip <= memory.mean_e.width() && motion_block * y + by.y >= 0 &&
                motion_block * (y + 1) + by.y <= memory.mean_e.height();
  for (int b = 1; as_one && displaced && b < blocks; ++b) as_one = memory.motion.at(left_block + b, y) == by;
  for (int r = 0; r < motion_block; ++r) {
    out[r] = as_one ? memory.mean_e.row(motion_block * y + r + by.y) + x + by.x : strip.before[r].data();
  }
  for (int b = 0; !as_one && b < blocks; ++b) {
    const FrameMotion::Displacement own = memory.motion.at(left_block + b, y);
    const int left = std::clamp(x + motion_block * b + own.x, 0, memory.mean_e.width() - motion_block);
    for (int r = 0; r < motion_block; ++r) {
      const int row = std::clamp(motion_block * y + r + own.y, 0, memory.mean_e.height() - 1);
      std::copy_n(memory.mean_e.row(row) + left, motion_block, strip.before[r].data() + motion_block * b);
    }
  }
  return out;
}

/// Returns the mean's variance over that of a raw value after a change of light or noise: the ratio changes by light^2
/// times the raw value's variance before, over that now. Both come from the block's mean of each colour: a site's own
/// value would make the weights of values depend on their noise.
/// @param sums  sums of the block's columns over even and odd rows, in the light of this frame
double Frame::fraction_now(double share, const std::array<const float*, 2>& sums, int width, int height) const {
  std::array<double, 3> sum{}, count{};
  for (int y = 0; y < 2; ++y) {
    for (int x = 0; x < width; ++x) {
      const auto c = static_cast<std::size_t>(colour_at(raw.phase, x, y));
      sum[c] += static_cast<double>(sums[y][x]);
      const int rows_of_parity = (height + 1 - y) / 2;
      count[c] += rows_of_parity;
    }
  }
  double before = 0, now = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    if (count[c] == 0) continue;
    before += count[c] * variance_of(memory.noise, c, std::min(sum[c] / count[c] / light, largest_value_e));
    now += count[c] * variance_of(noise, c, sum[c] / count[c]);
  }
  return std::min(share * light * light * before / now, largest_fraction);
}

void Frame::rescale(int y, StripMemory& strip) const {
  rows::ScaleStrip in{};
  in.light = static_cast<float>(light);
  in.rows = std::min(motion_block, raw.value.height - motion_block * y);
  for (int site = 0; site < 4; ++site) in.saturation_e[site] = noise.saturation_e[colour_of(site)];
  for (int x = 0; x < columns; ++x) {
    const int left = motion_block * x, of_strip = left % sites_of_strip;
    if (of_strip == 0) {
      for (int r = 0; r < in.rows; ++r) in.mean_e[r] = memory.mean_e.row(motion_block * y + r) + left;
      rows::scale_mean(in, strip.sums);
    }
    float& share = memory.share.at(x, y);
    share = static_cast<float>(fraction_now(static_cast<double>(share),
                                            {strip.sums[0] + of_strip, strip.sums[1] + of_strip},
                                            std::min(motion_block, raw.value.width - left), in.rows));
  }
}

void Frame::find(int y, const MotionThresholds& at, StripMemory& strip) const {
  rows::MotionStrip in{};
  in.red_is_odd = red_column(raw.phase) == 1;
  in.min_weight = min_weight();
  in.noise = noise;
  in.alone = {static_cast<float>(at.alone.z), static_cast<float>(at.alone.few)};
  in.beside = {static_cast<float>(at.beside.z), static_cast<float>(at.beside.few)};
  for (int x = 0; x < columns; x += blocks_of_strip) {
    const int left = motion_block * x;
    const auto raw_row = raw_rows(left, y, strip);
    const auto before = before_rows(left, y, strip);
    for (int r = 0; r < motion_block; ++r) {
      const int source = r ^ red_row(raw.phase);  // the row with red first
      in.raw[r] = raw_row[source];
      in.mean_e[r] = before[source];
      in.inside[r] = motion_block * y + source < raw.value.height;
    }
    in.width = std::min(sites_of_strip, raw.value.width - left);
    in.share = new_share().row(y) + x;
    std::uint8_t* const moved = memory.moved.row(y) + x;
    rows::BlockSteps& steps = strip.steps;
    rows::find_motion(in, moved, steps);
    for (int b = 0; b < blocks_of_strip; b += area_step) {
      AreaSums& out = memory.steps.at((x + b) / area_step, y);
      for (int c = 0; c < 3; ++c) {
        out.sum[c] = steps.sum[c][b] + steps.sum[c][b + 1];
        out.variance[c] = steps.variance[c][b] + steps.variance[c][b + 1];
        out.count[c] = steps.count[c][b] + steps.count[c][b + 1];
      }
    }
    // Blocks without content start anew, and say nothing of their neighbours.
    for (int b = 0; displaced && b < blocks_of_strip; ++b) {
      if (in.share[b] >= FrameMotion::no_content) moved[b] = 0;
    }
  }
}

/// @param x, y  of the area, in steps
AreaSums Frame::sums_of_area(int x, int y) const {
  const int left = area_step * x, top = area_step * y;
  const int right = std::min(left + area_blocks, columns), bottom = std::min(top + area_blocks, rows);
  AreaSums all;
  for (int v = top; v < bottom; ++v) {
    for (int u = x; area_step * u < right; ++u) all.add(memory.steps.at(u, v));
  }
  return all;
}

/// Returns for R, G, B by how much the frame as a whole differs from the mean, over the variance, at a site: the median
/// over areas, which parts that move hardly change.
std::array<float, 3> Frame::common_step(const Workers& workers) const {
  constexpr int steps = area_blocks / area_step;
  const int across = rounded_up(columns, area_blocks) / area_blocks, down = rounded_up(rows, area_blocks) / area_blocks;
  in_bands(workers, down, [&](int top, int bottom, int) {
    for (int y = top; y < bottom; ++y) {
      for (int x = 0; x < across; ++x) {
        const AreaSums all = sums_of_area(steps * x, steps * y);
        for (int c = 0; c < 3; ++c) {
          const bool any = all.variance[c] > 0;
          memory.step_of_site.at(across * y + x, c) = any ? all.sum[c] / all.count[c] : no_step;
        }
      }
    }
  });
  std::array<float, 3> out{};
  in_bands(workers, 3, [&](int first_colour, int end, int) {
    for (int c = first_colour; c < end; ++c) {
      float* const first_step = memory.step_of_site.row(c);
      float* const last_step = std::remove(first_step, first_step + across * down, no_step);
      if (first_step == last_step) continue;
      float* const middle = first_step + (last_step - first_step) / 2;
      std::nth_element(first_step, middle, last_step);
      out[c] = *middle;
    }
  });
  return out;
}

/// Returns the mean square by which an area differs from the mean, over the variance of raw values; 0 where noise
/// explains it.
/// @param x, y  of the area, in steps
/// @param common  difference of the frame as a whole, from common_step()
float Frame::offset_of_area(int x, int y, const std::array<float, 3>& common, double threshold) const {
  const AreaSums all = sums_of_area(x, y);
  double step = 0, colours = 0, count = 0;
  for (int c = 0; c < 3; ++c) {
    if (all.variance[c] <= 0) continue;
    const auto n = static_cast<double>(all.count[c]);
    const double sum = static_cast<double>(all.sum[c]) - n * static_cast<double>(common[c]);
    step += sum * sum / static_cast<double>(all.variance[c]);
    colours += 1;
    count += n;
  }
  return step > threshold ? static_cast<float>((step - colours) / count) : 0.0f;
}

/// Adds to the mean's variance ratios of a row of blocks the largest offset of the areas that have the block. Blocks
/// that started anew are 1, and stay so: they have nothing of the mean that differed.
void Frame::add_offsets(int y) const {
  const int area_y = y / area_step;
  for (int x = 0; x < columns; ++x) {
    const int area_x = x / area_step;
    float offset = 0;
    for (int v = std::max(area_y - 1, 0); v <= area_y; ++v) {
      for (int u = std::max(area_x - 1, 0); u <= area_x; ++u) offset = std::max(offset, memory.offset.at(u, v));
    }
    float& share = new_share().at(x, y);
    if (share < 1) share = std::min(share + offset, FrameMotion::no_content);
  }
}

/// Returns whether a block moved by itself, or at the lower threshold next to one that did.
bool Frame::has_moved(int x, int y) const {
  const auto level = [this](int u, int v) { return static_cast<int>(memory.moved.at(u, v)); };
  if (level(x, y) != 1) return level(x, y) == 2;
  for (int v = std::max(y - 1, 0); v <= std::min(y + 1, rows - 1); ++v) {
    for (int u = std::max(x - 1, 0); u <= std::min(x + 1, columns - 1); ++u) {
      if (level(u, v) == 2) return true;
    }
  }
  return false;
}

/// Adds a row of blocks to the mean.
/// @return the number of blocks that moved
long long Frame::update(int y, PlaneView<float> out, StripMemory& strip) const {
  rows::UpdateStrip in{};
  in.rows = std::min(motion_block, raw.value.height - motion_block * y);
  for (int site = 0; site < 4; ++site) {
    in.dark_e[site] = noise.dark_e[colour_of(site)];
    in.saturation_e[site] = noise.saturation_e[colour_of(site)];
  }
  long long moved = 0;
  for (int x = 0; x < columns; x += blocks_of_strip) {
    const int left = motion_block * x, width = std::min(sites_of_strip, raw.value.width - left);
    std::array<float, blocks_of_strip> weight{};
    for (int b = 0; b < std::min(blocks_of_strip, columns - x); ++b) {
      float& share = new_share().at(x + b, y);
      const bool starts = first || (displaced && share >= FrameMotion::no_content) || has_moved(x + b, y);
      const float k = starts ? 1.0f : std::max(share / (1 + share), min_weight());
      share = starts ? 1.0f : (1 - k) * (1 - k) * share + k * k;
      weight[b] = k;
      moved += starts ? 1 : 0;
    }
    in.weight = weight.data();
    const auto raw_row = raw_rows(left, y, strip);
    const auto before = before_rows(left, y, strip);
    for (int r = 0; r < in.rows; ++r) {
      in.raw[r] = raw_row[r];
      in.before_e[r] = before[r];
      in.mean_e[r] = new_mean_e().row(motion_block * y + r) + left;
      in.out[r] = width == sites_of_strip ? out.row(motion_block * y + r) + left : strip.out[r].data();
    }
    rows::update_mean(in);
    if (width == sites_of_strip) continue;
    for (int r = 0; r < in.rows; ++r) {
      std::memcpy(out.row(motion_block * y + r) + left, strip.out[r].data(), width * sizeof(float));
    }
  }
  return moved;
}

/// Writes the variance ratios of a row of blocks, for each cell.
void Frame::put_fractions(int y, PlaneView<float> map) const {
  constexpr int cells = motion_block / 2;
  for (int v = cells * y; v < std::min(cells * (y + 1), map.height); ++v) {
    for (int u = 0; u < map.width; ++u) map.at(u, v) = new_share().at(u / cells, y);
  }
}

/// Scales the mean to the light of this frame, and finds where it is displaced.
/// @param same  light and noise are as before
void Frame::displace(const Workers& workers, bool same) const {
  if (!same) {
    in_bands(workers, rows, [&](int top, int bottom, int thread) {
      for (int y = top; y < bottom; ++y) rescale(y, memory.strip[thread]);
    });
  }
  const FrameMotion::Before before{std::as_const(memory.mean_e).view(), std::as_const(memory.share).view()};
  memory.motion.find(raw, noise, before, memory.next_share.view().crop(0, 0, columns, rows), workers);
}

/// Adds the frame to the mean, and counts blocks that moved in memory.count. Offsets of areas are added for the next
/// frame, because the rows below would otherwise have to be compared first.
void Frame::take_in(const Workers& workers, PlaneView<float> out, PlaneView<float> shares) const {
  const bool same = light == 1 && noise == memory.noise;
  if (displaced) displace(workers, same);
  const MotionThresholds at = motion_thresholds(options.false_alarm);
  const auto compare = [&](int y, StripMemory& strip) {
    if (!same && !displaced) rescale(y, strip);
    find(y, at, strip);
  };
  // Compare the ends of each thread's rows first, as neighbours need them. The other rows follow while in the cache.
  if (!first) {
    in_bands(workers, rows, [&](int top, int bottom, int thread) {
      compare(top, memory.strip[thread]);
      if (bottom - 1 > top) compare(bottom - 1, memory.strip[thread]);
    });
  }
  std::fill(memory.count.begin(), memory.count.end(), 0);
  in_bands(workers, rows, [&](int top, int bottom, int thread) {
    StripMemory& strip = memory.strip[thread];
    for (int y = top; y < bottom; ++y) {
      if (!first && y + 1 < bottom - 1) compare(y + 1, strip);
      memory.count[thread] += update(y, out, strip);
      if (shares.data != nullptr) put_fractions(y, shares);
    }
  });
  if (first) return;
  const double threshold = chi3_threshold(at.alone);
  const std::array<float, 3> common = common_step(workers);
  in_bands(workers, (rows + area_step - 1) / area_step, [&](int top, int bottom, int) {
    for (int y = top; y < bottom; ++y) {
      for (int x = 0; x < (columns + area_step - 1) / area_step; ++x) {
        memory.offset.at(x, y) = offset_of_area(x, y, common, threshold);
      }
    }
  });
  in_bands(workers, rows, [&](int top, int bottom, int) {
    for (int y = top; y < bottom; ++y) add_offsets(y);
  });
}

}  // namespace

struct TemporalMean::State {
  Memory memory;
};

TemporalMean::TemporalMean(int max_width, int max_height, int threads) {
  assert(max_width >= 2 && max_height >= 2 && threads >= 1);
  assert(max_width <= largest_side && max_height <= largest_side);
  state_ = std::make_unique<State>(State{Memory(max_width, max_height, threads)});
}
TemporalMean::~TemporalMean() = default;

void TemporalMean::reset() { state_->memory.empty = true; }

double TemporalMean::run(const RawElectronsView& raw, const RawNoise& noise, double light,
                         const TemporalOptions& options, PlaneView<float> mean_e, PlaneView<float> variance_fraction,
                         Executor& executor) {
  Memory& memory = state_->memory;
  assert(raw.value.width >= 2 && raw.value.height >= 2);
  assert(raw.value.width <= memory.max_width && raw.value.height <= memory.max_height);
  assert(mean_e.width == raw.value.width && mean_e.height == raw.value.height);
  assert(usable(noise, light, options) && raw.noise_ratio.is_one());
  const bool known = memory.width == raw.value.width && memory.height == raw.value.height && memory.phase == raw.phase;
  const bool worthless = light > max_light || light < 1 / max_light;
  const bool first = memory.empty || !known || worthless;
  if (first) memory.forget_motion();
  const bool displaced = options.compensate_motion && memory.frames_to_search > 0 &&
                         std::min(raw.value.width, raw.value.height) >= FrameMotion::min_side;
  const Frame frame{memory, raw, site_noise(noise, raw.phase), light, options, first, displaced};
  frame.take_in({executor, static_cast<int>(memory.strip.size())}, mean_e, variance_fraction);
  memory.empty = false;
  memory.width = raw.value.width;
  memory.height = raw.value.height;
  memory.phase = raw.phase;
  memory.noise = frame.noise;
  const long long blocks = std::accumulate(memory.count.begin(), memory.count.end(), 0LL);
  const double moved = static_cast<double>(blocks) / (static_cast<double>(frame.columns) * frame.rows);
  if (displaced) memory.take_next();
  const bool motion = moved > std::max(min_moved, 4 * options.false_alarm) || (displaced && memory.motion.found());
  memory.frames_to_search = first ? 0 : motion ? search_frames : std::max(memory.frames_to_search - 1, 0);
  return moved;
}

}  // namespace lowlux::denoise
