#include "tests/reference/temporal_ref.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

namespace lowlux::reference {
namespace {

constexpr int side = 8;

double usable(float e) { return std::isnan(e) ? 0 : std::clamp(static_cast<double>(e), -1e9, 1e9); }

bool above(double x, double mean, double variance, double z, double few) {
  if (mean <= 0) return false;
  const double by_shape = variance / (mean * mean);
  return x > few * mean * std::pow(std::max(0.0, 1 - by_shape / 9 + z / 3 * std::sqrt(by_shape)), 3);
}

}  // namespace

/// Holds a frame and its noise by colour.
struct TemporalMean::Now {
  const denoise::RawElectronsView& raw;
  const denoise::RawNoise& noise;
  double min_weight;

  std::size_t colour(int x, int y) const { return static_cast<std::size_t>(colour_at(raw.phase, x, y)); }
  static double dark_e(const denoise::RawNoise& of, BayerPhase phase, std::size_t colour) {
    double sum = 0, count = 0;
    for (int site = 0; site < 4; ++site) {
      if (static_cast<std::size_t>(colour_at(phase, site % 2, site / 2)) != colour) continue;
      sum += of.dark_mean_e[site];
      count += 1;
    }
    return sum / count;
  }
  static double variance(const denoise::RawNoise& of, BayerPhase phase, std::size_t colour, double signal_e) {
    const double dark = dark_e(of, phase, colour), read = of.variance_e2[colour];
    return std::max(signal_e + dark + read, 0.5 * read + 0.3 * dark + 0.02);
  }
  double dark_e(std::size_t colour) const { return dark_e(noise, raw.phase, colour); }
  double variance(std::size_t colour, double signal_e) const { return variance(noise, raw.phase, colour, signal_e); }
  double max_e(std::size_t colour) const { return std::min(noise.saturation_e[colour], 1e9) - dark_e(colour); }
  double value_e(int x, int y) const { return usable(raw.value.at(x, y)) - dark_e(colour(x, y)); }
  template <class Work>
  void each_site(int x, int y, int size, const Work& work) const {
    for (int v = y; v < std::min(y + size, raw.value.height); ++v) {
      for (int u = x; u < std::min(x + size, raw.value.width); ++u) work(u, v, colour(u, v));
    }
  }
};

void TemporalMean::rescale(const Now& now, double light, int x, int y) {
  std::array<double, 3> sum{}, count{};
  now.each_site(side * x, side * y, side, [&](int u, int v, std::size_t c) {
    double& mean = signal_e_.at(u, v);
    mean = std::min(std::clamp(light * mean, -1e9, 1e9), now.max_e(c));
    sum[c] += mean;
    count[c] += 1;
  });
  double before = 0, after = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    if (count[c] == 0) continue;
    before += count[c] * Now::variance(noise_, phase_, c, std::min(sum[c] / count[c] / light, 1e9));
    after += count[c] * now.variance(c, sum[c] / count[c]);
  }
  double& share = blocks_.at(x, y).share;
  share = std::min(share * light * light * before / after, 1e6);
}

int TemporalMean::level_of(const Now& now, int x, int y, const denoise::MotionThresholds& at) {
  const double s = blocks_.at(x, y).share, weight = std::max(s / (1 + s), now.min_weight), fresh = s / (1 + s);
  double squares = 0, bias = 0, steady = 0, poisson = 0, sites = 0;
  std::array<double, 3> change{}, weights{}, electrons{}, count{};
  for (int group = 0; group < 4; ++group) {
    std::array<double, 3> of_squares{}, of_change{}, of_mean{}, n{};
    now.each_site(side * x + 4 * (group % 2), side * y + 4 * (group / 2), 4, [&](int u, int v, std::size_t c) {
      const double most = now.max_e(c), value = std::min(now.value_e(u, v), most), mean = signal_e_.at(u, v);
      if (std::min(value, mean) >= most) return;
      of_squares[c] += std::pow(value - mean, 2);
      of_change[c] += value - mean;
      of_mean[c] += mean + weight * (value - mean);
      n[c] += 1;
    });
    for (std::size_t c = 0; c < 3; ++c) {
      if (n[c] == 0) continue;
      const double variance = now.variance(c, of_mean[c] / n[c]), read = now.noise.variance_e2[c];
      squares += of_squares[c] / variance;
      bias += read / (variance * variance);
      steady += n[c] * read / (variance * variance);
      change[c] += of_change[c] / variance;
      weights[c] += n[c] / variance;
      electrons[c] += std::max(0.0, n[c] * (variance - read) / (variance * variance));
      count[c] += n[c];
    }
  }
  double step = 0, colours = 0, excess = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    if (count[c] == 0) continue;
    step += change[c] * change[c] / weights[c] / (1 + s);
    excess += electrons[c] / (count[c] * count[c]) * (1 - s + s * s) / (1 + s);
    poisson += electrons[c];
    sites += count[c];
    colours += 1;
  }
  const double spread = squares / (1 + s) - step, free = sites - colours;
  const double mean = free > 0 ? free + fresh * bias : 0;
  const double variance = 2 * free + (1 - s) * (1 - s) / (1 + s) * poisson + fresh * steady;
  const auto moved = [&](const denoise::MotionThreshold& t) {
    return above(spread, mean, variance, t.z, 1) || above(step, colours, 2 * colours + excess, t.z, t.few);
  };
  Block& block = blocks_.at(x, y);
  block.step.fill(0), block.step_variance.fill(0), block.sites.fill(0);
  if (moved(at.alone)) return 2;
  for (std::size_t c = 0; c < 3; ++c) {
    block.step[c] = change[c] / (1 + s), block.step_variance[c] = weights[c] / (1 + s),
    block.sites[c] = count[c] / (1 + s);
  }
  return moved(at.beside) ? 1 : 0;
}

/// Adds to the shares what areas of 4 x 4 blocks, at every second block, differ by from the frame as a whole.
void TemporalMean::add_offsets(const denoise::MotionThreshold& at) {
  const int columns = blocks_.width(), rows = blocks_.height();
  const auto each_block = [&](int left, int top, const auto& work) {
    for (int y = top; y < std::min(top + 4, rows); ++y) {
      for (int x = left; x < std::min(left + 4, columns); ++x) work(x, y);
    }
  };
  struct Sums {
    std::array<double, 3> step{}, variance{}, sites{};
  };
  const auto sums_of = [&](int left, int top) {
    Sums out;
    each_block(left, top, [&](int x, int y) {
      const Block& block = blocks_.at(x, y);
      for (std::size_t c = 0; c < 3; ++c) {
        out.step[c] += block.step[c], out.variance[c] += block.step_variance[c], out.sites[c] += block.sites[c];
      }
    });
    return out;
  };
  std::array<std::vector<double>, 3> of_areas;
  for (int top = 0; top < rows; top += 4) {
    for (int left = 0; left < columns; left += 4) {
      const Sums area = sums_of(left, top);
      for (std::size_t c = 0; c < 3; ++c) {
        if (area.sites[c] > 0) of_areas[c].push_back(area.step[c] / area.sites[c]);
      }
    }
  }
  std::array<double, 3> common{};
  for (std::size_t c = 0; c < 3; ++c) {
    std::sort(of_areas[c].begin(), of_areas[c].end());
    if (!of_areas[c].empty()) common[c] = of_areas[c][of_areas[c].size() / 2];
  }
  Plane<double> offset(columns, rows);
  std::fill(offset.data(), offset.data() + offset.size(), 0.0);
  for (int top = 0; top < rows; top += 2) {
    for (int left = 0; left < columns; left += 2) {
      const Sums area = sums_of(left, top);
      double step = 0, colours = 0, sites = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        if (area.sites[c] == 0) continue;
        step += std::pow(area.step[c] - area.sites[c] * common[c], 2) / area.variance[c];
        colours += 1;
        sites += area.sites[c];
      }
      if (!above(step, 3, 6, at.z, at.few)) continue;
      each_block(left, top,
                 [&](int x, int y) { offset.at(x, y) = std::max(offset.at(x, y), (step - colours) / sites); });
    }
  }
  for (std::size_t i = 0; i < offset.size(); ++i) {
    Block& block = blocks_.data()[i];
    if (block.share < 1) block.share = std::min(block.share + offset.data()[i], 1e6);
  }
}

bool TemporalMean::has_moved(int x, int y) const {
  bool beside = false;
  for (int v = std::max(y - 1, 0); v <= std::min(y + 1, blocks_.height() - 1); ++v) {
    for (int u = std::max(x - 1, 0); u <= std::min(x + 1, blocks_.width() - 1); ++u) {
      beside = beside || blocks_.at(u, v).level == 2;
    }
  }
  const int own = blocks_.at(x, y).level;
  return own == 2 || (own == 1 && beside);
}

/// Moves the mean to where the frame has its content.
void TemporalMean::displace(const Now& now) {
  const int width = signal_e_.width(), height = signal_e_.height();
  Plane<double> share(blocks_.width(), blocks_.height()), moved(width, height);
  for (std::size_t i = 0; i < share.size(); ++i) share.data()[i] = blocks_.data()[i].share;
  double offset_e2 = 0;
  for (int site = 0; site < 4; ++site) offset_e2 += now.variance(now.colour(site % 2, site / 2), 0);
  motion_.find(
      width, height, [&](int x, int y) { return now.value_e(x, y); }, [&](int x, int y) { return signal_e_.at(x, y); },
      offset_e2, share);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const auto by = motion_.at(x / side, y / side);
      moved.at(x, y) = signal_e_.at(std::clamp(x + by.x, 0, width - 1), std::clamp(y + by.y, 0, height - 1));
    }
  }
  signal_e_ = std::move(moved);
  for (std::size_t i = 0; i < share.size(); ++i) blocks_.data()[i].share = share.data()[i];
}

double TemporalMean::run(const denoise::RawElectronsView& raw, const denoise::RawNoise& noise, double light,
                         const denoise::TemporalOptions& options) {
  const Now now{raw, noise, 1.0 / options.max_frames};
  const int width = raw.value.width, height = raw.value.height;
  const bool first = blocks_.empty() || mean_e.width() != width || mean_e.height() != height || phase_ != raw.phase;
  const bool displaced = !first && options.compensate_motion && frames_to_search_ > 0 && std::min(width, height) >= 64;
  if (first) {
    motion_.forget();
    mean_e = Plane<double>(width, height);
    signal_e_ = Plane<double>(width, height);
    variance_fraction = Plane<double>((width + 1) / 2, (height + 1) / 2);
    blocks_ = Plane<Block>((width + side - 1) / side, (height + side - 1) / side);
    std::fill(blocks_.data(), blocks_.data() + blocks_.size(), Block{});
  } else {
    const auto at = denoise::motion_thresholds(options.false_alarm);
    for (int y = 0; y < blocks_.height(); ++y) {
      for (int x = 0; x < blocks_.width(); ++x) {
        rescale(now, light, x, y);
      }
    }
    if (displaced) displace(now);
    for (int y = 0; y < blocks_.height(); ++y) {
      for (int x = 0; x < blocks_.width(); ++x) {
        Block& block = blocks_.at(x, y);
        block.level = level_of(now, x, y, at);
        if (displaced && block.share >= 1e6) block.level = 0;
      }
    }
  }
  double moved = 0;
  for (int y = 0; y < blocks_.height(); ++y) {
    for (int x = 0; x < blocks_.width(); ++x) {
      double& share = blocks_.at(x, y).share;
      const bool starts = first || (displaced && share >= 1e6) || has_moved(x, y);
      const double weight = starts ? 1 : std::max(share / (1 + share), now.min_weight);
      share = starts ? 1 : (1 - weight) * (1 - weight) * share + weight * weight;
      moved += starts ? 1 : 0;
      now.each_site(side * x, side * y, side, [&](int u, int v, std::size_t c) {
        double& mean = signal_e_.at(u, v);
        const double value = std::min(now.value_e(u, v), now.max_e(c));
        mean = starts ? value : mean + weight * (value - mean);
        const bool as_measured = starts || now.value_e(u, v) >= now.max_e(c);
        mean_e.at(u, v) = as_measured ? usable(raw.value.at(u, v)) : mean + now.dark_e(c);
        variance_fraction.at(u / 2, v / 2) = share;
      });
    }
  }
  if (!first) add_offsets(denoise::motion_thresholds(options.false_alarm).alone);
  noise_ = noise;
  phase_ = raw.phase;
  moved /= static_cast<double>(blocks_.size());
  const bool motion = moved > std::max(0.02, 4 * options.false_alarm) || (displaced && motion_.found());
  frames_to_search_ = first ? 0 : motion ? 8 : std::max(frames_to_search_ - 1, 0);
  return moved;
}

}  // namespace lowlux::reference
