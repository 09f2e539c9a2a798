#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace lowlux::cli {

/// Selects the kind of values that a setting has.
enum class SettingKind : std::uint8_t { number, whole, text };

/// Describes a key of a spec and the option of `lowlux simulate` that it sets.
struct Setting {
  std::string_view key;
  std::string_view flag;
  SettingKind kind;
};

/// Returns all settings.
std::span<const Setting> settings();

}  // namespace lowlux::cli
