// A program outside the tree that uses the installed library: reads a raw file, develops it, prints its size.
#include <capture/file/dng_source.h>
#include <isp/base/executor.h>
#include <isp/pipeline/develop.h>

#include <cstdio>

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  const auto frame = lowlux::capture::read_raw(argv[1]);
  if (!frame) return std::fprintf(stderr, "%s\n", frame.error().message.c_str()), 1;
  lowlux::InlineExecutor executor;
  const auto developed = lowlux::isp::develop(*frame, {}, executor);
  if (!developed) return std::fprintf(stderr, "%s\n", developed.error().message.c_str()), 1;
  std::printf("%d x %d\n", developed->plan.width, developed->plan.height);
  return 0;
}
