#pragma once

#include <array>

/// The row kernels of NightLookGrid are dispatched at run time. They take plain types only: their source is compiled
/// for several instruction sets, which must not have inline code in common.
namespace lowlux::isp::rows {

/// Tabulates night_eye() over log2 of luminances [cd/m2] and of S/P, linear between nodes and constant beyond the ends.
struct EyeTables {
  static constexpr int lights = 256;  // log2 L from -20 to 14
  static constexpr int ratios = 32;   // S/P from 0.1 to 60
  static constexpr float first_log2_light = -20, last_log2_light = 14;
  static constexpr float first_log2_ratio = -3.3219281f, last_log2_ratio = 5.9068906f;

  std::array<float, lights * ratios> m;     // before it is clamped to 0..1; row: S/P
  std::array<float, lights> blue;           // rod_blue()
  std::array<float, lights> variance_deg2;  // blur_std_deg()^2
  float chroma_scale;                       // 1 / s(100)
  float half_saturation_cd_m2;
};

struct LightRow {
  const float* camera[3];
};
struct LightWeights {
  float photopic[3];
  float scotopic[3];
  float clip;
};
/// Computes the photopic and scotopic light of one row of camera RGB, each channel first limited to at most clip. A
/// sample that is not a number counts as 0, one beyond +-1e9 as +-1e9.
void light_row(const LightRow& in, const LightWeights& weights, int n, float* photopic, float* scotopic);

/// Computes the eye's response to one row of adaptation [cd/m2; scotopic cd/m2]: for LookGrid the rods' fraction
/// relative to white, chroma and blue; variance of the blur [deg^2].
struct EyeRow {
  float* rod_fraction;
  float* chroma;
  float* blue;
  float* variance_deg2;
};
void eye_row(const EyeTables& tables, float scotopic_ratio_of_white, const float* photopic, const float* scotopic,
             int n, const EyeRow& out);

}  // namespace lowlux::isp::rows
