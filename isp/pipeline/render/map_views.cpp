#include "isp/pipeline/render/map_views.h"

#include <cstddef>
#include <cstring>

namespace lowlux::isp {

denoise::DenoiseMaps views_of(NoiseMaps& maps) {
  return {.residual_variance = maps.residual_variance_e2.view(),
          .chroma_confidence = maps.chroma_confidence.view(),
          .site_variance = {maps.site_variance_e2[0].view(), maps.site_variance_e2[1].view(),
                            maps.site_variance_e2[2].view()}};
}

void fit(NoiseMaps& maps, int width, int height) {
  const int columns = (width + 1) / 2, rows = (height + 1) / 2;
  fit(maps.residual_variance_e2, columns, rows);
  fit(maps.chroma_confidence, columns, rows);
  for (Plane<float>& plane : maps.site_variance_e2) fit(plane, columns, rows);
}

denoise::DenoiseMaps crop_of(const denoise::DenoiseMaps& maps, const Rect& sites) {
  if (maps.residual_variance.data == nullptr) return {};
  const auto cells = [&](const PlaneView<float>& map) {
    return map.crop(sites.x / 2, sites.y / 2, (sites.width + 1) / 2, (sites.height + 1) / 2);
  };
  return {.residual_variance = cells(maps.residual_variance),
          .chroma_confidence = cells(maps.chroma_confidence),
          .site_variance = {cells(maps.site_variance[0]), cells(maps.site_variance[1]), cells(maps.site_variance[2])}};
}

void copy(const PlaneView<float>& from, const PlaneView<float>& to) {
  for (int y = 0; y < to.height; ++y)
    std::memcpy(to.row(y), from.row(y), static_cast<std::size_t>(to.width) * sizeof(float));
}

void copy(const denoise::DenoiseMaps& from, const denoise::DenoiseMaps& to) {
  if (to.residual_variance.data == nullptr) return;
  copy(from.residual_variance, to.residual_variance);
  copy(from.chroma_confidence, to.chroma_confidence);
  for (std::size_t c = 0; c < 3; ++c) copy(from.site_variance[c], to.site_variance[c]);
}

}  // namespace lowlux::isp
