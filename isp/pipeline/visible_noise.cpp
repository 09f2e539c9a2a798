#include "isp/pipeline/visible_noise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "isp/model/colorimetry.h"
#include "isp/model/colour_difference.h"
#include "isp/render/output_space.h"
#include "isp/render/retarget_rows.h"
#include "isp/render/tone.h"

namespace lowlux::isp {
namespace {

constexpr int most_blocks_along = 16;
constexpr std::array<double, 3> samples_in_box{16, 32, 16};  // of R, G, B
constexpr std::array<double, 3> share_of_sites{0.25, 0.5, 0.25};
constexpr double least_variance_e2 = 1e-6;

/// From camera RGB, a fraction of white with the black off, to what is displayed.
class Display {
 public:
  explicit Display(const DevelopPlan& plan)
      : plan_(plan),
        limit_(tone_limit(plan.options.tone, plan.exposure_ev)),
        to_xyz_(*inverse(*xyz_to_output(plan.options.space))),
        white_(*xyz_of(output_white)) {}

  Lab lab(const Vector3& camera) const { return lab_of_shown(shown(camera)); }

  /// What changing its code for the planned display makes of a colour, by the colours that codes stand for.
  double changed_for_display(const Vector3& camera) const {
    if (!plan_.options.display) return 0;
    const Vector3 before = shown(camera);
    std::array<std::uint16_t, 3> code{};
    for (int i = 0; i < 3; ++i) {
      code[i] = static_cast<std::uint16_t>(std::lround(65535 * encode_transfer(plan_.options.space, before[i])));
    }
    apply(plan_.options.display->made.table, code.data(), 1, code.data());
    Vector3 after{};
    for (int i = 0; i < 3; ++i) after[i] = decode_transfer(plan_.options.space, code[i] / 65535.0);
    return ciede2000(lab_of_shown(before), lab_of_shown(after));
  }

 private:
  Vector3 shown(const Vector3& camera) const {
    std::array<double, 3> balanced{};
    for (int c = 0; c < 3; ++c) {
      balanced[c] = std::min(camera[c] * static_cast<double>(plan_.white_gain[c]), 1.0);
    }
    Vector3 out{};
    for (int i = 0; i < 3; ++i) {
      double v = 0;
      for (int c = 0; c < 3; ++c) v += static_cast<double>(plan_.transform.matrix[3 * i + c]) * balanced[c];
      out[i] = std::min(apply_tone(plan_.options.tone, std::clamp(v, 0.0, 1.0) * limit_, limit_), 1.0);
    }
    return out;
  }
  Lab lab_of_shown(const Vector3& shown) const { return lab_of(xyz_of(to_xyz_ * shown), white_); }

  const DevelopPlan& plan_;
  double limit_;
  Matrix3 to_xyz_;
  Xyz white_;
};

/// Per colour, of the frame.
struct Channels {
  std::array<double, 3> electrons_at_white{};
  std::array<double, 3> dark_e{};
};

Channels channels_of(const RawFrame& frame, const DevelopPlan& plan, const denoise::RawNoise& noise) {
  Channels out;
  for (int site = 0; site < 4; ++site) {
    const auto c = static_cast<std::size_t>(colour_at(frame.raw.phase, site & 1, site >> 1));
    out.electrons_at_white[c] = (*plan.electrons_at_white)[site];
    out.dark_e[c] += noise.dark_mean_e[site] * (c == 1 ? 0.5 : 1);
  }
  return out;
}

/// What is seen of noise whose mean lies below black, as it does where dark charge is overestimated: sqrt(2) times the
/// rms of what reaches above, which for a mean at black is all of it. Half the distance counts: the light of a block
/// varies.
double above_black_e(double mean_e, double std_e) {
  const double below = std::max(-mean_e / (2 * std_e), 0.0);
  const double reaching = 0.5 * std::erfc(below / std::numbers::sqrt2);
  const double density = std::exp(-0.5 * below * below) * std::numbers::inv_sqrtpi / std::numbers::sqrt2;
  return std_e * std::sqrt(std::max(2 * ((1 + below * below) * reaching - below * density), 0.0));
}

SeenBlock seen(const Vector3& charge_e, const Channels& channels, const denoise::RawNoise& noise,
               const Display& display) {
  Vector3 signal{};
  double mean_signal = 0, mean_variance = 0, squares = 0;
  for (int c = 0; c < 3; ++c) {
    signal[c] = (charge_e[c] - channels.dark_e[c]) / channels.electrons_at_white[c];
    mean_signal += share_of_sites[c] * (charge_e[c] - channels.dark_e[c]);
    mean_variance += share_of_sites[c] * (std::max(charge_e[c], 0.0) + noise.variance_e2[c]);
  }
  Vector3 lit{};
  for (int c = 0; c < 3; ++c) lit[c] = std::max(signal[c], 0.0);
  const Lab lab = display.lab(lit);
  Vector3 with_dark = signal, with_line = lit;
  const double line_e = std::sqrt(std::max(mean_variance, least_variance_e2) / (seen_box_px * seen_box_px));
  double point = 0;
  for (int c = 0; c < 3; ++c) {
    const double variance_e2 = std::max(charge_e[c], 0.0) + noise.variance_e2[c];
    const double step_e = std::sqrt(std::max(variance_e2, least_variance_e2) / samples_in_box[c]);
    Vector3 moved = lit;
    moved[c] += above_black_e(charge_e[c] - channels.dark_e[c], step_e) / channels.electrons_at_white[c];
    const double difference = ciede2000(lab, display.lab(moved));
    squares += difference * difference;
    point = std::max(point, difference / (step_e * samples_in_box[c]));
    with_dark[c] += channels.dark_e[c] / channels.electrons_at_white[c];
    with_line[c] += line_e / channels.electrons_at_white[c];
  }
  SeenBlock out;
  out.line_delta_e = static_cast<float>(ciede2000(lab, display.lab(with_line)) / line_e);
  out.point_delta_e = static_cast<float>(point);
  out.display_delta_e = static_cast<float>(display.changed_for_display(signal));
  out.snr = static_cast<float>(std::max(mean_signal, 0.0) / std::sqrt(std::max(mean_variance, least_variance_e2)));
  out.noise_delta_e = static_cast<float>(std::sqrt(squares));
  out.dark_delta_e = static_cast<float>(ciede2000(display.lab(signal), display.lab(with_dark)));
  return out;
}

}  // namespace

std::vector<SeenBlock> seen_blocks(const RawFrame& frame, const DevelopPlan& plan, const denoise::RawNoise& noise,
                                   const Thumbnail& thumbnail) {
  const OutputSpace space = plan.options.space;
  if (space == OutputSpace::camera || space == OutputSpace::xyz) return {};
  const Display display(plan);
  const Channels channels = channels_of(frame, plan, noise);
  const int columns = thumbnail.mean.width(), rows = thumbnail.mean.height();
  const int along = std::min(columns, most_blocks_along), down = std::min(rows, most_blocks_along);
  std::vector<SeenBlock> out;
  out.reserve(static_cast<std::size_t>(along) * static_cast<std::size_t>(down));
  for (int j = 0; j < down; ++j) {
    for (int i = 0; i < along; ++i) {
      const int x = (2 * i + 1) * columns / (2 * along), y = (2 * j + 1) * rows / (2 * down);
      Vector3 charge_e{};
      for (int c = 0; c < 3; ++c) {
        const auto mean = static_cast<double>(thumbnail.mean.plane[c].at(x, y));
        charge_e[c] = (std::isfinite(mean) ? mean : 0) * channels.electrons_at_white[c];
      }
      out.push_back(seen(charge_e, channels, noise, display));
      out.back().x = (static_cast<float>(x) + 0.5f) / static_cast<float>(columns);
      out.back().y = (static_cast<float>(y) + 0.5f) / static_cast<float>(rows);
    }
  }
  return out;
}

double seen_percentile(std::span<const float> rms_delta_e) {
  if (rms_delta_e.empty()) return 0;
  const auto share_above = [&](double x) {
    double sum = 0;
    for (const float rms : rms_delta_e) {
      sum += rms > 0 ? std::erfc(x / (std::sqrt(2.0) * static_cast<double>(rms))) : 0;
    }
    return sum / static_cast<double>(rms_delta_e.size());
  };
  double low = 0, high = 5 * static_cast<double>(*std::ranges::max_element(rms_delta_e));
  if (!(high > 0)) return 0;
  for (int step = 0; step < 24; ++step) {
    const double middle = (low + high) / 2;
    (share_above(middle) > 1 - seen_share ? low : high) = middle;
  }
  return (low + high) / 2;
}

}  // namespace lowlux::isp
