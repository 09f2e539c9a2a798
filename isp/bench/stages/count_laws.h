#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

/// Laws of counts as tables of F(k) = P(N <= k), k = 0, 1, 2...; beyond the end F is 1.
namespace lowlux::isp {

/// Poisson's law, by p(k + 1) = p(k) mean / (k + 1) from the most likely count outwards: to 1e-12. It ends where
/// 1 - F(k) is below 1e-17.
/// @param mean [events], above 0 and at most 1e6
std::vector<double> poisson_law(double mean);

/// The law of a sampler that makes a count of one random word and never falls when the word rises: for each k the share
/// of the 2^32 words that give k or less. No sample: each is counted, by bisection.
/// @param counts  how many k are asked for
std::vector<double> law_of_words(const std::function<double(std::uint32_t)>& count_of_word, std::size_t counts);

/// Largest difference of two laws (Kolmogorov's distance).
double kolmogorov_distance(std::span<const double> law, std::span<const double> other);

/// Largest difference between a law and the distribution of a sample, whose values may be fractions.
/// @param sample  finite, not empty
double kolmogorov_distance(std::vector<float> sample, std::span<const double> law);

/// What a sample of an equal law has for such a distance: below this but once in a few millions, the law being
/// continuous; of steps, more rarely. The limit's mean and standard deviation are 0.8687 and 0.2603 over sqrt(n).
double kolmogorov_limit(std::size_t samples);

/// Variance of a law.
double variance_of_law(std::span<const double> law);

/// The usual stand-in for a Poisson count: the nearest whole number to a normal deviate of equal mean and variance, at
/// least 0.
/// @param z  standard normal
float rounded_normal_count(float mean, float z);

}  // namespace lowlux::isp
