#pragma once

#include <array>
#include <string>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/plane.h"
#include "isp/base/result.h"

namespace lowlux::test {

/// A picture behind a lens, as the light of red, green and blue at every pixel.
struct VideoScene {
  std::string name;
  std::array<Plane<float>, 3> rate_e;  // mean of green 1
};
/// Errors: those of picture_light.
Result<VideoScene> video_scene(const std::string& name, Executor& executor);

/// How a video of a picture is taken. `object`: a square of 96 pixels, of another part of the picture, moves over it,
/// the camera stands still.
enum class VideoMotion { still, drift, pan, hand_held, object };
inline constexpr std::array all_motions{VideoMotion::still, VideoMotion::drift, VideoMotion::pan,
                                        VideoMotion::hand_held, VideoMotion::object};
const char* name_of(VideoMotion motion);

/// Errors of the last half of a video's frames against the light without noise [dB]: PSNR of codes with a gamma of 2.2,
/// white at five times the mean of green, without the outermost 8 pixels.
struct VideoErrors {
  double level_db = 0;        // each frame by itself, `standard`
  double still_db = 0;        // with previous frames, of what stands still
  double compensated_db = 0;  // with previous frames, of what moves too
};
struct VideoResult {
  VideoErrors moving;  // the pixels that move against the sensor
  VideoErrors rest;    // the others, if any
};

/// Takes a video of 256 x 256 pixels with a read noise of 2 e-, and reduces its noise.
VideoResult take_video(const VideoScene& scene, VideoMotion motion, double mean_e, int frames);

}  // namespace lowlux::test
