#include "isp/python/call.h"

#include <memory>

#include "isp/base/float_samples.h"
#include "isp/cli/dataset/array_file.h"
#include "isp/python/raw_image.h"

namespace lowlux::python {
namespace {

namespace py = pybind11;

/// Returns an array of the plane's samples, without copying them.
template <class Sample>
py::array owned(Plane<Sample> plane, std::vector<py::ssize_t> shape) {
  auto* const kept = new Plane<Sample>(std::move(plane));
  const py::capsule owner(kept, [](void* held) { delete static_cast<Plane<Sample>*>(held); });
  return py::array_t<Sample>(std::move(shape), kept->data(), owner);
}

py::array array_of_codes(Encoded8 picture) {
  const int height = picture.height(), width = picture.width();
  return owned(std::move(picture.codes), {height, width, 3});
}
py::array array_of_codes(Encoded16 picture) {
  const int height = picture.height(), width = picture.width();
  return owned(std::move(picture.codes), {height, width, 3});
}

py::array array_of_codes(const SceneLinear& picture) {
  return owned(cli::interleaved(picture), {picture.height(), picture.width(), 3});
}

}  // namespace

cli::ReadRaw reader_of(const std::vector<Input>& inputs) {
  return [&inputs](const std::string& name, const capture::XTransUse& x_trans_use) -> Result<RawFrame> {
    for (const Input& input : inputs) {
      if (!input.frame || input.name != name) continue;
      RawFrame frame = clone(input.frame->frame);  // other threads may write to its views
      if (const auto wrong = unusable_sample(frame.raw)) return fail(ErrorCode::invalid_argument, *wrong, name);
      return frame;
    }
    return cli::read_file(name, x_trans_use);
  };
}

void check_frames_in_memory(const std::vector<Input>& inputs) {
  for (const Input& frame : inputs) {
    if (!frame.frame) continue;
    for (const Input& other : inputs) {
      if (&other == &frame) continue;
      if (other.frame == frame.frame) {
        throw Failure({ErrorCode::invalid_argument, "it is the same frame as " + frame.name, other.name});
      }
      if (!other.frame && cli::same_name(other.name, frame.name)) {
        throw Failure({ErrorCode::invalid_argument, "a file has the name that stands for a frame in memory: rename it",
                       other.name});
      }
    }
  }
}

void set_call(const std::string& output, bool overwrite, cli::DevelopArgs& args) {
  args.output = output;
  args.force = overwrite;
  args.quiet = true;
  args.json = true;  // costs are then part of the plan
}

py::array array_of(Picture picture) {
  return std::visit([](auto& samples) { return array_of_codes(std::move(samples)); }, picture);
}

py::array array_of(Plane<float> plane) {
  const int height = plane.height(), width = plane.width();
  return owned(std::move(plane), {height, width});
}

}  // namespace lowlux::python
