#include "isp/cli/finished/picture_verb.h"

#include <algorithm>
#include <cstdio>
#include <thread>

#include <fmt/format.h>

#include "isp/cli/shared/exit_code.h"
#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/machine.h"
#include "isp/cli/shared/outputs.h"
#include "isp/cli/shared/report.h"
#include "isp/output/picture/image_writer.h"

namespace lowlux::cli {
namespace {

int failed(const PictureVerb& verb, Error error) {
  const std::string& input = verb.inputs.front();
  error = with_file(std::move(error), input);
  return print_failure(input, error, object_if(verb.json));
}

}  // namespace

Result<void> write_made(const PictureVerb& verb, const Picture& picture, OutputSpace space,
                        const capture::ScenePicture& source, Executor& executor) {
  isp::WriteOptions write;
  write.overwrite = verb.force ? isp::Overwrite::yes : isp::Overwrite::no;
  write.software = "lowlux " + version_number();
  write.source_tags = source.source_tags;
  write.jpeg.quality = verb.jpeg_quality;
  write.exr.depth = verb.bits.value_or(16) == 16 ? isp::ExrOptions::Depth::half : isp::ExrOptions::Depth::full;
  const auto written = isp::write_picture(picture, space, source.info, verb.output, write, executor);
  if (!written) return fail(written.error().code, written.error().message, verb.output);
  return {};
}

int run_picture_verb(const PictureVerb& verb, const PictureWork& work) {
  const Result<isp::FileFormat> format = isp::format_of(verb.output);
  if (!format) return print_usage_error(verb.name, format.error(), object_if(verb.json));
  const Result<PictureKind> kind = picture_kind(*format, verb.bits, std::nullopt);
  if (!kind) return print_usage_error(verb.name, kind.error(), object_if(verb.json), verb.defaults);
  if (const std::string wrong = file_name_error({verb.output}, verb.inputs); !wrong.empty()) {
    return print_usage_error(verb.name, {ErrorCode::invalid_argument, wrong, "-o"}, object_if(verb.json));
  }
  if (const auto place = check_output_path(verb.output, verb.force); !place) return failed(verb, place.error());
  PoolExecutor executor(std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 8));
  const Result<std::vector<std::string>> warnings = work(*kind, executor);
  if (!warnings) return failed(verb, warnings.error());
  if (verb.quiet) return exit_done;
  for (const std::string& warning : *warnings) {
    print_err(fmt::format("{}\n", one_line(fmt::format("lowlux: {}: warning: {}", verb.inputs.front(), warning))));
  }
  return exit_done;
}

}  // namespace lowlux::cli
