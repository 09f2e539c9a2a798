#include "isp/cli/capture/capture_list.h"

#include <cstdio>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "capture/v4l2/v4l2_source.h"
#include "isp/base/json_text.h"
#include "isp/cli/shared/exit_code.h"
#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/module.h"
#include "isp/cli/shared/report.h"

namespace lowlux::cli {
namespace {

using Json = nlohmann::ordered_json;
using capture::CameraListing;

Json listing_json(const std::vector<CameraListing>& cameras) {
  Json json = Json::array();
  for (const CameraListing& camera : cameras) {
    json.push_back({{"id", camera.id}, {"name", camera.name}, {"formats", camera.formats}});
  }
  return json;
}

void print_listing(const char* option, const std::vector<CameraListing>& cameras) {
  for (const CameraListing& camera : cameras) {
    print_out(fmt::format("{}\n", one_line(fmt::format("{} {}  {}", option, camera.id, camera.name))));
    for (const std::string& format : camera.formats) print_out(fmt::format("    {}\n", one_line(format)));
    if (camera.formats.empty()) print_out("    no raw format\n");
  }
}

}  // namespace

CameraList find_cameras() {
  CameraList found;
  found.v4l2 = capture::list_v4l2_cameras();
  auto listed = load_libcamera().and_then([](const capture::LibcameraModule& module) { return module.list(); });
  if (listed) {
    found.libcamera = *std::move(listed);
  } else {
    found.note = listed.error().message;
  }
  return found;
}

int list_cameras(bool json) {
  const CameraList found = find_cameras();
  if (json) {
    const Json all{{"v4l2", listing_json(found.v4l2)},
                   {"libcamera", listing_json(found.libcamera)},
                   {"note", found.note.empty() ? Json(nullptr) : Json(found.note)}};
    print_out(fmt::format("{}\n", json_text(all, 2)));
    return exit_done;
  }
  print_listing("--v4l2", found.v4l2);
  print_listing("--libcamera", found.libcamera);
  if (found.v4l2.empty() && found.libcamera.empty()) print_out("no cameras\n");
  if (!found.note.empty()) {
    print_err(fmt::format("{}\n",
                          one_line(fmt::format("lowlux: note: cameras of libcamera are not listed: {}", found.note))));
  }
  return exit_done;
}

}  // namespace lowlux::cli
