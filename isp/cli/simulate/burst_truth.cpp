#include "isp/cli/simulate/burst_truth.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <iterator>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace lowlux::cli {
namespace {

using Json = nlohmann::ordered_json;

Json motion_json(const capture::RigidMotion& motion, capture::ImagePoint centre) {
  const capture::ImagePoint moved = motion.at(centre);
  return {{"dx_px", moved.x_px - centre.x_px},
          {"dy_px", moved.y_px - centre.y_px},
          {"rotation_deg", motion.rotation_deg()},
          {"centre_px", {centre.x_px, centre.y_px}}};
}

Json box_json(const capture::ImageBox& box) { return {box.left_px, box.top_px, box.right_px, box.bottom_px}; }

Json frame_json(const capture::BurstTruth& truth, const std::string& file, capture::ImagePoint centre) {
  Json movers = Json::array();
  for (const capture::ImageBox& box : truth.movers) {
    movers.push_back(
        {{"box_in_frame_0_px", box_json(box)}, {"box_px", box_json(capture::bounds_of(truth.camera_motion, box))}});
  }
  return {{"file", std::filesystem::path(file).filename().string()},
          {"exposure_s", truth.exposure_s},
          {"motion", motion_json(truth.motion, centre)},
          {"camera_motion", motion_json(truth.camera_motion, centre)},
          {"movers", movers}};
}

}  // namespace

std::string burst_truth_json(const SimulateArgs& args, const capture::BurstSource& source,
                             const std::vector<std::string>& files) {
  const capture::ImageSize size = source.size();
  const capture::ImagePoint centre{0.5 * (size.width_px - 1), 0.5 * (size.height_px - 1)};
  const capture::BurstOptions& options = args.burst.options;
  const Json head{{"width", size.width_px},
                  {"height", size.height_px},
                  {"seed", args.options.seed},
                  {"reduction", options.reduction ? Json(*options.reduction) : Json()},
                  {"horizon_px", options.horizon_px ? Json(*options.horizon_px) : Json()}};
  // Lines of their own keep a file of many frames and stars readable, and bound the memory that it takes.
  std::string text = head.dump();
  text.pop_back();
  text += ",\n\"frames\": [\n";
  for (std::size_t i = 0; i < files.size(); ++i) {
    const capture::BurstTruth truth = source.truth(static_cast<std::uint32_t>(i));
    text += frame_json(truth, files[i], centre).dump(-1, ' ', false, Json::error_handler_t::replace);
    text += i + 1 < files.size() ? ",\n" : "\n";
  }
  text += "],\n\"points_of_frame_0\": [\n";
  auto out = std::back_inserter(text);
  const char* separator = "";
  for (const capture::BurstPoint& p : source.points(0)) {
    fmt::format_to(out, R"({}{{"x_px":{},"y_px":{},"signal_e":[{},{},{}],"spread_px":{}}})", separator, p.place.x_px,
                   p.place.y_px, p.signal_e[0], p.signal_e[1], p.signal_e[2], p.spread_px);
    separator = ",\n";
  }
  return text + "\n]}\n";
}

}  // namespace lowlux::cli
