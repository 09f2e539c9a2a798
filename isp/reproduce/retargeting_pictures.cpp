#include "isp/reproduce/retargeting_pictures.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <filesystem>
#include <limits>
#include <utility>

#include "isp/metrics/gamut_ratio.h"
#include "isp/metrics/picture_comparison.h"
#include "isp/model/appearance/appearance_model.h"
#include "isp/render/output_space.h"
#include "isp/reproduce/bench_picture.h"

namespace lowlux::isp {
namespace {

/// Holds sRGB's primaries, and the white that results from them.
struct DisplaySpace {
  Matrix3 to_xyz = rgb_to_xyz(primaries_rec709).value();  // cannot fail for constants
  Xyz white = xyz_of(to_xyz * Vector3{1, 1, 1});
};

const DisplaySpace& display_space() {
  static const DisplaySpace space;
  return space;
}

PictureColours colours_of(const BenchPicture& picture, std::size_t most) {
  const auto& plane = picture.linear.plane;
  const int width = plane[0].width(), height = plane[0].height();
  const auto count = [&](int step) {
    return static_cast<std::size_t>((width + step - 1) / step) * static_cast<std::size_t>((height + step - 1) / step);
  };
  int step = 1;
  while (count(step) > most && step < std::max(width, height)) ++step;
  PictureColours out{picture.name, {}};
  out.codes.reserve(count(step));
  for (int y = 0; y < height; y += step) {
    for (int x = 0; x < width; x += step) {
      Vector3 code{};
      for (std::size_t c = 0; c < 3; ++c) {
        code[c] = encode_transfer(OutputSpace::srgb, std::clamp(static_cast<double>(plane[c].at(x, y)), 0.0, 1.0));
      }
      out.codes.push_back(code);
    }
  }
  return out;
}

Result<ColourMap> eye_at(double white_cd_m2, const Criterion& judge) {
  const auto model = appearance_model_named(judge.model);
  if (!model) return tl::make_unexpected(model.error());
  ViewingConditions conditions;
  conditions.white_cd_m2 = white_cd_m2;
  conditions.white = display_space().white;
  conditions.shin_units = judge.units;
  return model->at(conditions);
}

Lab seen(const ColourMap& eye, const Vector3& code) {
  Vector3 light{};
  for (std::size_t c = 0; c < 3; ++c) light[c] = decode_transfer(OutputSpace::srgb, code[c]);
  return lab_of(eye(xyz_of(display_space().to_xyz * light)), display_space().white);
}

struct Scoring {
  const std::vector<PictureColours>& pictures;
  const RetargetTable& shown;
  ColourMap by_source, by_display;
  std::vector<RetargetScore> scores;

  void score(std::size_t index) {
    const auto& codes = pictures[index].codes;
    std::vector<Lab> original, retargeted;
    original.reserve(codes.size());
    retargeted.reserve(codes.size());
    for (const Vector3& code : codes) {
      original.push_back(seen(by_source, code));
      retargeted.push_back(seen(by_display, looked_up(shown, code)));
    }
    scores[index].delta_e_94c = mean_delta_e_94c(original, retargeted);
    scores[index].gamut_percent = gamut_ratio(original, retargeted).convex_percent;
  }
};

}  // namespace

Result<std::vector<PictureColours>> retargeting_pictures(const std::string& folder, const Sampling& sampling,
                                                         Executor& executor) {
  assert(sampling.colours > 0);
  std::error_code ignored;
  if (!std::filesystem::is_directory(folder, ignored)) {
    return fail(
        ErrorCode::not_found,
        "there is no such folder of pictures: --pictures-folder names the testdata/pictures of lowlux's sources",
        folder);
  }
  const auto files = files_of(PictureSet::all);
  std::vector<PictureColours> out;
  out.reserve(files.size());
  for (const std::string_view file : files) {
    const std::string path = (std::filesystem::path(folder) / file).string();
    const auto picture = read_bench_picture(path, sampling.crop_px, sampling.crop_px, executor);
    if (!picture) return tl::make_unexpected(picture.error());
    out.push_back(colours_of(*picture, sampling.colours));
  }
  return out;
}

Result<std::vector<RetargetScore>> retarget_scores(const std::vector<PictureColours>& pictures, const Showing& showing,
                                                   const Criterion& judge, Executor& executor) {
  assert(showing.shown != nullptr);
  auto source = eye_at(showing.source_cd_m2, judge);
  if (!source) return tl::make_unexpected(source.error());
  auto display = eye_at(showing.display_cd_m2, judge);
  if (!display) return tl::make_unexpected(display.error());
  Scoring scoring{pictures, *showing.shown, *std::move(source), *std::move(display),
                  std::vector<RetargetScore>(pictures.size())};
  for_each_index(executor, static_cast<int>(pictures.size()),
                 [&](int index) { scoring.score(static_cast<std::size_t>(index)); });
  return std::move(scoring.scores);
}

}  // namespace lowlux::isp
