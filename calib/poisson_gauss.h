#pragma once

namespace lowlux::calib {

/// A Poisson variable plus a normal one [e-].
struct PoissonGauss {
  double poisson_mean_e = 0;      // 0..1e6
  double normal_variance_e2 = 0;  // above 0
};

/// Mean of the values between low and high, less the mean of all [e-]: what leaving out the others does to a mean.
/// Exact sum over the Poisson counts within ten standard deviations. 0 if nothing lies between.
double truncation_bias_e(const PoissonGauss& law, double low_e, double high_e);

}  // namespace lowlux::calib
