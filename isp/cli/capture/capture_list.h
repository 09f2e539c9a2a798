#pragma once

#include <string>
#include <vector>

#include "capture/camera/camera.h"

namespace lowlux::cli {

/// Holds the connected cameras.
struct CameraList {
  std::vector<capture::CameraListing> v4l2;
  std::vector<capture::CameraListing> libcamera;
  std::string note;  // reason why libcamera was not used; empty: it was
};

/// Returns the connected cameras.
CameraList find_cameras();

/// Prints the connected cameras, for people or as JSON. @return the exit code: 0 also if there are none
int list_cameras(bool json);

}  // namespace lowlux::cli
