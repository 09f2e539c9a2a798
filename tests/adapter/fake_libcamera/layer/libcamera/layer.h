#pragma once

#include <cstdint>
#include <string>

#include <libcamera/controls.h>

/// The interface of layers as proposed for libcamera (version 6), by the names and the order that a layer is compiled
/// with: for tests of isp/adapter/examples/libcamera_layer.cpp, as no release of libcamera has it.
namespace libcamera {

class CameraConfiguration;
class FrameBuffer;
class Request;

struct LayerInfo {
  const char* name;
  int layerAPIVersion;  // 1
};

/// All but the first two may be null. `closure` is what init() returned for a camera.
struct LayerInterface {
  void* (*init)(const std::string& camera_id);
  void (*terminate)(void* closure);
  void (*bufferCompleted)(void* closure, Request*, FrameBuffer*);
  ControlList (*requestCompleted)(void* closure, Request*);
  void (*disconnected)(void* closure);
  void (*acquire)(void* closure);
  void (*release)(void* closure);
  ControlInfoMap::Map (*controls)(void* closure, ControlInfoMap&);
  ControlList (*properties)(void* closure, ControlList&);
  void (*configure)(void* closure, const CameraConfiguration*);
  void (*createRequest)(void* closure, std::uint64_t cookie, const Request*);
  void (*queueRequest)(void* closure, Request*);
  void (*start)(void* closure, ControlList&);
  void (*stop)(void* closure);
};

}  // namespace libcamera
