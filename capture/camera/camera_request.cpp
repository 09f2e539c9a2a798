#include "capture/camera/camera_request.h"

#include <charconv>
#include <cmath>
#include <optional>

#include "isp/base/text.h"

namespace lowlux::capture {
namespace {

constexpr int longest_side_px = 65535;

bool is_side(const std::optional<int>& side_px) { return !side_px || (*side_px >= 1 && *side_px <= longest_side_px); }

struct Figure {
  const char* name;
  const std::optional<double>& value;
};

std::string names_of_all(std::span<const CameraListing> cameras) {
  std::string text;
  for (const CameraListing& camera : cameras) {
    if (!text.empty()) text += ", ";
    text += "\"" + camera.id + "\"";
    if (!camera.name.empty()) text += " (" + camera.name + ")";
  }
  return text;
}

bool mentions(const CameraListing& camera, std::string_view text) {
  return camera.id.find(text) != std::string::npos || camera.name.find(text) != std::string::npos;
}

std::optional<int> place_in_list(std::string_view text, std::size_t count) {
  int place = 0;
  const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), place);
  if (failed != std::errc() || end != text.data() + text.size()) return std::nullopt;
  if (place < 0 || static_cast<std::size_t>(place) >= count) return std::nullopt;
  return place;
}

}  // namespace

Result<void> check_camera_request(const CameraRequest& request) {
  if (request.buffers < 2 || request.buffers > 32) {
    return fail(ErrorCode::invalid_argument, "a camera needs 2 to 32 buffers, not " + std::to_string(request.buffers));
  }
  if (request.width.has_value() != request.height.has_value()) {
    return fail(ErrorCode::invalid_argument, "width and height of a camera must be given together");
  }
  if (!is_side(request.width) || !is_side(request.height)) {
    return fail(ErrorCode::invalid_argument, "width and height of a camera must be 1 to 65535 pixels, found " +
                                                 std::to_string(*request.width) + "x" +
                                                 std::to_string(*request.height));
  }
  for (const Figure& figure :
       {Figure{"frame rate [Hz]", request.frame_rate_hz}, Figure{"exposure [s]", request.exposure_s},
        Figure{"analogue gain", request.analogue_gain}}) {
    if (figure.value && !(std::isfinite(*figure.value) && *figure.value > 0)) {
      return fail(ErrorCode::invalid_argument,
                  std::string("a camera's ") + figure.name + " is above 0, not " + number_text(*figure.value));
    }
  }
  return {};
}

Result<int> find_camera(std::span<const CameraListing> cameras, std::string_view wanted) {
  if (cameras.empty()) return fail(ErrorCode::not_found, "there is no camera", std::string(wanted));
  int count = 0, found = 0;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    if (cameras[i].id == wanted) return static_cast<int>(i);
    if (!mentions(cameras[i], wanted)) continue;
    ++count;
    found = static_cast<int>(i);
  }
  if (const auto place = place_in_list(wanted, cameras.size())) return *place;
  if (count == 1) return found;
  const std::string there_is = "there is " + names_of_all(cameras);
  if (count == 0) return fail(ErrorCode::not_found, "no camera fits: " + there_is, std::string(wanted));
  return fail(ErrorCode::invalid_argument,
              std::to_string(count) + " cameras match, and only one can be opened: " + there_is, std::string(wanted));
}

}  // namespace lowlux::capture
