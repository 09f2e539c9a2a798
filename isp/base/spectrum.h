#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "isp/base/result.h"
#include "isp/base/text.h"

namespace lowlux {

/// Holds a quantity tabulated over wavelength; the steps may be unequal. Between its nodes it is linear, outside them
/// 0. It is made by of(), so that an object always holds at least two finite nodes with rising wavelengths.
class Spectrum {
 public:
  /// Makes a spectrum from its nodes.
  /// @param wavelengths_nm  rising strictly, as many as there are values; at least two
  /// @param values          finite; negative ones are allowed (differences of spectra)
  static Result<Spectrum> of(std::vector<double> wavelengths_nm, std::vector<double> values) {
    if (wavelengths_nm.size() != values.size() || values.size() < 2) {
      return fail(ErrorCode::malformed, "a spectrum needs one value for each of at least two wavelengths, found " +
                                            std::to_string(wavelengths_nm.size()) + " wavelengths and " +
                                            std::to_string(values.size()) + " values");
    }
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (!std::isfinite(wavelengths_nm[i]) || !std::isfinite(values[i])) {
        return fail(ErrorCode::malformed, "row " + std::to_string(i) + " of a spectrum is not a finite number");
      }
      if (i > 0 && wavelengths_nm[i] <= wavelengths_nm[i - 1]) {
        return fail(ErrorCode::malformed, "the wavelengths of a spectrum must rise, but " +
                                              number_text(wavelengths_nm[i]) + " nm follows " +
                                              number_text(wavelengths_nm[i - 1]) + " nm");
      }
    }
    return Spectrum(std::move(wavelengths_nm), std::move(values));
  }

  std::span<const double> wavelengths_nm() const { return wavelengths_nm_; }
  std::span<const double> values() const { return values_; }
  std::size_t size() const { return values_.size(); }

  /// Returns the spectrum with each value replaced by change(wavelength_nm, value), which must be finite.
  template <class Change>
  Spectrum mapped(const Change& change) const {
    std::vector<double> values(values_);
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = change(wavelengths_nm_[i], values[i]);
    return {wavelengths_nm_, std::move(values)};
  }

  /// Returns the value at a wavelength: linear between nodes, 0 outside the tabulated range.
  double at(double wavelength_nm) const {
    if (!(wavelength_nm >= wavelengths_nm_.front() && wavelength_nm <= wavelengths_nm_.back())) return 0;
    const auto above = std::upper_bound(wavelengths_nm_.begin(), wavelengths_nm_.end(), wavelength_nm);
    if (above == wavelengths_nm_.end()) return values_.back();
    const auto i = static_cast<std::size_t>(above - wavelengths_nm_.begin());
    const double t = (wavelength_nm - wavelengths_nm_[i - 1]) / (wavelengths_nm_[i] - wavelengths_nm_[i - 1]);
    return values_[i - 1] + t * (values_[i] - values_[i - 1]);
  }

 private:
  Spectrum(std::vector<double> wavelengths_nm, std::vector<double> values)
      : wavelengths_nm_(std::move(wavelengths_nm)), values_(std::move(values)) {}

  std::vector<double> wavelengths_nm_;
  std::vector<double> values_;
};

/// Returns the spectrum at other wavelengths, which must rise; see Spectrum::at.
inline Result<Spectrum> resample(const Spectrum& spectrum, std::span<const double> wavelengths_nm) {
  std::vector<double> values(wavelengths_nm.size());
  std::transform(wavelengths_nm.begin(), wavelengths_nm.end(), values.begin(),
                 [&](double nm) { return spectrum.at(nm); });
  return Spectrum::of({wavelengths_nm.begin(), wavelengths_nm.end()}, std::move(values));
}

/// Returns the light reflected by a surface, at the nodes of the light.
inline Spectrum reflected(const Spectrum& light, const Spectrum& reflectance) {
  return light.mapped([&](double nm, double power) { return power * reflectance.at(nm); });
}

/// Returns the integral of spectrum(nm) * weight(nm) by the trapezium rule on the nodes of `spectrum` [value x nm].
/// Only its own nodes are used because tables of lamps hold their lines summed into bins: between bins nothing is
/// known.
template <class Weight>
double integrate(const Spectrum& spectrum, const Weight& weight) {
  const auto nm = spectrum.wavelengths_nm();
  const auto value = spectrum.values();
  double sum = 0;
  double before = value[0] * weight(nm[0]);
  for (std::size_t i = 1; i < nm.size(); ++i) {
    const double here = value[i] * weight(nm[i]);
    sum += 0.5 * (before + here) * (nm[i] - nm[i - 1]);
    before = here;
  }
  return sum;
}

/// Returns the integral of the spectrum over its range [value x nm], exact for a spectrum that is linear between its
/// nodes.
inline double integrate(const Spectrum& spectrum) {
  return integrate(spectrum, [](double) { return 1.0; });
}

}  // namespace lowlux
