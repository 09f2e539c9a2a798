#pragma once

#include <string>
#include <vector>

namespace lowlux::cli {

/// Each verb takes the arguments after its name, prints its results and returns an exit code.
int run_bench(const std::vector<std::string>& words);
int run_calibrate(const std::vector<std::string>& words);
int run_capture(const std::vector<std::string>& words);
int run_compare(const std::vector<std::string>& words);
int run_dataset(const std::vector<std::string>& words);
int run_denoise(const std::vector<std::string>& words);
int run_develop(const std::vector<std::string>& words);
int run_doctor(const std::vector<std::string>& words);
int run_info(const std::vector<std::string>& words);
int run_merge(const std::vector<std::string>& words);
int run_reproduce(const std::vector<std::string>& words);
int run_resaturate(const std::vector<std::string>& words);
int run_retarget(const std::vector<std::string>& words);
int run_simulate(const std::vector<std::string>& words);

}  // namespace lowlux::cli
