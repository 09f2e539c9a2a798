#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace lowlux::cli {

/// Selects the kind of values that a setting has. Even numbers are drawn from ranges whose limits are even.
enum class SettingKind : std::uint8_t { number, whole, even, text };

/// Describes a key of a spec and the option of `lowlux simulate` that it sets.
struct Setting {
  std::string_view key;
  std::string_view flag;
  SettingKind kind;
};

/// Returns all settings.
std::span<const Setting> settings();

}  // namespace lowlux::cli
