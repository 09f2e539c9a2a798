#include <array>
#include <string>

#include "isp/model/appearance/appearance_model.h"
#include "isp/model/appearance/cao.h"
#include "isp/model/appearance/entropy_model.h"
#include "isp/model/appearance/hunt.h"
#include "isp/model/appearance/icam06.h"
#include "isp/model/appearance/khan_pattanaik.h"
#include "isp/model/appearance/kirk_obrien.h"
#include "isp/model/appearance/kwak.h"
#include "isp/model/appearance/mikamo.h"
#include "isp/model/appearance/shin.h"
#include "isp/model/appearance/wanat_mantiuk.h"

namespace lowlux::isp {

std::span<const AppearanceModel> appearance_models() {
  static const std::array models{hunt_appearance(),   kwak_appearance(),         khan_pattanaik_appearance(),
                                 shin_appearance(),   icam06_appearance(),       entropy_appearance(),
                                 cao_appearance(),    kirk_obrien_appearance(),  filament_appearance(),
                                 mikamo_appearance(), wanat_mantiuk_appearance()};
  return models;
}

Result<AppearanceModel> appearance_model_named(std::string_view name) {
  std::string known;
  for (const AppearanceModel& model : appearance_models()) {
    if (model.name == name) return model;
    known += known.empty() ? "" : ", ";
    known += model.name;
  }
  return fail(ErrorCode::invalid_argument,
              "unknown model of colour appearance \"" + std::string(name) + "\"; there are " + known,
              std::string(name));
}

}  // namespace lowlux::isp
