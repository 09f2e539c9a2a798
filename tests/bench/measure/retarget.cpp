// Images for dim displays: how alike they look by several models.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <string>
#include <thread>
#include <vector>

#include "isp/metrics/gamut_ratio.h"
#include "isp/model/appearance/appearance_model.h"
#include "isp/model/colour/colour_difference.h"
#include "isp/render/output_space.h"
#include "isp/render/retarget/retarget.h"
#include "isp/render/retarget/retarget_table.h"
#include "isp/reproduce/bench_picture.h"
#include "tests/bench/measure/measure.h"

namespace lowlux::isp {
namespace {

constexpr double source_cd_m2 = 250;
constexpr std::size_t colours_of_a_picture = 60000;

constexpr const char* judges[]{"shin", "wanat_mantiuk", "mikamo", "icam06"};

struct Space {
  Matrix3 to_xyz = rgb_to_xyz(primaries_rec709).value();
  Xyz white = xyz_of(to_xyz * Vector3{1, 1, 1});
};

/// sRGB codes of pixels spread over a picture, one in so many rows and columns.
std::vector<Vector3> codes_of(const BenchPicture& picture) {
  std::vector<Vector3> out;
  const auto& plane = picture.linear.plane;
  const std::size_t every = std::max<std::size_t>(1, plane[0].size() / colours_of_a_picture);
  out.reserve(plane[0].size() / every + 1);
  for (std::size_t i = 0; i < plane[0].size(); i += every) {
    Vector3 code{};
    for (std::size_t c = 0; c < 3; ++c) {
      code[c] = encode_transfer(OutputSpace::srgb, std::clamp(static_cast<double>(plane[c].data()[i]), 0.0, 1.0));
    }
    out.push_back(code);
  }
  return out;
}

struct Eye {
  ColourMap map;
  Xyz white;  // colours are relative to
};

std::vector<Lab> seen(const std::vector<Vector3>& codes, const Eye& eye) {
  static const Space space;
  std::vector<Lab> out;
  out.reserve(codes.size());
  for (const Vector3& code : codes) {
    Vector3 light{};
    for (std::size_t c = 0; c < 3; ++c) light[c] = decode_transfer(OutputSpace::srgb, code[c]);
    out.push_back(lab_of(eye.map(xyz_of(space.to_xyz * light)), eye.white));
  }
  return out;
}

/// Mikamo's neutrals are coloured in the dark: its colours are taken relative to its own white.
Eye eye_of(const char* model, double white_cd_m2, ShinUnits units) {
  ViewingConditions conditions;
  conditions.white_cd_m2 = white_cd_m2;
  conditions.white = Space().white;
  conditions.shin_units = units;
  Eye eye{test::value_of(test::value_of(appearance_model_named(model)).at(conditions)), conditions.white};
  if (std::strcmp(model, "mikamo") == 0) eye.white = eye.map(conditions.white);
  return eye;
}

RetargetOptions options_for(RetargetMethod method, double display_cd_m2, ShinUnits units) {
  RetargetOptions options;
  options.method = method;
  options.source_cd_m2 = source_cd_m2;
  options.display_cd_m2 = display_cd_m2;
  options.units = units;
  return options;
}

CodeMap code_map(const RetargetOptions& options) {
  return [map = test::value_of(retargeting(options))](const Vector3& code) { return map(code).code; };
}

struct Score {
  double delta_e_94c = 0;
  double lightness = 0;
  GamutRatio gamut;
};

Score score(const std::vector<Lab>& original, const std::vector<Lab>& test) {
  Score out;
  for (std::size_t i = 0; i < original.size(); ++i) {
    out.delta_e_94c += delta_e_94c(original[i], test[i]) / static_cast<double>(original.size());
    out.lightness += std::abs(original[i].l - test[i].l) / static_cast<double>(original.size());
  }
  out.gamut = gamut_ratio(original, test);
  return out;
}

/// Rows: pictures and methods; for each judge mean Delta E 94c, EGR (convex) [%] and mean |Delta L*|.
void compare_methods(const std::string& folder, double display_cd_m2, ShinUnits units, Executor& executor) {
  std::printf("\n%g -> %g cd/m2, coefficients by %s\n%-17s%-17s", source_cd_m2, display_cd_m2,
              units == ShinUnits::lux ? "lux" : "luminance", "picture", "method");
  for (const char* judge : judges) std::printf("| %-20s ", judge);
  std::printf("\n");
  std::vector<RetargetTable> tables;
  tables.reserve(retarget_methods.size());
  for (const auto& named : retarget_methods) {
    tables.push_back(tabulated(code_map(options_for(named.method, display_cd_m2, units)), 33, executor));
  }
  for (const std::string_view file : files_of(PictureSet::all)) {
    const auto picture = test::value_of(read_bench_picture(folder + "/" + std::string(file), 0, 0, executor));
    const std::vector<Vector3> codes = codes_of(picture);
    std::vector<std::vector<Lab>> originals;
    originals.reserve(std::size(judges));
    for (const char* judge : judges) originals.push_back(seen(codes, eye_of(judge, source_cd_m2, units)));
    for (std::size_t m = 0; m < tables.size(); ++m) {
      std::vector<Vector3> shown;
      shown.reserve(codes.size());
      for (const Vector3& code : codes) shown.push_back(looked_up(tables[m], code));
      std::printf("%-17s%-17s", std::string(file).c_str(), std::string(retarget_methods[m].name).c_str());
      for (std::size_t j = 0; j < originals.size(); ++j) {
        const Score s = score(originals[j], seen(shown, eye_of(judges[j], display_cd_m2, units)));
        std::printf("| %6.2f %6.1f %6.2f ", s.delta_e_94c, s.gamut.convex_percent, s.lightness);
      }
      std::printf("\n");
      std::fflush(stdout);
    }
  }
}

}  // namespace
}  // namespace lowlux::isp

int lowlux::test::measure_retarget(Arguments& arguments) {
  const double display_cd_m2 = arguments.option("--display", 2.0, 0.0);
  const std::string folder = arguments.required("PICTURES");
  arguments.end();
  PoolExecutor executor(std::max(1, static_cast<int>(std::thread::hardware_concurrency())));
  for (const isp::ShinUnits units : {isp::ShinUnits::luminance_as_is, isp::ShinUnits::lux}) {
    isp::compare_methods(folder, display_cd_m2, units, executor);
  }
  return 0;
}
