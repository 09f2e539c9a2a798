#include "capture/synthetic/burst_motion.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "isp/base/random/random.h"
#include "isp/base/text.h"

namespace lowlux::capture {
namespace {

constexpr double max_shift_px = 4096, max_ev = 24, max_place_px = 1e6;
constexpr int max_movers = 1000, max_bracket = 100, max_reduction = 8;

/// Rows of the counters of draw_purpose::burst: the camera by frame, then two counters for each mover.
constexpr std::uint32_t camera_row = 0, mover_path_row = 1, mover_look_row = 2;

double unit_of(std::uint32_t word) { return (word + 0.5) * 0x1p-32; }

ImagePoint centre_of(ImageSize size) { return {0.5 * (size.width_px - 1), 0.5 * (size.height_px - 1)}; }

/// Returns the element of the van der Corput sequence of a base, in 0..1.
double radical_inverse(std::uint32_t index, std::uint32_t base) {
  double value = 0, digit = 1;
  for (; index > 0; index /= base) {
    digit /= base;
    value += digit * (index % base);
  }
  return value;
}

Result<void> check_range(const std::string& what, double value, double least, double most, const std::string& unit) {
  if (value >= least && value <= most) return {};
  return fail(ErrorCode::invalid_argument, what + " must lie between " + number_text(least) + " and " +
                                               number_text(most) + unit + ", found " + number_text(value));
}

double side_of(const BurstOptions& options, ImageSize size) {
  return options.mover_size_px.value_or(std::max(1.0, std::min(size.width_px, size.height_px) / 8.0));
}

Result<void> check_movers(const BurstOptions& options, ImageSize size) {
  if (auto good = check_range("the number of moving objects", options.movers, 0, max_movers, ""); !good) return good;
  if (auto good = check_range("the speed of moving objects", options.mover_speed_px, 0, max_shift_px, " px per frame");
      !good) {
    return good;
  }
  if (options.movers == 0) return {};
  return check_range("the size of moving objects", side_of(options, size), 1, std::min(size.width_px, size.height_px),
                     " px (the shorter side of the image)");
}

Result<void> check_bracket(const BurstOptions& options) {
  if (options.bracket_ev.size() > max_bracket) {
    return fail(ErrorCode::invalid_argument, "a bracket has at most " + std::to_string(max_bracket) + " exposures");
  }
  for (const double ev : options.bracket_ev) {
    if (auto good = check_range("an exposure of a bracket", ev, -max_ev, max_ev, " EV"); !good) return good;
  }
  return {};
}

Result<void> check_sky(const BurstOptions& options, ImageSize size) {
  if (auto good = check_range("the field rotation", options.field_rotation_deg, -180, 180, " degrees per frame");
      !good) {
    return good;
  }
  for (const double drift : {options.drift_x_px, options.drift_y_px}) {
    if (auto good = check_range("the drift", drift, -max_shift_px, max_shift_px, " px per frame"); !good) return good;
  }
  const ImagePoint centre = options.field_centre.value_or(ImagePoint{});
  for (const double place : {centre.x_px, centre.y_px}) {
    if (auto good = check_range("the centre of the field", place, -max_place_px, max_place_px, " px"); !good) {
      return good;
    }
  }
  if (!options.horizon_px) return {};
  return check_range("the horizon", *options.horizon_px, 1, size.height_px - 1.0, " px (inside of the image)");
}

}  // namespace

Result<void> check_burst(const BurstOptions& options, ImageSize size) {
  if (size.width_px < 1 || size.height_px < 1) {
    return fail(ErrorCode::invalid_argument, "the scene is smaller than one pixel of the reduced image");
  }
  if (auto good = check_range("hand shake", options.shake_px, 0, max_shift_px, " px"); !good) return good;
  if (auto good = check_range("dithering", options.dither_px, 0, max_shift_px, " px"); !good) return good;
  if (auto good = check_range("roll", options.roll_deg, 0, 180, " degrees"); !good) return good;
  if (auto good = check_sky(options, size); !good) return good;
  if (auto good = check_movers(options, size); !good) return good;
  if (auto good = check_bracket(options); !good) return good;
  if (options.reduction) return check_range("the reduction", *options.reduction, 1, max_reduction, "");
  if (!options.moves() && !options.horizon_px) return {};
  return fail(ErrorCode::invalid_argument, "motion and a horizon need a reduction: the scene is resampled");
}

RigidMotion camera_motion(const BurstOptions& options, ImageSize size, std::uint64_t seed, std::uint32_t frame) {
  if (frame == 0) return {};
  const PhiloxWords w = words_at({seed, 0, draw_purpose::burst}, frame, camera_row);
  const double radius = options.shake_px * std::sqrt(unit_of(w[0])), angle = 2 * std::numbers::pi * unit_of(w[1]);
  double dx = 0, dy = 0;
  if (options.shake_px > 0) dx = radius * std::cos(angle), dy = radius * std::sin(angle);
  dx += options.dither_px * (2 * radical_inverse(frame, 2) - 1);
  dy += options.dither_px * (2 * radical_inverse(frame, 3) - 1);
  return rigid_motion(centre_of(size), options.roll_deg * (2 * unit_of(w[2]) - 1), dx, dy);
}

RigidMotion field_motion(const BurstOptions& options, ImageSize size, std::uint32_t frame) {
  return rigid_motion(options.field_centre.value_or(centre_of(size)), frame * options.field_rotation_deg,
                      frame * options.drift_x_px, frame * options.drift_y_px);
}

double exposure_factor(const BurstOptions& options, std::uint32_t frame) {
  return options.bracket_ev.empty() ? 1 : std::exp2(options.bracket_ev[frame % options.bracket_ev.size()]);
}

ImageBox Mover::box(std::uint32_t frame) const {
  const ImagePoint c = centre(frame);
  return {c.x_px - side_px / 2, c.y_px - side_px / 2, c.x_px + side_px / 2, c.y_px + side_px / 2};
}

std::vector<Mover> movers_of(const BurstOptions& options, ImageSize size, std::uint64_t seed) {
  const double side = side_of(options, size);
  const auto inside = [&](std::uint32_t x, std::uint32_t y) {
    return ImagePoint{unit_of(x) * (size.width_px - side) + (side - 1) / 2,
                      unit_of(y) * (size.height_px - side) + (side - 1) / 2};
  };
  std::vector<Mover> movers;
  for (int i = 0; i < options.movers; ++i) {
    const auto column = static_cast<std::uint32_t>(i);
    const PhiloxWords path = words_at({seed, 0, draw_purpose::burst}, column, mover_path_row);
    const PhiloxWords look = words_at({seed, 0, draw_purpose::burst}, column, mover_look_row);
    Mover mover{.start = inside(path[0], path[1]), .side_px = side, .texture = inside(look[0], look[1])};
    const ImagePoint target = inside(path[2], path[3]);
    const double dx = target.x_px - mover.start.x_px, dy = target.y_px - mover.start.y_px;
    const double distance = std::hypot(dx, dy);
    mover.x_px = options.mover_speed_px * (distance > 0 ? dx / distance : 1);
    mover.y_px = options.mover_speed_px * (distance > 0 ? dy / distance : 0);
    const double stops = 1 + unit_of(look[2]);  // 1 to 2 EV brighter or darker than the part it shows
    mover.gain = std::exp2((look[3] >> 31) != 0 ? stops : -stops);
    movers.push_back(mover);
  }
  return movers;
}

}  // namespace lowlux::capture
