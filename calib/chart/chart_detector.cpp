#include "calib/chart/chart_detector.h"

#include <algorithm>
#include <cstddef>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/mcc.hpp>

namespace lowlux::calib {

int lowlux_detect_charts(const DetectorPicture& picture, ChartShape* shapes, int capacity) noexcept {
  try {
    // cv::Mat has no constant view; the detector only reads.
    const cv::Mat bgr(picture.height, picture.width, CV_8UC3, const_cast<std::uint8_t*>(picture.bgr));
    const cv::Ptr<cv::mcc::CCheckerDetector> detector = cv::mcc::CCheckerDetector::create();
    if (!detector->process(bgr, cv::mcc::MCC24, capacity)) return 0;
    const std::vector<cv::Ptr<cv::mcc::CChecker>> charts = detector->getListColorChecker();
    const int count = std::min(capacity, static_cast<int>(charts.size()));
    for (int i = 0; i < count; ++i) {
      const std::vector<cv::Point2f> box = charts[static_cast<std::size_t>(i)]->getBox();
      if (box.size() != 4) return -1;
      for (std::size_t k = 0; k < 4; ++k) shapes[i].corner[k] = {box[k].x, box[k].y};
      shapes[i].cost = charts[static_cast<std::size_t>(i)]->getCost();
    }
    return count;
  } catch (...) {
    return -1;  // out of memory, or an input that OpenCV's checks reject
  }
}

}  // namespace lowlux::calib
