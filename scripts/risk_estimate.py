"""Stein's unbiased estimate of a denoiser's mean squared error, without the truth.

C. M. Stein 1981; H. M. Hudson 1978 for counts of photons; the divergence by random probes: S. Ramani, T. Blu, M. Unser
2008. It holds for noise that is independent from site to site and has the stated variance.
"""
import numpy as np

from bayer_frames import Failure


def risk_maps(denoise, noisy, read_variance, random, probes=2, step=0.1):
    """Return the estimated squared error of each site before and after denoise() [e-^2], without the truth.

    After: (f(y) - y)^2 - v + 2 v df/dy with v = y + s^2, which may be negative: its mean is the variance. df/dy is
    measured with random signs, and steps of about 0.1 standard deviations (Ramani et al. 2008).
    """
    variance, scale = noisy + read_variance, step * np.sqrt(np.maximum(noisy, 0) + read_variance + 0.375)
    divergence = np.zeros_like(noisy)
    for _ in range(probes):
        sign = random.choice([-1.0, 1.0], noisy.shape)
        change = denoise(noisy + scale * sign) - denoise(noisy - scale * sign)
        divergence += sign * change / (2 * scale * probes)
    return variance, (denoise(noisy) - noisy)**2 - variance + 2 * variance * divergence


def block_means(values, clipped, side=32):
    """Return the means of blocks of side x side sites, without those that hold a clipped site."""
    height, width = (n // side for n in values.shape)
    parts = lambda m: m[:height * side, :width * side].reshape(height, side, width, side)  # noqa: E731
    return parts(values).mean((1, 3))[~parts(clipped).any((1, 3))]


def mean_and_error(values):
    """Return the mean of blocks and its standard error."""
    return float(values.mean()), float(values.std(ddof=1) / np.sqrt(values.size)) if values.size > 1 else np.inf


def check_frame(frame, network, random, truth=None):
    """Return the estimated mean squared error before and after [e-^2], and the true one where the truth is given."""
    denoise = lambda electrons: frame.denoised(network, electrons)  # noqa: E731
    before, after = (block_means(m, frame.clipped)
                     for m in risk_maps(denoise, frame.electrons, frame.read_variance, random))
    if before.size < 2:
        raise Failure("fewer than two blocks of 32 x 32 sites are not clipped")
    out = {"blocks": before.size, "noise": frame.source, "doubts": frame.notes}
    out["before_e2"], out["after_e2"] = mean_and_error(before)[0], mean_and_error(after)[0]
    out["change_db"] = float(10 * np.log10(max(out["after_e2"], 1e-9) / out["before_e2"]))
    gained, error = mean_and_error(before - after)
    out["gain_e2"], out["gain_error_e2"], out["improves"] = gained, error, bool(gained > 2 * error)
    if truth is not None:
        true = [block_means((m - truth)**2, frame.clipped) for m in (frame.electrons, denoise(frame.electrons))]
        out["true_before_e2"], out["true_after_e2"] = float(true[0].mean()), float(true[1].mean())
        difference, error = mean_and_error(after - true[1])
        out["difference_in_errors"] = difference / error
        out["agrees"] = bool(abs(difference) <= 4 * error)
    return out
