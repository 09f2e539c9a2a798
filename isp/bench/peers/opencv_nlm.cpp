#include <array>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/photo.hpp>

#include "isp/bench/peers/nl_means.h"

namespace lowlux::isp {
namespace {

constexpr int template_px = 7, search_px = 21;

// cv::Mat has no constant view; input data is not written to.
cv::Mat mat(const std::uint8_t* data, int columns, int rows, int channels) {
  return {rows, columns, CV_8UC(channels), const_cast<std::uint8_t*>(data)};
}

cv::Mat mat(const NlMeansPicture& picture) { return mat(picture.rgb, picture.columns, picture.rows, 3); }

template <class Work>
bool done(const Work& work) noexcept {
  try {
    work();
    return true;
  } catch (...) {
    return false;  // out of memory, or an input that OpenCV's checks refuse
  }
}

bool denoise(const NlMeansPicture& from, const NlMeansPicture& to, double lightness, double colour) noexcept {
  return done([&] {
    cv::Mat bgr, out;
    cv::cvtColor(mat(from), bgr, cv::COLOR_RGB2BGR);
    cv::fastNlMeansDenoisingColored(bgr, out, static_cast<float>(lightness), static_cast<float>(colour), template_px,
                                    search_px);
    cv::Mat result = mat(to);
    cv::cvtColor(out, result, cv::COLOR_BGR2RGB);
  });
}

// The conversions are those of fastNlMeansDenoisingColored in OpenCV 4.6, which treats codes as linear light.
bool split(const NlMeansPicture& from, std::uint8_t* lightness, std::uint8_t* colour) noexcept {
  return done([&] {
    cv::Mat lab;
    cv::cvtColor(mat(from), lab, cv::COLOR_LRGB2Lab);
    std::array parts{mat(lightness, from.columns, from.rows, 1), mat(colour, from.columns, from.rows, 2)};
    constexpr std::array from_to{0, 0, 1, 1, 2, 2};
    cv::mixChannels(&lab, 1, parts.data(), parts.size(), from_to.data(), 3);
  });
}

bool filter(const std::uint8_t* from, std::uint8_t* to, int columns, int rows, int channels, double strength) noexcept {
  return done([&] {
    cv::Mat out = mat(to, columns, rows, channels);
    cv::fastNlMeansDenoising(mat(from, columns, rows, channels), out, static_cast<float>(strength), template_px,
                             search_px);
  });
}

bool join(const std::uint8_t* lightness, const std::uint8_t* colour, const NlMeansPicture& to) noexcept {
  return done([&] {
    const std::array parts{mat(lightness, to.columns, to.rows, 1), mat(colour, to.columns, to.rows, 2)};
    cv::Mat lab(to.rows, to.columns, CV_8UC3);
    constexpr std::array from_to{0, 0, 1, 1, 2, 2};
    cv::mixChannels(parts.data(), parts.size(), &lab, 1, from_to.data(), 3);
    cv::Mat result = mat(to);
    cv::cvtColor(lab, result, cv::COLOR_Lab2LRGB);
  });
}

constexpr NlMeans functions{denoise, split, filter, join};

}  // namespace

const NlMeans* lowlux_nl_means() noexcept {
  cv::setNumThreads(1);
  return &functions;
}

}  // namespace lowlux::isp
