#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "isp/base/matrix3.h"
#include "isp/base/result.h"
#include "isp/model/appearance/appearance_model.h"
#include "isp/model/colour/colorimetry.h"
#include "isp/model/spectrum/max_entropy.h"
#include "isp/model/spectrum/spectral_data.h"

namespace lowlux::isp {

// Spectrum that the dark-adapted eye can infer: the one of largest entropy that gives its responses. With falling
// luminance the rods' weight in the responses grows and the confidence in them falls (thesis Eq. 5.1 to 5.9; Clark &
// Skaff, J. Opt. Soc. Am. A 26 (2009)). A response is f_i = cone_i + xi w_i V', w = (3, 3, 5), cones and V' with peak
// 1.
//
// The noise of a pixel lowers that confidence further. The fit minimises |moments - eta|^2 weighted by A, less gamma
// times the entropy, and depends on gamma A^-1 alone. With responses eta to a light of power 1 and their covariance C,
//     gamma A^-1 = 2 (1 - m) I + 2 C,
// for then the data term is chi-square and the entropy counts as the logarithm of a prior: 2 (1 - m) I is what the
// model has without noise, and acts as a standard deviation of sqrt(1 - m). Without noise the result is that of the
// published model, with much noise it is the grey of the luminance.

/// The model's integrals have these nodes: 390, 395 ... 730 nm, each 5 nm wide.
inline constexpr int entropy_nodes = 69;
constexpr double entropy_wavelength_nm(int i) { return 390.0 + 5.0 * i; }
/// Holds relative spectral power at the nodes of the model.
using NodePower = std::array<double, entropy_nodes>;

/// Selects the variant. `rendering` measures with cones and rods, relates the measurement to that of the white (von
/// Kries) and reconstructs the spectrum from the cones alone; `thesis` does both with cones and rods, as Eq. 5.1 reads,
/// and turns whites greenish.
enum class EntropyVariant : std::uint8_t { rendering, thesis };

/// Selects the assumed light power behind a pixel's three responses. `lifted`: that of the smoothest spectrum of the
/// colour, see spectral_lift.h. `luminance`: the power that gives the fitted spectrum the pixel's luminance, by three
/// rounds from an even one; it adds little information, for V is nearly a sum of cones, and leaves saturated blues too
/// bright to be any spectrum.
enum class PixelPower : std::uint8_t { lifted, luminance };

/// Holds the options of the model of largest entropy.
struct EntropyOptions {
  EntropyVariant variant = EntropyVariant::rendering;
  ConeSet cones = ConeSet::stockman_sharpe_2000;
  PixelPower power = PixelPower::lifted;
  std::optional<double> gamma_fixed;        // 2 is the thesis' run without adaptation (Table 5-2)
  std::optional<Matrix3> noise_covariance;  // noise covariance of X, Y and Z as in ColourNoise; absent: without noise
};

/// Returns the weight of entropy, gamma = 2 (1 - m), at least 1e-4; m in 0..1 as in mesopic.h.
double entropy_weight(double m);
/// Returns the weight of the rods, xi = (e^(1 - m) - 1) / (e - 1).
double entropy_rod_fraction(double m);

/// Holds the model for one state of adaptation and one white.
struct EntropyModel {
  SpectralBasis<3> measured;    // f that weights the light
  SpectralBasis<3> explained;   // f of the reconstructed spectrum
  Vector3 adaptation{1, 1, 1};  // von Kries factors from `measured` to `explained`
  double gamma = 2;
  Matrix3 noise{};  // covariance of eta of a light of power 1, for noise of luminance (integral of V p) of variance 1
};

/// Makes the model for an adaptation coefficient and a white.
/// @param m      0..1
/// @param white  power of the white, nowhere negative
/// Errors: invalid_argument for a white without power, a gamma_fixed below 1e-12 or not finite, a covariance that is
/// not symmetric or not positive definite (to 1e-12 of its trace).
Result<EntropyModel> entropy_model(double m, const NodePower& white, const EntropyOptions& options = {});

/// Returns the responses to a light of power 1, von Kries factors included: the target moments (eta) of the fitted
/// spectrum.
/// @param power  with a positive sum
Vector3 entropy_moments(const EntropyModel& model, const NodePower& power);

/// Returns the fitted spectrum from responses to a light of power 1; nullopt as fit_max_entropy.
/// @param luminance_variance  luminance variance of the noise of the integral of V p; 0 where the model has no
/// covariance
std::optional<MaxEntropyFit<3>> entropy_fit(const EntropyModel& model, const Vector3& eta,
                                            double luminance_variance = 0);

/// Returns the fitted spectrum from responses to a light of unknown power and its luminance, beta = Y / integral of V
/// p.
/// @param responses        integral of f times power, von Kries factors included
/// @param luminance        integral of V times power, > 0
/// @param noise_to_signal  standard deviation of the luminance over the luminance
std::optional<MaxEntropyFit<3>> entropy_fit_of_luminance(const EntropyModel& model, const Vector3& responses,
                                                         double luminance, double noise_to_signal = 0);

/// Returns the XYZ of the spectrum of a fit, whose power is 1.
Xyz xyz_of(const EntropyModel& model, const MaxEntropyFit<3>& fit);

/// Returns the matrix from XYZ to the responses of a basis, by least squares over the wavelengths. For cones alone (m =
/// 1) it is off by up to 0.03, 0.03 and 0.2 of the peak for Stockman & Sharpe's L, M and S, which are not sums of the
/// CIE 1931 functions.
Matrix3 response_matrix(const SpectralBasis<3>& basis);

/// Describes the noise of one pixel and the camera's colour matrix.
struct ChannelNoise {
  Vector3 variance_e2;         // variances of R, G, B
  Vector3 rgb_per_e{1, 1, 1};  // camera RGB of an electron: gains of white balance and exposure
  Matrix3 camera_to_xyz = identity3();
};

/// Returns the covariance of X, Y and Z, M diag(rgb_per_e^2 variance) M^T with M = camera_to_xyz, divided by the
/// variance of Y: ColourNoise::covariance.
Matrix3 noise_covariance_of_xyz(const ChannelNoise& noise);

/// Returns the model as a map of colours. The white goes to the D65 white of ViewingConditions{}, chromaticities by
/// Bradford's matrix from the model's output for the white. Luminance is L_mes over that of the white, with the rods'
/// part from the lifted spectrum. A colour without positive luminance has no spectrum and becomes the grey of its
/// luminance; one outside of the spectral locus keeps its luminance and is treated as the nearest liftable()
/// chromaticity. Values that are not finite become black. The map is homogeneous: s times a colour gives s times the
/// result, s > 0. With noise the white is seen with the same ratio of noise to signal, so that neutrals stay neutral
/// and colours fade to the grey of their luminance. Errors: invalid_argument for conditions that are not positive and
/// finite, a ratio that is negative or not finite, a white without a spectrum, and as entropy_model().
Result<ColourMap> entropy_colour_map(const ViewingConditions& conditions, const EntropyOptions& options);

/// Returns the entry for appearance_models(): entropy_colour_map() in the variant `rendering`.
AppearanceModel entropy_appearance();

}  // namespace lowlux::isp
