#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

/// Distributions of counts are tables of F(k) = P(N <= k), k = 0, 1, 2...; beyond the end F is 1.
namespace lowlux::isp {

/// Returns the Poisson distribution, by p(k + 1) = p(k) mean / (k + 1) from the most likely count outwards, to 1e-12.
/// It ends where 1 - F(k) is below 1e-17.
/// @param mean [events], above 0 and at most 1e6
std::vector<double> poisson_law(double mean);

/// Returns the distribution of a sampler that makes a count of one random word and never falls when the word rises: for
/// each k the fraction of the 2^32 words that give k or less. It is not sampled but counts all words, by bisection.
/// @param counts  number of k to evaluate
std::vector<double> law_of_words(const std::function<double(std::uint32_t)>& count_of_word, std::size_t counts);

/// Returns the largest difference of two distributions (Kolmogorov's distance).
double kolmogorov_distance(std::span<const double> law, std::span<const double> other);

/// Returns the largest difference between a distribution and the one of a sample, whose values may be fractional.
/// @param sample  finite, not empty
double kolmogorov_distance(std::vector<float> sample, std::span<const double> law);

/// Returns the limit that this distance of a sample of an equal distribution exceeds once in a few millions if the
/// distribution is continuous; more rarely if it has steps. The asymptotic mean and standard deviation are 0.8687 and
/// 0.2603 over sqrt(n).
double kolmogorov_limit(std::size_t samples);

/// Returns the variance of a distribution.
double variance_of_law(std::span<const double> law);

/// Returns the usual approximation of a Poisson count: the nearest integer to a normal deviate of equal mean and
/// variance, at least 0.
/// @param z  standard normal
float rounded_normal_count(float mean, float z);

}  // namespace lowlux::isp
