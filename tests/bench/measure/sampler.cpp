// Times the random draws of isp/base/random/random.h and the readout against what they replace, in one run: see
// docs/kernels.md.
#include <cstdio>
#include <cstring>
#include <functional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "capture/synthetic/readout.h"
#include "isp/base/random/random.h"
#include "isp/base/random/random_rows.h"
#include "tests/bench/measure/measure.h"

namespace {

using namespace lowlux;

constexpr std::size_t width = 4000, height = 3000;
constexpr std::size_t few = 100'000;  // draws of std::poisson_distribution in one round

struct Stage {
  DrawStream stream{.seed = 1, .frame = 1, .purpose = draw_purpose::electrons};
  std::mt19937_64 sequence{1};
  std::vector<float> ramp_e = std::vector<float>(width);
  std::vector<float> floats = std::vector<float>(width);
  std::vector<std::uint32_t> words = std::vector<std::uint32_t>(width);
  std::vector<std::uint16_t> codes = std::vector<std::uint16_t>(width * height, 1);
  std::vector<std::uint16_t> copy = std::vector<std::uint16_t>(width * height, 2);
  double kept = 0;  // what sequential draws gave, so that they cannot be left out

  Stage() {
    for (std::size_t i = 0; i < width; ++i) ramp_e[i] = 9000 * static_cast<float>(i) / width;
  }
};

/// A task that makes `rows` rows.
test::Task rows_task(std::string name, std::size_t rows, std::function<void(std::uint32_t)> row) {
  return {std::move(name),
          [rows, row = std::move(row)] {
            for (std::uint32_t y = 0; y < rows; ++y) row(y);
          },
          static_cast<double>(rows * width)};
}

/// std::poisson_distribution and poisson_row at one mean, in this order.
void add_poisson(std::vector<test::Task>& tasks, Stage& s, double mean) {
  tasks.push_back({"std",
                   [&s, mean] {
                     std::poisson_distribution<int> poisson(mean);
                     for (std::size_t i = 0; i < few; ++i) s.kept += poisson(s.sequence);
                   },
                   few});
  const std::vector<float> means(width, static_cast<float>(mean));
  tasks.push_back(
      rows_task("poisson_row", 250, [&s, means](std::uint32_t y) { poisson_row(s.stream, 0, y, means, s.floats); }));
}

void add_frames(std::vector<test::Task>& tasks, Stage& s) {
  const capture::ReadoutParameters camera{.full_well_e = 9000, .read_noise_e = 4, .black_dn = 64, .max_dn = 16383};
  const auto codes = [&s](std::uint32_t y) { return std::span(s.codes).subspan(y * width, width); };
  tasks.push_back({"memcpy of the codes",
                   [&s] { std::memcpy(s.copy.data(), s.codes.data(), width * height * sizeof(s.codes[0])); },
                   width * height});
  tasks.push_back(rows_task("Philox alone", height, [&s](std::uint32_t y) { words_row(s.stream, 0, y, 0, s.words); }));
  tasks.push_back(rows_task("normal_row", height, [&s](std::uint32_t y) { normal_row(s.stream, 0, y, 1, s.floats); }));
  tasks.push_back(rows_task("poisson_row, ramp", height,
                            [&s](std::uint32_t y) { poisson_row(s.stream, 0, y, s.ramp_e, s.floats); }));
  tasks.push_back(rows_task("readout, ramp", height, [&s, camera, codes](std::uint32_t y) {
    capture::read_out_row(s.stream, 0, y, {s.ramp_e, {}, {}}, camera, codes(y));
  }));
  auto quiet = camera;
  quiet.photon_noise = false;
  quiet.read_noise_e = 0;
  tasks.push_back(rows_task("readout, no noise", height, [&s, quiet, codes](std::uint32_t y) {
    capture::read_out_row(s.stream, 0, y, {s.ramp_e, {}, {}}, quiet, codes(y));
  }));
}

/// Returns the time of one draw.
double ns_of(const test::Task& task) { return 1e6 * task.median_cpu_ms(); }

}  // namespace

int lowlux::test::measure_sampler(Arguments& arguments) {
  const int rounds = arguments.option("--rounds", 15, 15);
  arguments.end();
  Stage stage;
  const std::vector<double> means{0.1, 1, 5, 11, 12, 100, 1000, 1e5};
  std::vector<Task> tasks;
  for (const double mean : means) add_poisson(tasks, stage, mean);
  add_frames(tasks, stage);
  time_in_turn(tasks, rounds);

  std::printf("target %s, %d rounds, median CPU time of one draw\n\n", draws::target_name(), rounds);
  std::printf("%10s %18s %14s %7s\n", "mean", "std::poisson [ns]", "poisson_row", "ratio");
  for (std::size_t i = 0; i < means.size(); ++i) {
    const double slow = ns_of(tasks[2 * i]), fast = ns_of(tasks[2 * i + 1]);
    std::printf("%10g %18.1f %14.2f %7.1f\n", means[i], slow, fast, slow / fast);
  }
  const double copy = ns_of(tasks[2 * means.size()]), philox = ns_of(tasks[2 * means.size() + 1]);
  std::printf("\n%-22s %10s %10s %10s %10s\n", "12 MP", "ns/pixel", "ms", "x Philox", "x memcpy");
  for (std::size_t i = 2 * means.size(); i < tasks.size(); ++i) {
    const double ns = ns_of(tasks[i]);
    std::printf("%-22s %10.2f %10.1f %10.2f %10.1f\n", tasks[i].name.c_str(), ns, ns * 1e-6 * width * height,
                ns / philox, ns / copy);
  }
  return 0;
}
