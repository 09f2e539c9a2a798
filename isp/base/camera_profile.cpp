#include "isp/base/camera_profile.h"

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>

#include "isp/base/text.h"

namespace lowlux {
namespace {

/// Returns whether the model begins with the first word of the make.
bool repeats(std::string_view make, std::string_view model) {
  const std::string_view word = make.substr(0, make.find(' '));
  return model.size() > word.size() && model[word.size()] == ' ' &&
         std::ranges::equal(word, model.substr(0, word.size()), {}, ascii_lower, ascii_lower);
}

std::string lower_case(std::string_view text) {
  std::string out(text);
  std::ranges::transform(out, out.begin(), ascii_lower);
  return out;
}

/// Returns a model in lower case, without the words that decoders leave out at its end.
std::string model_key(std::string_view model) {
  constexpr std::string_view ending = " digital camera";
  std::string out = lower_case(model);
  if (out.size() > ending.size() && out.ends_with(ending)) out.erase(out.size() - ending.size());
  return out;
}

/// Returns whether `text` ends with these words.
bool ends_with_words(std::string_view text, std::string_view words) {
  return text == words || (text.ends_with(words) && text[text.size() - words.size() - 1] == ' ');
}

}  // namespace

std::string camera_name(std::string_view make, std::string_view model) {
  if (make.empty() || repeats(make, model)) return std::string(model);
  if (model.empty()) return std::string(make);
  return std::string(make).append(" ").append(model);
}

bool is_same_camera(const CameraName& one, const CameraName& other) {
  constexpr std::size_t longest = 256;  // makes are searched in each other
  const std::size_t length = std::max({one.make.size(), one.model.size(), other.make.size(), other.model.size()});
  if (length > longest) return one.make == other.make && one.model == other.model;
  if (one.make.empty() != other.make.empty() || one.model.empty() != other.model.empty()) return false;
  const std::string make_a = lower_case(one.make), make_b = lower_case(other.make);
  const std::string model_a = model_key(one.model), model_b = model_key(other.model);
  const bool makes_agree = make_a.find(make_b) != std::string::npos || make_b.find(make_a) != std::string::npos ||
                           model_a.starts_with(make_b) || model_b.starts_with(make_a);
  return makes_agree && (ends_with_words(model_a, model_b) || ends_with_words(model_b, model_a));
}

bool may_be_same_camera(const CameraName& one, const CameraName& other) {
  const auto completed = [](std::string_view name, std::string_view by) { return name.empty() ? by : name; };
  return is_same_camera({completed(one.make, other.make), completed(one.model, other.model)},
                        {completed(other.make, one.make), completed(other.model, one.model)});
}

}  // namespace lowlux
