#include "capture/synthetic/burst.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <span>
#include <utility>

#include "capture/synthetic/exposed_scene.h"
#include "capture/synthetic/optics/lens_blur.h"
#include "capture/synthetic/rigid_motion.h"
#include "isp/base/cfa.h"
#include "isp/base/text.h"
#include "isp/model/sensor/noise_budget.h"
#include "isp/model/spectrum/spectral_response.h"

namespace lowlux::capture {

/// The extended light of a scene as one frame of a burst has it: the sky, in front of it the foreground, in front of
/// both the moving objects. Pixels at an edge between two of them mix their means by the area that each covers.
struct BurstView {
  const LightGrid& sky;
  const LightGrid* foreground = nullptr;  // null: all is sky
  double horizon_px = 0;                  // first row of the foreground
  RigidMotion sky_motion;                 // from frame 0 to this frame
  RigidMotion camera_motion;              // motion of the foreground and of the moving objects
  std::span<const Mover> movers;          // later ones are in front
  std::uint32_t frame = 0;
};

namespace {

ImageSize image_size(const Scene& scene, const BurstOptions& burst) {
  const int reduction = std::max(1, burst.reduction.value_or(1));
  return {scene.xyz_cd_m2.width() / reduction, scene.xyz_cd_m2.height() / reduction};
}

Result<void> check_exposures(const isp::Exposure& exposure, const BurstOptions& burst) {
  for (std::uint32_t i = 0; i < burst.bracket_ev.size(); ++i) {
    isp::Exposure of_frame = exposure;
    of_frame.time_s *= exposure_factor(burst, i);
    if (auto good = isp::check_exposure(of_frame); !good) return good;
  }
  return {};
}

bool contains(const ImageBox& box, ImagePoint p) {
  return p.x_px >= box.left_px && p.x_px < box.right_px && p.y_px >= box.top_px && p.y_px < box.bottom_px;
}

void multiply(Plane<float>& plane, float factor) {
  for (std::size_t i = 0; i < plane.size(); ++i) plane.data()[i] *= factor;
}

/// Returns the part of a pixel, 0..1, that lies between two edges of its axis.
double overlap(double centre_px, double first_px, double last_px) {
  return std::clamp(std::min(centre_px + 0.5, last_px) - std::max(centre_px - 0.5, first_px), 0.0, 1.0);
}

/// Output with one channel at each pixel.
struct MosaicOutput {
  Plane<float>& plane;
  BayerPhase phase;

  int width() const { return plane.width(); }
  int height() const { return plane.height(); }
  template <class Work>
  void at(int x, int y, const Work& work) const {
    work(static_cast<int>(colour_at(phase, x, y)), plane.row(y)[x]);
  }
};

/// Output with three channels at each pixel.
struct PlanesOutput {
  const RgbView<float>& planes;

  int width() const { return planes[0].width; }
  int height() const { return planes[0].height; }
  template <class Work>
  void at(int x, int y, const Work& work) const {
    for (int k = 0; k < 3; ++k) work(k, planes[k].row(y)[x]);
  }
};

class Renderer {
 public:
  explicit Renderer(const BurstView& view)
      : view_(view), to_sky_(inverse(view.sky_motion)), to_ground_(inverse(view.camera_motion)) {}

  template <class Output>
  void background(const Output& out, RowBand band) const {
    for (int y = band.first; y < band.last; ++y) {
      for (int x = 0; x < out.width(); ++x) {
        const ImagePoint pixel{static_cast<double>(x), static_cast<double>(y)};
        const ImagePoint ground = to_ground_.at(pixel);
        const auto covered = static_cast<float>(
            view_.foreground == nullptr ? 0 : std::clamp(ground.y_px - view_.horizon_px + 1, 0.0, 1.0));
        out.at(x, y, [&](int channel, float& value) {
          value = covered < 1 ? view_.sky.at(channel, to_sky_.at(pixel)) : 0;
          if (covered > 0) value = (1 - covered) * value + covered * view_.foreground->at(channel, ground);
        });
      }
    }
  }

  template <class Output>
  void put(const Mover& mover, const Output& out, RowBand band) const {
    const ImageBox box = mover.box(view_.frame);
    const ImageBox bounds = bounds_of(view_.camera_motion, box);
    if (!(bounds.right_px >= -1 && bounds.left_px <= out.width() && bounds.bottom_px >= band.first - 1 &&
          bounds.top_px <= band.last)) {
      return;
    }
    const auto row = [](double px) { return static_cast<int>(std::clamp(px, -1.0, 1e9)); };
    const ImagePoint centre = mover.centre(view_.frame);
    const auto gain = static_cast<float>(mover.gain);
    const LightGrid& source = view_.foreground == nullptr ? view_.sky : *view_.foreground;
    for (int y = std::max(band.first, row(bounds.top_px)); y < std::min(band.last, row(bounds.bottom_px) + 2); ++y) {
      for (int x = std::max(0, row(bounds.left_px)); x < std::min(out.width(), row(bounds.right_px) + 2); ++x) {
        const ImagePoint p = to_ground_.at({static_cast<double>(x), static_cast<double>(y)});
        const auto covered =
            static_cast<float>(overlap(p.x_px, box.left_px, box.right_px) * overlap(p.y_px, box.top_px, box.bottom_px));
        if (covered == 0) continue;
        const ImagePoint seen{p.x_px - centre.x_px + mover.texture.x_px, p.y_px - centre.y_px + mover.texture.y_px};
        out.at(x, y, [&](int channel, float& value) {
          value = (1 - covered) * value + covered * gain * source.at(channel, seen);
        });
      }
    }
  }

  template <class Output>
  void render(const Output& out, Executor& executor) const {
    for_each_band(executor, out.height(), [&](RowBand band, int) {
      background(out, band);
      for (const Mover& mover : view_.movers) put(mover, out, band);
    });
  }

 private:
  const BurstView& view_;
  RigidMotion to_sky_;
  RigidMotion to_ground_;
};

/// Renders the means under each pixel's own filter.
void render_mosaic(const BurstView& view, BayerPhase phase, Executor& executor, Plane<float>& out) {
  Renderer(view).render(MosaicOutput{out, phase}, executor);
}

/// Renders the means of three channels at every pixel.
void render_planes(const BurstView& view, Executor& executor, const RgbView<float>& out) {
  Renderer(view).render(PlanesOutput{out}, executor);
}

}  // namespace

BurstSource::BurstSource(Scene scene, SpectralResponse response, SyntheticCamera camera, const BurstOptions& burst)
    : scene_(std::move(scene)),
      response_(std::move(response)),
      camera_(std::move(camera)),
      burst_(burst),
      size_(image_size(scene_, burst)),
      movers_(movers_of(burst, size_, camera_.options.seed)) {
  if (scene_.patch.empty()) table_ = std::make_unique<isp::LiftTable>(response_);
}

Result<BurstSource> BurstSource::of(Scene scene, isp::NamedSensor sensor, SpectralResponse response,
                                    const SyntheticOptions& options, const BurstOptions& burst, Executor& executor) {
  auto camera = make_camera(std::move(sensor), response, scene.white, options);
  if (!camera) return tl::make_unexpected(camera.error());
  if (options.sampling == PhotonSampling::published) {
    return fail(ErrorCode::invalid_argument,
                "published photon sampling does not support bursts: use physical sampling");
  }
  if (const auto good = check_points(scene); !good) return tl::make_unexpected(good.error());
  if (const auto good = check_burst(burst, image_size(scene, burst)); !good) return tl::make_unexpected(good.error());
  if (const auto good = check_exposures(options.exposure, burst); !good) return tl::make_unexpected(good.error());

  BurstSource out(std::move(scene), std::move(response), *std::move(camera), burst);
  const std::vector<PointSource> points = std::exchange(out.scene_.points, {});  // added to each frame by itself
  if (burst.reduction) {
    const CameraRgb rate = charge_rate_rgb(out.scene_, out.response_, out.table_.get(), executor, &out.moved_pixels_);
    out.grids_ = out.grids_of(rate.view(), executor);
  } else {
    ChargeRate rate = charge_rate(out.scene_, out.response_, out.table_.get(), options.phase, executor);
    out.moved_pixels_ = rate.moved_pixels;
    out.still_ = std::move(rate.e_per_s);
  }
  out.scene_.points = points;
  return out;
}

BurstSource::Grids BurstSource::grids_of(const RgbView<const float>& samples, Executor& executor) const {
  const int reduction = *burst_.reduction, width = samples[0].width, height = samples[0].height;
  const int sky_rows = burst_.horizon_px ? reduction * *burst_.horizon_px : height;
  const auto rows = [&](int first, int count) {
    return RgbView<const float>{samples[0].crop(0, first, width, count), samples[1].crop(0, first, width, count),
                                samples[2].crop(0, first, width, count)};
  };
  Grids out{std::make_unique<LightGrid>(rows(0, sky_rows), reduction, 0, executor), nullptr};
  if (sky_rows < height) {
    out.foreground =
        std::make_unique<LightGrid>(rows(sky_rows, height - sky_rows), reduction, sky_rows / reduction, executor);
  }
  return out;
}

BurstTruth BurstSource::truth(std::uint32_t index) const {
  BurstTruth out;
  out.camera_motion = camera_motion(burst_, size_, camera_.options.seed, index);
  out.motion = combined(field_motion(burst_, size_, index), out.camera_motion);
  out.exposure_s = camera_.options.exposure.time_s * exposure_factor(burst_, index);
  for (const Mover& mover : movers_) out.movers.push_back(mover.box(index));
  return out;
}

BurstView BurstSource::view_of(const Grids& grids, std::uint32_t index) const {
  const BurstTruth frame = truth(index);
  return {*grids.sky,   grids.foreground.get(), static_cast<double>(burst_.horizon_px.value_or(0)),
          frame.motion, frame.camera_motion,    movers_,
          index};
}

std::vector<PointSource> BurstSource::stars_around(const RigidMotion& motion) const {
  constexpr double reach_px = 8;  // beyond which the light of a star of 0.7 px falls outside
  const ImageBox image{-reach_px, -reach_px, size_.width_px + reach_px, size_.height_px + reach_px};
  const ImageBox seen = bounds_of(inverse(motion), image);
  std::vector<PointSource> out;
  for (const StarField& field : scene_.star_fields) {
    const auto cell = [](double px, int side) { return static_cast<int>(std::floor((px + 0.5) / side)); };
    for (int row = cell(seen.top_px, field.height_px); row <= cell(seen.bottom_px, field.height_px); ++row) {
      for (int column = cell(seen.left_px, field.width_px); column <= cell(seen.right_px, field.width_px); ++column) {
        if (row == 0 && column == 0) continue;  // in scene_.points
        const std::vector<PointSource> stars = stars_of_cell(field, column, row);
        out.insert(out.end(), stars.begin(), stars.end());
      }
    }
  }
  return out;
}

std::vector<PointSource> BurstSource::points_in_frame(std::uint32_t index) const {
  const BurstTruth frame = truth(index);
  const RigidMotion field = field_motion(burst_, size_, index);
  std::vector<PointSource> out;
  const auto add = [&](PointSource point) {
    const bool with_sky = point.is_star || !burst_.horizon_px;
    const ImagePoint start{point.x_px, point.y_px}, ground = with_sky ? field.at(start) : start;
    if (burst_.horizon_px && point.is_star && ground.y_px >= *burst_.horizon_px - 0.5) return;
    if (std::ranges::any_of(frame.movers, [&](const ImageBox& box) { return contains(box, ground); })) return;
    const ImagePoint place = (with_sky ? frame.motion : frame.camera_motion).at(start);
    const double reach_px = 6 * point.spread_px + 3;  // see spread_point: no farther
    if (!contains({-reach_px, -reach_px, size_.width_px - 1 + reach_px, size_.height_px - 1 + reach_px}, place)) return;
    point.x_px = place.x_px;
    point.y_px = place.y_px;
    out.push_back(point);
  };
  for (const PointSource& point : scene_.points) add(point);
  if (burst_.moves()) {
    for (const PointSource& star : stars_around(frame.motion)) add(star);
  }
  return out;
}

std::vector<BurstPoint> BurstSource::points(std::uint32_t index) const {
  std::vector<Vector3> rates;
  for (const Spectrum& light : scene_.point_lights) rates.push_back(isp::electron_rate(response_, light));
  const double time_s = truth(index).exposure_s, blur_px = camera_.options.simulated_blur_px();
  std::vector<BurstPoint> out;
  for (const PointSource& point : points_in_frame(index)) {
    BurstPoint of_frame{{point.x_px, point.y_px}, std::hypot(point.spread_px, blur_px), {}};
    for (int k = 0; k < 3; ++k) of_frame.signal_e[k] = time_s * point.luminance_cd_m2 * rates[point.light][k];
    out.push_back(of_frame);
  }
  return out;
}

CameraRgb BurstSource::rate_rgb_e_per_s(std::uint32_t index, Executor& executor) const {
  if (!grids_.sky) return charge_rate_rgb(scene_, response_, table_.get(), executor);
  CameraRgb out(size_.width_px, size_.height_px);
  render_planes(view_of(grids_, index), executor, out.view());
  add_points(points_in_frame(index), scene_.point_lights, response_, out);
  return out;
}

SensorLight BurstSource::light(std::uint32_t index, Executor& executor) const {
  if (const double blur_px = camera_.options.lens_blur_px; blur_px > 0) {
    return light_through_lens(rate_rgb_e_per_s(index, executor), camera_.options.phase, blur_px, executor);
  }
  Plane<float> out;
  if (grids_.sky) {
    out = Plane<float>(size_.width_px, size_.height_px);
    render_mosaic(view_of(grids_, index), camera_.options.phase, executor, out);
  } else {
    out = still_.clone();
  }
  add_points(points_in_frame(index), scene_.point_lights, response_, camera_.options.phase, out);
  return {std::move(out), {}};
}

Result<ExposedSensor> BurstSource::exposed(std::uint32_t index, Executor& executor) const {
  SyntheticCamera camera = camera_;
  camera.options.exposure.time_s = truth(index).exposure_s;
  return ExposedSensor::of(std::move(camera), light(index, executor));
}

Result<RawFrame> BurstSource::frame(std::uint32_t index, Executor& executor) const {
  const auto sensor = exposed(index, executor);
  if (!sensor) return tl::make_unexpected(sensor.error());
  return sensor->frame(index, nullptr, executor);
}

Plane<float> BurstSource::mosaic_e(std::uint32_t index, Executor& executor) const {
  SensorLight light = this->light(index, executor);
  Plane<float> out = std::move(camera_.options.simulated_blur_px() > 0 ? light.blurred_e_per_s : light.e_per_s);
  multiply(out, static_cast<float>(truth(index).exposure_s));
  return out;
}

CameraRgb BurstSource::signal_e(std::uint32_t index, Executor& executor) const {
  CameraRgb out = rate_rgb_e_per_s(index, executor);
  const LensBlur lens(camera_.options.simulated_blur_px());
  for (Plane<float>& plane : out.plane) {
    lens.apply(plane, executor);
    multiply(plane, static_cast<float>(truth(index).exposure_s));
  }
  return out;
}

SceneLinear BurstSource::xyz_cd_m2(std::uint32_t index, Executor& executor) const {
  SceneLinear out(size_.width_px, size_.height_px);
  if (grids_.sky) {
    render_planes(view_of(grids_of(scene_.xyz_cd_m2.view(), executor), index), executor, out.view());
  } else {
    for (int c = 0; c < 3; ++c) out.plane[c] = scene_.xyz_cd_m2.plane[c].clone();
  }
  add_points(points_in_frame(index), scene_.point_lights, out);
  const LensBlur lens(camera_.options.simulated_blur_px());
  for (Plane<float>& plane : out.plane) lens.apply(plane, executor);
  return out;
}

}  // namespace lowlux::capture
