#include "isp/base/camera_profile.h"

#include <algorithm>

#include "isp/base/text.h"

namespace lowlux {
namespace {

/// Returns whether the model begins with the first word of the make.
bool repeats(std::string_view make, std::string_view model) {
  const std::string_view word = make.substr(0, make.find(' '));
  return model.size() > word.size() && model[word.size()] == ' ' &&
         std::ranges::equal(word, model.substr(0, word.size()), {}, ascii_lower, ascii_lower);
}

}  // namespace

std::string camera_name(std::string_view make, std::string_view model) {
  if (make.empty() || repeats(make, model)) return std::string(model);
  if (model.empty()) return std::string(make);
  return std::string(make).append(" ").append(model);
}

}  // namespace lowlux
