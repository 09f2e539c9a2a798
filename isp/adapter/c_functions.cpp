#include "isp/adapter/lowlux_stage.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <memory>
#include <new>
#include <type_traits>
#include <utility>

#include "isp/adapter/stage.h"

/// The C functions check sizes of structs and null pointers, and let no exception out.
struct lowlux_stage {
  std::unique_ptr<lowlux::isp::Stage> stage;
};

namespace {

using lowlux::Error;
using lowlux::ErrorCode;
using lowlux::isp::Stage;

constexpr std::size_t largest_struct = 65536;

/// Returns the size of a struct that ended before a member, with its padding.
template <class T>
constexpr std::size_t size_before(std::size_t offset) {
  return (offset + alignof(T) - 1) / alignof(T) * alignof(T);
}

// Sizes that structs had in earlier versions of the header, before they grew.
template <class T>
constexpr std::array<std::size_t, 2> earlier_sizes{sizeof(T), sizeof(T)};
template <>
constexpr std::array<std::size_t, 2> earlier_sizes<lowlux_stage_settings>{
    size_before<lowlux_stage_settings>(offsetof(lowlux_stage_settings, demosaic)), sizeof(lowlux_stage_settings)};
template <>
constexpr std::array<std::size_t, 2> earlier_sizes<lowlux_stage_params>{
    size_before<lowlux_stage_params>(offsetof(lowlux_stage_params, budget_ms)),
    size_before<lowlux_stage_params>(offsetof(lowlux_stage_params, max_exposure_s))};
template <>
constexpr std::array<std::size_t, 2> earlier_sizes<lowlux_stage_result>{
    size_before<lowlux_stage_result>(offsetof(lowlux_stage_result, step)),
    size_before<lowlux_stage_result>(offsetof(lowlux_stage_result, advised_exposure_s))};

template <class T>
bool is_of_a_version(const T& of_caller) {
  return std::ranges::find(earlier_sizes<T>, of_caller.size) != earlier_sizes<T>.end() ||
         (of_caller.size >= sizeof(T) && of_caller.size <= largest_struct);
}

/// Copies the common part of a caller's struct; false if its size is invalid.
template <class T>
bool take(const T* from, T& to) {
  static_assert(std::is_trivially_copyable_v<T>);
  if (from == nullptr || !is_of_a_version(*from)) return false;
  std::memcpy(&to, from, std::min(from->size, sizeof(T)));
  return true;
}

/// Copies the common part of an answer to the caller, and keeps the caller's size.
template <class T>
void give(T answer, T* to) {
  if (to == nullptr) return;
  answer.size = to->size;
  std::memcpy(to, &answer, std::min(to->size, sizeof(T)));
}

template <class T>
bool is_null_or_whole(const T* answer) {
  return answer == nullptr || is_of_a_version(*answer);
}

int code_of_opening(const Error& error) {
  return error.code == ErrorCode::invalid_argument ? LOWLUX_STAGE_BAD_ARGUMENT : LOWLUX_STAGE_BAD_PROFILE;
}

int code_of_configuring(const Error& error) {
  switch (error.code) {
    case ErrorCode::unsupported:
      return LOWLUX_STAGE_UNSUPPORTED;
    case ErrorCode::too_large:
      return LOWLUX_STAGE_TOO_LARGE;
    case ErrorCode::insufficient:
    case ErrorCode::malformed:
      return LOWLUX_STAGE_BAD_PROFILE;
    default:
      return LOWLUX_STAGE_BAD_ARGUMENT;
  }
}

void copy_message(const char* message, char* to, std::size_t size) {
  if (to == nullptr || size == 0) return;
  const std::size_t length = std::min(std::strlen(message), size - 1);
  std::memcpy(to, message, length);
  to[length] = '\0';
}

int open(const lowlux_stage_settings& settings, lowlux_stage** stage, char* message, std::size_t message_size) {
  auto opened = Stage::open(settings);
  if (!opened) {
    const Error& error = opened.error();
    const std::string place = error.where.empty() ? "" : error.where + ": ";
    copy_message((place + error.message).c_str(), message, message_size);
    return code_of_opening(error);
  }
  *stage = new lowlux_stage{*std::move(opened)};
  return LOWLUX_STAGE_OK;
}

}  // namespace

extern "C" {

uint32_t lowlux_stage_version(void) { return LOWLUX_STAGE_VERSION; }

int lowlux_stage_query(int32_t api, uint32_t fourcc, uint64_t modifier, lowlux_stage_format_info* info) {
  lowlux_stage_format_info answer{};
  if (!take(info, answer)) return LOWLUX_STAGE_BAD_ARGUMENT;
  const auto format = lowlux::isp::stage_input(api, fourcc, modifier);
  if (!format) return LOWLUX_STAGE_UNSUPPORTED;
  answer = {};
  lowlux::isp::describe(*format, answer);
  give(answer, info);
  return LOWLUX_STAGE_OK;
}

int lowlux_stage_open(const lowlux_stage_settings* settings, lowlux_stage** stage, char* message, size_t message_size) {
  copy_message("", message, message_size);
  if (stage == nullptr) return LOWLUX_STAGE_BAD_ARGUMENT;
  *stage = nullptr;
  lowlux_stage_settings own{};
  own.most_denoise = LOWLUX_STAGE_LEVEL_DRAFT;
  own.tone = 1;
  if (settings != nullptr && !take(settings, own)) {
    copy_message("the size of the settings struct does not match any version", message, message_size);
    return LOWLUX_STAGE_BAD_ARGUMENT;
  }
  try {
    return open(own, stage, message, message_size);
  } catch (const std::bad_alloc&) {
    copy_message("not enough memory", message, message_size);
    return LOWLUX_STAGE_NO_MEMORY;
  } catch (...) {
    copy_message("threads or memory cannot be allocated", message, message_size);
    return LOWLUX_STAGE_INTERNAL;
  }
}

int lowlux_stage_configure(lowlux_stage* stage, const lowlux_stage_input* in, lowlux_stage_output* out) {
  if (stage == nullptr) return LOWLUX_STAGE_BAD_ARGUMENT;
  Stage& own = *stage->stage;
  lowlux_stage_input input{};
  lowlux_stage_output output{};
  if (!take(in, input) || !take(out, output)) {
    return own.say(LOWLUX_STAGE_BAD_ARGUMENT, "a struct is missing, or its size does not match any version");
  }
  try {
    const auto configured = own.configure(input, output);
    if (!configured) return own.say(code_of_configuring(configured.error()), configured.error().message.c_str());
    give(output, out);
    return *configured;
  } catch (const std::bad_alloc&) {
    return own.say(LOWLUX_STAGE_NO_MEMORY, "not enough memory");
  } catch (...) {
    return own.say(LOWLUX_STAGE_INTERNAL, "an exception within lowlux");
  }
}

int lowlux_stage_process(lowlux_stage* stage, const lowlux_stage_source* in, const lowlux_stage_picture* out,
                         const lowlux_stage_params* params, lowlux_stage_result* result,
                         lowlux_stage_statistics* statistics) {
  if (stage == nullptr) return LOWLUX_STAGE_BAD_ARGUMENT;
  Stage& own = *stage->stage;
  lowlux_stage_picture picture{};
  lowlux_stage_params known{};
  known.size = sizeof known;
  if (in == nullptr || !take(out, picture) || (params != nullptr && !take(params, known)) ||
      !is_null_or_whole(result) || !is_null_or_whole(statistics)) {
    return own.say(LOWLUX_STAGE_BAD_ARGUMENT, "a struct is missing, or its size does not match any version");
  }
  lowlux_stage_result told{};
  lowlux_stage_statistics counted{};
  try {
    const int code = own.process(*in, picture, known,
                                 {result != nullptr ? &told : nullptr, statistics != nullptr ? &counted : nullptr});
    if (code != LOWLUX_STAGE_OK) return code;
  } catch (const std::bad_alloc&) {
    return own.say(LOWLUX_STAGE_NO_MEMORY, "not enough memory");
  } catch (...) {
    return own.say(LOWLUX_STAGE_INTERNAL, "an exception within lowlux");
  }
  give(told, result);
  give(counted, statistics);
  return LOWLUX_STAGE_OK;
}

int lowlux_stage_reset(lowlux_stage* stage) {
  if (stage == nullptr) return LOWLUX_STAGE_BAD_ARGUMENT;
  stage->stage->reset();
  return LOWLUX_STAGE_OK;
}

void lowlux_stage_release(lowlux_stage* stage) { delete stage; }

const char* lowlux_stage_last_error(const lowlux_stage* stage) {
  return stage == nullptr ? "" : stage->stage->last_error();
}

}  // extern "C"
