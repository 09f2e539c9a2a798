#include "capture/synthetic/synthetic_source.h"

#include <utility>

#include "capture/synthetic/optics/lens_blur.h"
#include "isp/base/random/random.h"
#include "isp/base/text.h"

namespace lowlux::capture {

SyntheticSource::SyntheticSource(Scene scene, SpectralResponse response, const SyntheticOptions& options)
    : scene_(std::move(scene)), response_(std::move(response)), options_(options) {
  if (scene_.patch.empty()) table_ = std::make_unique<isp::LiftTable>(response_);
}

Result<SyntheticSource> SyntheticSource::of(Scene scene, isp::NamedSensor sensor, SpectralResponse response,
                                            const SyntheticOptions& options, Executor& executor) {
  auto camera = make_camera(std::move(sensor), response, scene.white, options);
  if (!camera) return tl::make_unexpected(camera.error());
  if (options.sampling == PhotonSampling::published && !scene.points.empty()) {
    return fail(ErrorCode::invalid_argument, "published photon sampling does not support stars: leave them out");
  }
  if (const auto good = check_points(scene); !good) return tl::make_unexpected(good.error());
  SyntheticSource source(std::move(scene), std::move(response), options);
  SensorLight light = source.exposed_light(executor);
  if (const auto good = source.check_photons(executor); !good) return tl::make_unexpected(good.error());
  auto exposed = ExposedSensor::of(*std::move(camera), std::move(light));
  if (!exposed) return tl::make_unexpected(exposed.error());
  source.sensor_ = *std::move(exposed);
  return source;
}

SensorLight SyntheticSource::exposed_light(Executor& executor) {
  if (options_.lens_blur_px > 0) {
    CameraRgb rate = charge_rate_rgb(scene_, response_, table_.get(), executor, &moved_pixels_);
    return light_through_lens(std::move(rate), options_.phase, options_.lens_blur_px, executor);
  }
  ChargeRate rate = charge_rate(scene_, response_, table_.get(), options_.phase, executor);
  moved_pixels_ = rate.moved_pixels;
  return {std::move(rate.e_per_s), {}};
}

Result<void> SyntheticSource::check_photons(Executor& executor) const {
  const std::optional<PhotonRows> rows = photon_rows();
  const double photons = rows ? rows->largest_mean_per_s(executor) * options_.exposure.time_s : 0;
  if (photons <= poisson_max_mean) return {};
  return fail(ErrorCode::invalid_argument, "published photon sampling expects " + number_text(photons, 3) +
                                               " photons in one bin of wavelengths, above the sampler's limit of 1e6: "
                                               "use physical sampling, or expose less");
}

std::optional<PhotonRows> SyntheticSource::photon_rows() const {
  if (options_.sampling == PhotonSampling::physical) return std::nullopt;
  return PhotonRows(scene_, response_, table_.get(), options_.phase, options_.masked_columns);
}

RawFrame SyntheticSource::frame(std::uint32_t index, Executor& executor) const {
  const std::optional<PhotonRows> photons = photon_rows();
  return sensor_->frame(index, photons ? &*photons : nullptr, executor);
}

Plane<float> SyntheticSource::frame_dn(std::uint32_t index, Executor& executor) const {
  const std::optional<PhotonRows> photons = photon_rows();
  return sensor_->frame_dn(index, photons ? &*photons : nullptr, executor);
}

CameraRgb SyntheticSource::signal_e(Executor& executor) const {
  CameraRgb truth = charge_rate_rgb(scene_, response_, table_.get(), executor);
  const auto time = static_cast<float>(options_.exposure.time_s);
  const LensBlur lens(options_.simulated_blur_px());
  for (Plane<float>& plane : truth.plane) {
    lens.apply(plane, executor);
    for (std::size_t i = 0; i < plane.size(); ++i) plane.data()[i] *= time;
  }
  return truth;
}

SceneLinear SyntheticSource::xyz_cd_m2(Executor& executor) const {
  SceneLinear truth;
  for (int c = 0; c < 3; ++c) truth.plane[c] = scene_.xyz_cd_m2.plane[c].clone();
  add_points(scene_.points, scene_.point_lights, truth);
  const LensBlur lens(options_.simulated_blur_px());
  for (Plane<float>& plane : truth.plane) lens.apply(plane, executor);
  return truth;
}

EffectCost SyntheticSource::measure_cost() const {
  const std::optional<PhotonRows> photons = photon_rows();
  return sensor_->measure_cost(photons ? &*photons : nullptr);
}

}  // namespace lowlux::capture
