#include "capture/synthetic/synthetic_source.h"

#include <utility>

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
    return fail(ErrorCode::invalid_argument, "published photon sampling draws pixels, not points: leave the stars out");
  }
  if (const auto good = check_points(scene); !good) return tl::make_unexpected(good.error());
  SyntheticSource source(std::move(scene), std::move(response), options);
  ChargeRate rate = charge_rate(source.scene_, source.response_, source.table_.get(), options.phase, executor);
  source.moved_pixels_ = rate.moved_pixels;
  if (const auto good = source.check_photons(executor); !good) return tl::make_unexpected(good.error());
  auto exposed = ExposedSensor::of(*std::move(camera), std::move(rate.e_per_s));
  if (!exposed) return tl::make_unexpected(exposed.error());
  source.sensor_ = *std::move(exposed);
  return source;
}

Result<void> SyntheticSource::check_photons(Executor& executor) const {
  const std::optional<PhotonRows> rows = photon_rows();
  const double photons = rows ? rows->largest_mean_per_s(executor) * options_.exposure.time_s : 0;
  if (photons <= poisson_max_mean) return {};
  return fail(ErrorCode::invalid_argument,
              "published photon sampling expects " + number_text(photons, 3) +
                  " photons in one bin of wavelengths, above the sampler's limit of 1e6: sample physically, or expose "
                  "less");
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
  for (Plane<float>& plane : truth.plane) {
    for (std::size_t i = 0; i < plane.size(); ++i) plane.data()[i] *= time;
  }
  return truth;
}

SceneLinear SyntheticSource::xyz_cd_m2() const {
  SceneLinear truth;
  for (int c = 0; c < 3; ++c) truth.plane[c] = scene_.xyz_cd_m2.plane[c].clone();
  add_points(scene_.points, scene_.point_lights, truth);
  return truth;
}

EffectCost SyntheticSource::measure_cost() const {
  const std::optional<PhotonRows> photons = photon_rows();
  return sensor_->measure_cost(photons ? &*photons : nullptr);
}

}  // namespace lowlux::capture
