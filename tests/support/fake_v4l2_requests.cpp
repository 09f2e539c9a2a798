#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "tests/support/fake_v4l2.h"

// This file holds what the fake driver answers to each request.
namespace lowlux::test {
namespace {

void copy_name(unsigned char (&field)[32], const char* name) {
  std::memcpy(field, name, std::min(sizeof field, std::strlen(name) + 1));
}

/// Fills a buffer with what the fake camera sees: each byte states its position and the frame.
void fill(std::vector<std::byte>& bytes, std::uint32_t sequence) {
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::byte>(i * 7 + sequence);
}

}  // namespace

int FakeV4l2::query(void* argument) const {
  auto& told = *static_cast<v4l2_capability*>(argument);
  copy_name(told.card, "Fake Camera\x07");
  told.capabilities = V4L2_CAP_DEVICE_CAPS | V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_VIDEO_OUTPUT | V4L2_CAP_STREAMING;
  told.device_caps = capabilities;
  return 0;
}

int FakeV4l2::list_format(void* argument) const {
  auto& told = *static_cast<v4l2_fmtdesc*>(argument);
  if (told.index >= formats.size()) return EINVAL;
  told.pixelformat = formats[told.index].fourcc;
  return 0;
}

int FakeV4l2::list_size(void* argument) const {
  auto& told = *static_cast<v4l2_frmsizeenum*>(argument);
  const auto format =
      std::find_if(formats.begin(), formats.end(), [&](const Format& one) { return one.fourcc == told.pixel_format; });
  if (format == formats.end() || format->sizes.empty()) return ENOTTY;
  if (format->is_range) {
    if (told.index > 0) return EINVAL;
    told.type = V4L2_FRMSIZE_TYPE_STEPWISE;
    told.stepwise = {format->sizes[0].first,  format->sizes[1].first,  2,
                     format->sizes[0].second, format->sizes[1].second, 2};
    return 0;
  }
  if (told.index >= format->sizes.size()) return EINVAL;
  told.type = V4L2_FRMSIZE_TYPE_DISCRETE;
  told.discrete = {format->sizes[told.index].first, format->sizes[told.index].second};
  return 0;
}

int FakeV4l2::get_format(void* argument) const {
  auto& told = *static_cast<v4l2_format*>(argument);
  if (is_multi_planar_ != (told.type == V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE)) return EINVAL;
  if (is_multi_planar_) {
    told.fmt.pix_mp = {};
    told.fmt.pix_mp.pixelformat = layout.fourcc;
    told.fmt.pix_mp.width = layout.width;
    told.fmt.pix_mp.height = layout.height;
    told.fmt.pix_mp.field = layout.field;
    told.fmt.pix_mp.num_planes = static_cast<std::uint8_t>(layout.planes);
    told.fmt.pix_mp.plane_fmt[0].bytesperline = layout.stride_bytes;
    told.fmt.pix_mp.plane_fmt[0].sizeimage = layout.buffer_bytes;
    return 0;
  }
  told.fmt.pix = {};
  told.fmt.pix.pixelformat = layout.fourcc;
  told.fmt.pix.width = layout.width;
  told.fmt.pix.height = layout.height;
  told.fmt.pix.field = layout.field;
  told.fmt.pix.bytesperline = layout.stride_bytes;
  told.fmt.pix.sizeimage = layout.buffer_bytes;
  return 0;
}

int FakeV4l2::set_format(void* argument) {
  auto& asked = *static_cast<v4l2_format*>(argument);
  if (is_multi_planar_ != (asked.type == V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE)) return EINVAL;
  if (!memory_.empty()) return EBUSY;
  const std::uint32_t fourcc = is_multi_planar_ ? asked.fmt.pix_mp.pixelformat : asked.fmt.pix.pixelformat;
  const auto known =
      std::find_if(formats.begin(), formats.end(), [&](const Format& one) { return one.fourcc == fourcc; });
  const Format& format = known == formats.end() ? formats.front() : *known;  // another one, as drivers do
  layout.fourcc = format.fourcc;
  layout.width = is_multi_planar_ ? asked.fmt.pix_mp.width : asked.fmt.pix.width;
  layout.height = is_multi_planar_ ? asked.fmt.pix_mp.height : asked.fmt.pix.height;
  layout.stride_bytes = layout.width * format.bytes_per_pixel + 8;
  layout.buffer_bytes = layout.stride_bytes * layout.height;
  if (on_set_format) on_set_format(layout);
  return get_format(argument);
}

int FakeV4l2::exchange_interval(void* argument, bool set) {
  auto& capture = static_cast<v4l2_streamparm*>(argument)->parm.capture;
  if (set && only_interval) {
    interval[0] = 1, interval[1] = *only_interval;
  } else if (set) {
    interval[0] = capture.timeperframe.numerator, interval[1] = capture.timeperframe.denominator;
  }
  capture.timeperframe = {interval[0], interval[1]};
  capture.capability = sets_interval ? V4L2_CAP_TIMEPERFRAME : 0;
  return 0;
}

int FakeV4l2::query_control(void* argument) const {
  auto& told = *static_cast<v4l2_queryctrl*>(argument);
  const auto found = controls.find(told.id);
  if (found == controls.end()) return EINVAL;
  told.minimum = found->second.minimum;
  told.maximum = found->second.maximum;
  told.step = found->second.step;
  told.flags = found->second.flags;
  return 0;
}

int FakeV4l2::exchange_control(void* argument, bool set) {
  auto& one = *static_cast<v4l2_control*>(argument);
  const auto found = controls.find(one.id);
  if (found == controls.end()) return EINVAL;
  Control& control = found->second;
  if (set) {
    if (one.value < control.minimum || one.value > control.maximum) return ERANGE;
    if (control.step != 0 && (one.value - control.minimum) % control.step != 0) ++misuses;
    control.value = one.value;
    if (on_set_control) on_set_control(one.id);
  }
  one.value = control.value;
  return 0;
}

int FakeV4l2::wide_control(void* argument) const {
  auto& list = *static_cast<v4l2_ext_controls*>(argument);
  if (list.count != 1 || list.controls->id != V4L2_CID_PIXEL_RATE || pixel_rate_hz == 0) return EINVAL;
  list.controls->value64 = pixel_rate_hz;
  return 0;
}

int FakeV4l2::selection(void* argument) const {
  if (crop_width == 0) return ENOTTY;
  static_cast<v4l2_selection*>(argument)->r = {0, 0, crop_width, layout.height};
  return 0;
}

int FakeV4l2::request_buffers(void* argument) {
  auto& asked = *static_cast<v4l2_requestbuffers*>(argument);
  if (open_maps > 0) ++misuses;
  if (asked.count == 0) {
    memory_.clear();
    return 0;
  }
  if (buffers_given) asked.count = *buffers_given;
  memory_.clear();
  for (std::uint32_t i = 0; i < asked.count; ++i) {
    memory_.push_back(std::make_unique<Memory>());
    memory_.back()->bytes.resize(buffer_length.value_or(layout.buffer_bytes));
  }
  requested = asked.count;
  return 0;
}

int FakeV4l2::query_buffer(void* argument) const {
  auto& told = *static_cast<v4l2_buffer*>(argument);
  if (told.index >= memory_.size()) return EINVAL;
  const auto length = stated_length.value_or(static_cast<std::uint32_t>(memory_[told.index]->bytes.size()));
  if (is_multi_planar_) {
    told.m.planes[0].length = length;
    told.m.planes[0].m.mem_offset = told.index << 12;
  } else {
    told.length = length;
    told.m.offset = told.index << 12;
  }
  return 0;
}

int FakeV4l2::queue_buffer(void* argument) {
  const auto& asked = *static_cast<v4l2_buffer*>(argument);
  if (asked.index >= memory_.size() || memory_[asked.index]->is_queued) {
    ++misuses;
    return EINVAL;
  }
  memory_[asked.index]->is_queued = true;
  queue_.push_back(asked.index);
  return 0;
}

int FakeV4l2::dequeue_buffer(void* argument) {
  auto& told = *static_cast<v4l2_buffer*>(argument);
  if (!is_streaming) return EINVAL;
  if (frames.empty() || queue_.empty()) return EAGAIN;
  const Frame frame = frames.front();
  frames.pop_front();
  const std::uint32_t index = queue_.front();
  queue_.pop_front();
  Memory& memory = *memory_[index];
  memory.is_queued = false;
  fill(memory.bytes, frame.sequence);
  told.index = frame.index.value_or(index);
  told.flags = frame.flags;
  told.sequence = frame.sequence;
  told.timestamp = {frame.seconds, frame.microseconds};
  const auto used = frame.bytes_used.value_or(static_cast<std::uint32_t>(memory.bytes.size()));
  if (is_multi_planar_) {
    told.m.planes[0].bytesused = used;
    told.m.planes[0].data_offset = frame.data_offset;
  } else {
    told.bytesused = used;
  }
  return 0;
}

int FakeV4l2::export_buffer(void* argument) {
  auto& asked = *static_cast<v4l2_exportbuffer*>(argument);
  if (asked.index >= memory_.size()) return EINVAL;
  asked.fd = ++last_file_;
  files_[asked.fd] = static_cast<int>(asked.index);
  open_files = static_cast<int>(files_.size());
  return 0;
}

}  // namespace lowlux::test
