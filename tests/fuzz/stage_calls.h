#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tests/fuzz/stage_draws.h"
#include "tests/fuzz/stage_profile_file.h"

namespace lowlux::test {

/// Memory that a stage renders into, as large as it says.
struct StagePlanes {
  explicit StagePlanes(const lowlux_stage_output& layout) {
    picture.size = sizeof picture;
    picture.planes = layout.planes;
    for (int i = 0; i < layout.planes; ++i) {
      bytes[i].resize(layout.bytes[i]);
      picture.plane[i] = {bytes[i].data(), bytes[i].size(), layout.stride[i]};
    }
  }
  std::vector<std::uint8_t> bytes[LOWLUX_STAGE_MAX_PLANES];
  lowlux_stage_picture picture{};
};

/// A stage that is called in any order, rightly and wrongly: what the header promises of each answer holds, and in the
/// end it works like a fresh one.
class StageCalls {
 public:
  explicit StageCalls(FuzzInput& in) : in_(in) {}
  ~StageCalls() { lowlux_stage_release(stage_); }
  StageCalls(const StageCalls&) = delete;
  StageCalls& operator=(const StageCalls&) = delete;

  void run() {
    query();
    open();
    if (stage_ == nullptr) return;
    if (in_.below(8) != 0) configure();
    for (int calls = 1 + in_.below(8); calls > 0; --calls) {
      switch (in_.below(4)) {
        case 0:
          configure();
          break;
        case 1:
          require(lowlux_stage_reset(stage_) == LOWLUX_STAGE_OK);
          break;
        default:
          process();
      }
    }
    work_like_a_fresh_one();
  }

 private:
  void query() {
    Handed<lowlux_stage_format_info> handed(in_);
    const lowlux_stage_input asked = any_input(in_);
    const int code = lowlux_stage_query(asked.api, asked.fourcc, asked.modifier, handed.get());
    if (!handed.is_known()) {
      require(code == LOWLUX_STAGE_BAD_ARGUMENT && handed.is_untouched());
      return;
    }
    require(code == LOWLUX_STAGE_OK || (code == LOWLUX_STAGE_UNSUPPORTED && handed.is_untouched()));
    if (code != LOWLUX_STAGE_OK) return;
    const lowlux_stage_format_info told = handed.value();
    require(handed.keeps_the_rest() && told.bits >= 8 && told.bits <= 16 && told.mosaic >= -1 && told.mosaic <= 3);
    require(told.group_pixels >= 1 && told.group_bytes >= 1 && told.outputs >= 1 && told.outputs <= 8);
  }

  lowlux_stage_settings any_settings() {
    lowlux_stage_settings out{};
    out.threads = in_.below(3);
    out.most_denoise = in_.below(4);
    out.temporal = in_.below(2);
    out.look = in_.below(2);
    out.tone = in_.below(2);
    if (in_.below(4) == 0) out.memory_limit = in_.take<std::uint32_t>() >> 2U;  // below the 1 GiB that is usual
    if (in_.below(8) == 0) out.field_of_view_deg = in_.take<double>();
    if (in_.below(8) == 0) {
      std::int32_t* const figures[] = {&out.threads, &out.most_denoise, &out.temporal, &out.look, &out.tone};
      std::int32_t& wrong = *figures[in_.below(5)];
      wrong = in_.take<std::int32_t>();
      if (out.threads > 8) out.threads = 9;
    }
    return out;
  }

  void open() {
    settings_ = any_settings();
    switch (in_.below(4)) {
      case 1:
        profile_.emplace(any_profile_text(in_));
        settings_.profile_file = profile_->name();
        break;
      case 2:
        settings_.profile_file = in_.below(2) == 0 ? "" : "/absent";
        break;
      default:
        break;
    }
    Handed handed(settings_, in_);
    std::vector<char> message(static_cast<std::size_t>(in_.below(200)), 'x');
    const int code =
        lowlux_stage_open(handed.get(), &stage_, message.empty() ? nullptr : message.data(), message.size());
    require((code == LOWLUX_STAGE_OK) == (stage_ != nullptr) && handed.is_untouched());
    require(handed.is_known() || code == LOWLUX_STAGE_BAD_ARGUMENT);
    require(code == LOWLUX_STAGE_OK || code == LOWLUX_STAGE_BAD_ARGUMENT || code == LOWLUX_STAGE_BAD_PROFILE);
    require(code != LOWLUX_STAGE_BAD_PROFILE || settings_.profile_file != nullptr);
    const bool has_file = settings_.profile_file == nullptr || profile_;
    require(code != LOWLUX_STAGE_OK || has_file);
    if (message.empty()) return;
    const auto end = std::ranges::find(message, '\0');
    require(end != message.end());
    const std::string_view said(message.data(), static_cast<std::size_t>(end - message.begin()));
    require(code == LOWLUX_STAGE_OK ? said.empty() : message.size() == 1 || is_message(said));
  }

  /// An answer of the stage's, which has a name and, if it is an error, says more.
  int answered(int code) const {
    require(code <= LOWLUX_STAGE_ADJUSTED && code > LOWLUX_STAGE_INTERNAL);
    require(code >= 0 || is_message(lowlux_stage_last_error(stage_)));
    return code;
  }

  lowlux_stage_input any_stream() {
    const bool plain = in_.below(4) != 0;
    lowlux_stage_input out = plain ? any_format(in_) : any_input(in_);
    if (plain) {
      out.width = 2 + in_.below(max_pixels - 1);
      out.height = 2 + in_.below(max_pixels - 1);
    }
    if (in_.below(8) == 0) out.stride = in_.take<std::uint16_t>();
    if (in_.below(8) == 0) {
      constexpr std::int32_t odd[] = {
          -1, 0, 1, 65537, std::numeric_limits<std::int32_t>::max(), std::numeric_limits<std::int32_t>::min()};
      (in_.below(2) == 0 ? out.width : out.height) = odd[in_.below(6)];
    }
    if (in_.below(16) == 0) out.width = out.height = 65536;  // more than the limit of memory
    if (in_.below(16) == 0) out.api = in_.take<std::int32_t>();
    return out;
  }

  void configure() {
    const lowlux_stage_input stream = any_stream();
    const lowlux_stage_output asked = any_output(in_);
    Handed in(stream, in_);
    Handed out(asked, in_);
    const int code = answered(lowlux_stage_configure(stage_, in.get(), out.get()));
    require(in.is_untouched());
    if (!in.is_known() || !out.is_known()) {  // nothing changes
      require(code == LOWLUX_STAGE_BAD_ARGUMENT && out.is_untouched());
      return;
    }
    stream_.reset();
    require(code >= 0 ? out.keeps_the_rest() : out.is_untouched());
    if (code < 0) return;
    layout_ = out.value();
    stream_ = stream;
    require(layout_.width >= 1 && layout_.height >= 1 && layout_.planes >= 1 && layout_.planes <= 2);
    for (int i = 0; i < layout_.planes; ++i) require(layout_.bytes[i] > 0 && layout_.stride[i] > 0);
  }

  lowlux_stage_params any_params() {
    auto out = in_.below(4) != 0 ? possible_params(in_) : in_.take<lowlux_stage_params>();
    if (in_.below(8) == 0) out.valid |= in_.take<std::uint32_t>();
    return out;
  }

  /// Codes for a frame of the stream, the input over and over.
  std::vector<std::uint8_t> any_codes(std::size_t stride, int rows) const {
    std::vector<std::uint8_t> out(stride * static_cast<std::size_t>(rows));
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = in_.left > 0 ? in_.data[i % in_.left] : 0;
    return out;
  }

  void process() {
    const lowlux_stage_params drawn = any_params();
    Handed params(drawn, in_);
    Handed<lowlux_stage_result> result(in_);
    Handed<lowlux_stage_statistics> statistics(in_);
    const int left_out = in_.below(8);  // bits: params, result, statistics
    StagePlanes planes(stream_ ? layout_ : lowlux_stage_output{});
    Handed picture(planes.picture, in_);
    const std::vector<std::uint8_t> codes = any_codes(longest_row, max_pixels);
    const lowlux_stage_source source{codes.data(), codes.size(), longest_row, -1};
    const bool has_params = (left_out & 1) == 0, has_result = (left_out & 2) == 0, counts = (left_out & 4) == 0;
    const int code =
        answered(lowlux_stage_process(stage_, &source, picture.get(), has_params ? params.get() : nullptr,
                                      has_result ? result.get() : nullptr, counts ? statistics.get() : nullptr));
    require(params.is_untouched() && picture.is_untouched() && code <= LOWLUX_STAGE_OK);
    if (code != LOWLUX_STAGE_OK) require(result.is_untouched() && statistics.is_untouched());
    if (!picture.is_known() || (has_params && !params.is_known()) || (has_result && !result.is_known()) ||
        (counts && !statistics.is_known())) {
      require(code == LOWLUX_STAGE_BAD_ARGUMENT);
      return;
    }
    if (!stream_) return require(code == LOWLUX_STAGE_NOT_CONFIGURED);
    const std::uint32_t known = LOWLUX_STAGE_HAS_ALL;
    if (has_params && (drawn.valid & ~known) != 0) return require(code == LOWLUX_STAGE_BAD_PARAMETER);
    if (code != LOWLUX_STAGE_OK) return;
    require(result.keeps_the_rest() && statistics.keeps_the_rest());
    if (has_result) check(result.value());
    if (counts) check(statistics.value());
  }

  static void check(const lowlux_stage_result& told) {
    for (const float black : told.black_level) require(std::isfinite(black));
    for (const float figure : {told.noise_gain, told.noise_read, told.took_ms, told.predicted_ms}) {
      require(figure >= 0 && std::isfinite(figure));
    }
    require(std::isfinite(told.exposure_ev) && told.moved >= 0 && told.moved <= 1);
    require(told.level >= LOWLUX_STAGE_LEVEL_NONE && told.level <= LOWLUX_STAGE_LEVEL_HIGH);
    require(told.step >= LOWLUX_STAGE_STEP_ALL && told.step <= LOWLUX_STAGE_STEP_PLAIN);
    require((told.applied & ~static_cast<std::uint32_t>(LOWLUX_STAGE_HAS_ALL)) == 0);
    require(told.adaptation >= 0 && told.adaptation <= 1);
  }

  static void check(const lowlux_stage_statistics& counted) {
    for (const float share : {counted.clipped, counted.zero}) require(share >= 0 && share <= 1);
    for (std::size_t i = 0; i < std::size(counted.luma64); ++i) {
      const std::uint32_t* const sixteen = counted.luma + 16 * i;
      require(counted.luma64[i] == std::accumulate(sixteen, sixteen + 16, 0U));
    }
    for (const float black : counted.measured_black) require(std::isfinite(black));
  }

  /// A frame of a stream that every stage takes: @return its picture, nothing where profile or limit have a say
  std::optional<std::vector<std::uint8_t>> plain_frame(lowlux_stage* stage) const {
    constexpr int side = 16;
    lowlux_stage_input in{};
    in.size = sizeof in;
    in.fourcc = LOWLUX_STAGE_FOURCC('R', 'G', '1', '0');
    in.width = in.height = side;
    lowlux_stage_output out{};
    out.size = sizeof out;
    out.fourcc = LOWLUX_STAGE_BGR888;
    const int configured = lowlux_stage_configure(stage, &in, &out);
    if (configured != LOWLUX_STAGE_OK) {
      require((configured == LOWLUX_STAGE_TOO_LARGE && settings_.memory_limit != 0) ||
              (configured == LOWLUX_STAGE_BAD_PROFILE && settings_.profile_file != nullptr));
      return std::nullopt;
    }
    std::vector<std::uint8_t> codes(std::size_t{2} * side * side);
    for (std::size_t i = 0; i < codes.size(); ++i) codes[i] = static_cast<std::uint8_t>(i % 2 == 0 ? 37 * i : i % 4);
    const lowlux_stage_source source{codes.data(), codes.size(), std::size_t{2} * side, -1};
    lowlux_stage_params params{};
    params.size = sizeof params;
    params.valid = LOWLUX_STAGE_HAS_BLACK | LOWLUX_STAGE_HAS_SCENE_LUMINANCE;
    params.scene_luminance_cd_m2 = 0.5;
    StagePlanes planes(out);
    const int code = lowlux_stage_process(stage, &source, &planes.picture, &params, nullptr, nullptr);
    require(code == LOWLUX_STAGE_OK || settings_.profile_file != nullptr);
    if (code != LOWLUX_STAGE_OK) return std::nullopt;
    return planes.bytes[0];
  }

  void work_like_a_fresh_one() const {
    lowlux_stage_settings settings = settings_;
    settings.size = sizeof settings;
    lowlux_stage* fresh = nullptr;
    require(lowlux_stage_open(&settings, &fresh, nullptr, 0) == LOWLUX_STAGE_OK);
    const auto expected = plain_frame(fresh), found = plain_frame(stage_);
    lowlux_stage_release(fresh);
    require(expected == found);
  }

  static constexpr std::size_t longest_row = 160;  // of max_pixels, whatever the format
  FuzzInput& in_;
  lowlux_stage_settings settings_{};
  std::optional<NamedText> profile_;
  lowlux_stage* stage_ = nullptr;
  std::optional<lowlux_stage_input> stream_;  // it is configured for
  lowlux_stage_output layout_{};
};

}  // namespace lowlux::test
