#pragma once

#include <any>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

/// As much of libcamera's public classes as a layer uses, with members that a test sets.
namespace libcamera {

/// Identified by a number: a test and a module that it loads have objects of their own.
template <class T>
struct Control {
  int id;
};

namespace controls {
inline constexpr Control<std::array<std::int32_t, 4>> SensorBlackLevels{1};
inline constexpr Control<std::int32_t> ExposureTime{2};
inline constexpr Control<float> AnalogueGain{3};
inline constexpr Control<float> SensorTemperature{4};
}  // namespace controls

class ControlList {
 public:
  template <class T>
  std::optional<T> get(const Control<T>& control) const {
    const auto found = values_.find(control.id);
    return found == values_.end() ? std::nullopt : std::optional(std::any_cast<T>(found->second));
  }
  template <class T>
  void set(const Control<T>& control, const T& value) {
    values_[control.id] = value;
  }

 private:
  std::map<int, std::any> values_;
};

class ControlInfoMap {
 public:
  using Map = std::map<int, int>;
};

class PixelFormat {
 public:
  PixelFormat(std::uint32_t fourcc, std::uint64_t modifier) : fourcc_(fourcc), modifier_(modifier) {}
  std::uint32_t fourcc() const { return fourcc_; }
  std::uint64_t modifier() const { return modifier_; }

 private:
  std::uint32_t fourcc_;
  std::uint64_t modifier_;
};

struct Size {
  unsigned int width = 0;
  unsigned int height = 0;
};

class Stream {};

struct StreamConfiguration {
  PixelFormat pixelFormat{0, 0};
  Size size;
  unsigned int stride = 0;
  Stream* stream() const { return own; }
  Stream* own = nullptr;
};

class CameraConfiguration {
 public:
  std::vector<StreamConfiguration> streams;
  auto begin() const { return streams.begin(); }
  auto end() const { return streams.end(); }
};

struct FrameMetadata {
  enum Status { FrameSuccess, FrameError, FrameCancelled };
  Status status = FrameSuccess;
  unsigned int sequence = 0;
  std::uint64_t timestamp = 0;
};

struct SharedFd {
  int fd = -1;
  int get() const { return fd; }
};

class FrameBuffer {
 public:
  struct Plane {
    SharedFd fd;
    unsigned int offset = 0;
    unsigned int length = 0;
  };
  const std::vector<Plane>& planes() const { return own_planes; }
  const FrameMetadata& metadata() const { return own_metadata; }
  std::vector<Plane> own_planes;
  FrameMetadata own_metadata;
};

class Request {
 public:
  ControlList& metadata() { return own_metadata; }
  const std::map<const Stream*, FrameBuffer*>& buffers() const { return own_buffers; }
  ControlList own_metadata;
  std::map<const Stream*, FrameBuffer*> own_buffers;
};

}  // namespace libcamera
