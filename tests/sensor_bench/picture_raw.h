#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "isp/base/cfa.h"
#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/plane.h"
#include "isp/base/result.h"
#include "isp/base/sensor.h"

namespace lowlux::test {

/// The eight clean pictures of testdata/pictures. The first four are those that estimators are tuned on.
inline constexpr std::array<const char*, 8> clean_pictures{"kodim05.png", "kodim15.png",   "GoldenGate.exr",
                                                           "Carrots.exr", "StillLife.exr", "kodim08.png",
                                                           "kodim19.png", "kodim23.png"};

/// A picture as the light on a mosaic behind a Nikon D5100's filters.
struct PictureLight {
  std::string name;
  Plane<float> rate_e;  // mean electrons of each pixel; those of the green pixels have the mean 1
};

/// @param lens_sigma_px  standard deviation of the Gaussian that a lens spreads each point over, before the mosaic
///                       samples the light; 0: none, as sharp as the picture
/// @param phase  of the mosaic
/// Errors: those of reading the file and of making a scene of it.
Result<PictureLight> picture_light(const std::string& name, Executor& executor, double lens_sigma_px = 0,
                                   BayerPhase phase = BayerPhase::rggb);

/// How a picture is taken.
struct PictureShot {
  double mean_green_e = 100;
  double dark_time_s = 1.0 / 30;
  std::uint64_t seed = 1;
  int crop = 0;  // > 0: only so many columns and rows, from the middle; even
};

/// A raw of it: photon noise, read noise, dark current, patterns, quantisation and clipping of the sensor.
RawDn take_picture(const PictureLight& light, const SensorModel& sensor, const PictureShot& shot, Executor& executor);

}  // namespace lowlux::test
