#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "denoise/picture/resaturate.h"
#include "isp/base/random/random.h"
#include "isp/model/colour/camera_matrix.h"
#include "isp/model/colour/dark_desaturation.h"
#include "isp/model/sensor/photon.h"
#include "isp/pipeline/develop.h"
#include "isp/pipeline/live/live_pipeline.h"
#include "isp/pipeline/plan/plan_develop.h"
#include "isp/raw/measure/dark_estimate.h"
#include "tests/hard_cases/mosaics.h"
#include "tests/hard_cases/simulated.h"
#include "tests/pipeline/night_frames.h"
#include "tests/reference/exact_ref.h"
#include "tests/reference/poisson_ref.h"
#include "tests/support/executors.h"
#include "tests/support/numbers.h"

// Section 10 of the sensor and photon model.
namespace lowlux::hard_cases {
namespace {

using denoise_testing::flat;
using test::inf;
using test::nan;
using test::two_threads;

constexpr std::string_view sensor_group = "Sensor and photons";
constexpr std::string_view drawn_before = "the camera measures the light";
constexpr std::string_view no_colour_yet = "chromaticities are computed later";

MosaicCase without_light(double read_noise_e, int width, int height) {
  return case_of({.read_noise_e = read_noise_e}, flat(0, 0, 0), width, height, 91);
}

TEST(HardCaseSensor, NoPhotonIsNoElectronAndNoSpectrum) {
  HardCase row({sensor_group, "no photon at all", "closed form: black, and no spectrum", "values that are not 0"});
  row.on(Path::reference, 0, [](Denormals m) {
    return in_mode(m, [] {
      const auto means = isp::mean_photons(*isp::light_named("D65"), 0, 0.2);
      if (!means) return nan;
      const bool spectrum = isp::estimated_spectrum(*means, std::vector<double>(means->photons.size(), 0)).has_value();
      return (spectrum ? 1.0 : 0.0) + static_cast<double>(std::count_if(means->photons.begin(), means->photons.end(),
                                                                        [](double x) { return x != 0; }));
    });
  });
  row.on_each_set(0, [](Denormals m) {
    double count = 0;
    for (const double luminance : {0.0, 50.0}) {  // nothing in the scene, and no time
      const RawFrame frame = simulated({.luminance_cd_m2 = luminance, .time_s = luminance > 0 ? 0.0 : 1.0}, m);
      const auto& dn = frame.raw.dn;
      count += static_cast<double>(std::count_if(dn.data(), dn.data() + dn.size(), [](int v) { return v != 512; }));
    }
    return count;
  });
  const MosaicCase c = without_light(0, 64, 48);
  const auto not_zero = [&](const Plane<double>& out) {
    return static_cast<double>(std::count_if(out.data(), out.data() + out.size(), [](double v) { return v != 0; }));
  };
  for (std::size_t i = 0; i < levels.size(); ++i) {
    row.on(levels[i], 0, [&](Denormals m) { return not_zero(by_denoiser(c, denoise::all_levels[i], m)); });
  }
  row.on(Path::file, 0, [&](Denormals m) { return not_zero(by_file(c, m)); });
  row.on(Path::live, 0, [&](Denormals m) { return not_zero(by_live(c, m)); });
}

// Section 8: the dark charge has to come from somewhere, and a tagged pedestal is silent about it.
TEST(HardCaseSensor, DarkChargeThatNoSourceStatesIsInTheFrame) {
  HardCase row({sensor_group,
                "dark charge of 0.1 to 1e5 e- that no source states, under light of 1e-2 to 1e4 times as much",
                "closed form: grey surfaces down to black (reference); charge of the scene (file)",
                "of charge and light; standard errors"});
  constexpr std::array light{0.5, 1.0, 0.66};
  constexpr double white_e = 1e10;
  row.on(Path::reference, {2e-7, rounding}, [&](Denormals m) {
    double worst = 0;
    for (const double dark_e : {0.1, 1.0, 30.0, 1e3, 1e5}) {
      for (const double ratio : {1e-2, 1.0, 1e2, 1e4}) {
        CameraRgb blocks(48, 48);
        for (std::size_t c = 0; c < 3; ++c) {
          for (int i = 0; i < 48 * 48; ++i) {
            const int line = i / 48;
            const double place = line / 47.0;
            blocks.plane[c].data()[i] = static_cast<float>(dark_e * (1 + ratio * place * light[c]) / white_e);
          }
        }
        const isp::DarkEvidence evidence{
            .mean = blocks, .electrons_at_white = {white_e, white_e, white_e}, .pixels = 1e12};
        const auto found = in_mode(m, [&] { return isp::estimate_dark_charge(evidence); });
        keep_worst(worst, found ? std::abs(found->mean_e - dark_e) / (dark_e * (1 + ratio)) : nan);
      }
    }
    return worst;
  });
  row.none(levels, "subtracted after noise reduction").none(instruction_sets, scalar_code);
  row.on(Path::file, {3, "three standard errors"}, [&](Denormals m) {
    double worst = 0;
    for (const double dark_e : {20.0, 200.0, 800.0}) {
      const auto scene = [&](int x, int) {
        const double e = 0.5 * x;
        return std::array{e * light[0], e * light[1], e * light[2]};
      };
      RawFrame frame = test::night_frame({.dark_e = {dark_e, dark_e, dark_e, dark_e}}, scene, 320, 256);
      frame.raw.info.exposure_s = 2;
      const auto plan = in_mode(m, [&] { return isp::plan_develop(frame, {}, two_threads); });
      const bool is_found = plan && plan->dark.state == isp::DarkCharge::State::estimated;
      keep_worst(worst, is_found ? std::abs(*plan->dark.mean_e - dark_e) / *plan->dark.standard_error_e : nan);
    }
    return worst;
  });
  row.none(Path::live, "exposures of videos are short");
}

const std::array means_e{1e-12, 1e-9, 1e-6, 1e-3, 0.3, 1.0, 30.0, 1e3, 1e5, 1e6};

TEST(HardCaseSensor, MeansFromOneInABillionToAMillionAreExact) {
  HardCase row(
      {sensor_group, "means of 1e-12 to 1e6 photons",
       "Poisson's distribution in 50 digits, to 1e5 (reference); its plain sum (sets); 5 standard errors (file)",
       "relative; counts that differ; standard errors"});
  row.on(Path::reference, {4e-13, rounding}, [](Denormals m) {
    double worst = 0;
    for (const double mean : means_e) {
      const int most_likely = static_cast<int>(mean);
      for (const int k : {most_likely, most_likely + static_cast<int>(3 * std::sqrt(mean)) + 1}) {
        if (mean > 1e5) continue;  // 50 digits of a million factors take a second
        const double expected = reference::exact_poisson_probability(k, mean);
        const double found = in_mode(m, [&] { return reference::poisson_probability(k, mean); });
        keep_worst(worst, std::abs(found / expected - 1));
      }
    }
    return worst;
  });
  row.none(levels, not_denoised).on_each_set(0, [](Denormals m) {
    const DrawStream stream{.seed = 4};
    std::vector<float> counts(300);
    double wrong = 0;
    for (const double mean : means_e) {
      const std::vector<float> means(counts.size(), static_cast<float>(mean));
      in_mode(m, [&] { poisson_row(stream, 0, 0, means, counts); });
      for (std::size_t i = 0; i < counts.size(); ++i) {
        const std::uint32_t word = words_at(stream, static_cast<std::uint32_t>(i), 0)[0];
        wrong += counts[i] == reference::poisson_count(word, means[i]) ? 0 : 1;
      }
    }
    return wrong;
  });
  row.on(Path::file, 5, [](Denormals m) {
    double worst = 0;
    for (const double mean_e : {1e-9, 1e-3, 0.3, 30.0, 1e4}) keep_worst(worst, error_of_green({.green_e = mean_e}, m));
    return worst;
  });
  row.none(Path::live, drawn_before);
}

TEST(HardCaseSensor, WhatCannotBeDrawnIsRefused) {
  HardCase row({sensor_group, "means above 1e6, larger than any full well", "an error that names the limit",
                "frames that are simulated"});
  row.none(Path::reference, "refused before random draws").none(levels, not_denoised);
  row.none(instruction_sets, "refused before random draws");
  row.on(Path::file, 0, [](Denormals m) {
    const Simulated light{.luminance_cd_m2 = 1e6, .clips = false};
    const auto error = refusal_of(light, m);
    return error && error->message.find("1e6") != std::string::npos && !refusal_of({.luminance_cd_m2 = 1e6}, m) ? 0.0
                                                                                                                : 1.0;
  });
  row.none(Path::live, drawn_before);
}

TEST(HardCaseSensor, AFrameWithoutLightStaysAtZero) {
  HardCase row({sensor_group, "an all-dark frame",
                "closed form: a mean of 0; five standard errors, and one that borders add",
                "standard errors of the mean"});
  const MosaicCase c = without_light(3, 256, 192);
  constexpr Bound bound{6, any_draw};
  measure(row, c, {bound, bound, bound, bound}, [&](PlaneView<const double> out) {
    const auto mean = denoise_testing::colour_means(out, c.phase);
    double worst = 0;
    for (int k = 0; k < 3; ++k) {
      keep_worst(worst, std::abs(mean[k]) / std::sqrt(9 / (256 * 192 / (k == 1 ? 2.0 : 4.0))));
    }
    return worst;
  });
}

TEST(HardCaseSensor, NegativeSumsHaveNoChromaticity) {
  HardCase row(
      {sensor_group, "X + Y + Z of 0 or less after subtraction", "no chromaticity", "chromaticities returned"});
  row.on(Path::reference, 0, [](Denormals m) {
    const isp::Xyz dark{5, 6, 7};
    double given = 0;
    for (const isp::Xyz& measured : {isp::Xyz{5, 6, 7}, {4.9, 6, 7}, {0, 0, 0}, {6, 5, 6.9}, {nan, 6, 7}}) {
      given += in_mode(m, [&] { return isp::resaturated(measured, dark).has_value(); }) ? 1 : 0;
    }
    return given;
  });
  row.none(levels, no_colour_yet).none(instruction_sets, no_colour_yet);
  row.on(Path::file, 0, [](Denormals m) {  // `lowlux resaturate` makes it neutral
    const isp::Xy out = resaturated_flat({0.02f, 0.03f, 0.02f}, {0.03, 0.03, 0.03}, 1e-3, m);
    return std::hypot(out.x - 1.0 / 3, out.y - 1.0 / 3) < 1e-6 ? 0.0 : 1.0;
  });
  row.none(Path::live, "in streams dark is subtracted before colours are computed");
}

TEST(HardCaseSensor, AsAlphaVanishesErrorsGrowByItsReciprocal) {
  HardCase row({sensor_group, "alpha from 0.1 to 1e-12",
                "closed form: rounding of 0.3, 2e-16 (float 6e-8), divided by alpha",
                "error times alpha over rounding"});
  row.on(Path::reference, {1, rounding}, [](Denormals m) {
    const isp::Xy light{0.6, 0.3}, black{0.31, 0.33};
    double worst = 0;
    for (const double alpha : {1e-1, 1e-4, 1e-8, 1e-12}) {
      const auto back = in_mode(
          m, [&] { return isp::resaturated(isp::desaturated(light, black, alpha), black, alpha).value_or(isp::Xy{}); });
      keep_worst(worst, std::abs(back.x - light.x) * alpha / 2e-16);
    }
    return in_mode(m, [&] { return isp::resaturated(black, black, 0).has_value(); }) ? inf : worst;
  });
  row.none(levels, no_colour_yet).none(instruction_sets, no_colour_yet);
  row.on(Path::file, {0.1, rounding},
         [](Denormals m) {  // `lowlux resaturate`, where confidence is 1/2: half of the way to (1, 0)
           const isp::Xy out = resaturated_flat({0.031f, 0.03f, 0.03f}, {0.03, 0.03, 0.03}, 0.065e-3, m);
           return std::abs(out.x - 2.0 / 3) * (0.001 / 0.091) / 6e-8;
         });
  row.none(Path::live, "in streams dark is subtracted before colours are computed");
}

TEST(HardCaseSensor, SaturatedChannelsAreFlagged) {
  HardCase row({sensor_group, "channels full by well, converter, both", "flags by the exposure", "wrong flags"});
  const auto wrong = [](Denormals m) {
    double count = 0;
    for (const double gain : {0.1, 0.5, 5.0}) {
      for (const auto& [share, full] : {std::pair{0.8, 0}, {1.02, 1}, {20.0, 3}}) {
        const auto flags = saturated_flags(gain, share, m);
        count += std::abs(static_cast<double>(std::count(flags.begin(), flags.end(), true)) - full);
      }
    }
    return count;
  };
  row.on(Path::reference, 0, wrong)
      .on_each_set(0, wrong)
      .none(levels, "see 9.5: saturated sites")
      .on(Path::file, 0, wrong);
  row.none(Path::live, "see 9.5: saturated sites");
}

TEST(HardCaseSensor, WhiteNotAboveBlackIsRefused) {
  HardCase row({sensor_group, "white level at or below black, or NaN", "an error", "of three, accepted"});
  const std::array whites{512.0, 100.0, nan};
  row.on(Path::reference, 0, [&](Denormals m) {
    double taken = 0;
    for (const double white : whites) {
      isp::NamedSensor sensor = test::plain_sensor();
      sensor.model.white_level_dn = white;
      taken += in_mode(m, [&] { return isp::check_sensor(sensor.model).has_value(); }) ? 1 : 0;
    }
    return taken;
  });
  row.none(levels, not_denoised).none(instruction_sets, scalar_code);
  row.on(Path::file, 0, [&](Denormals m) {
    double taken = 0;
    for (const double white : whites) {
      RawFrame frame = simulated({.luminance_cd_m2 = 1}, m);
      frame.raw.white_dn.fill(white);
      InlineExecutor one;
      taken += in_mode(m, [&] { return isp::develop(frame, {}, one).has_value(); }) ? 1 : 0;
    }
    return taken;
  });
  row.on(Path::live, 0, [&](Denormals m) {
    return static_cast<double>(std::count_if(whites.begin(), whites.end(), [&](double white) {
      return live_takes({.white_dn = white}, {.black_dn = PerSite<double>{512, 512, 512, 512}}, m);
    }));
  });
}

TEST(HardCaseSensor, ExposuresThatCannotBeAreRefused) {
  HardCase row({sensor_group, "exposures that are negative, infinite, NaN", "an error; streams measure instead",
                "of four, accepted"});
  const std::array times_s{-1e-9, -inf, inf, nan};
  const auto taken = [&](const auto& takes) {
    return static_cast<double>(std::count_if(times_s.begin(), times_s.end(), takes));
  };
  row.on(Path::reference, 0, [&](Denormals m) {
    return taken([&](double t) {
      return in_mode(m, [&] { return isp::mean_photons(*isp::light_named("D65"), 1, t).has_value(); });
    });
  });
  row.none(levels, not_denoised).none(instruction_sets, "refused before random draws");
  row.on(Path::file, 0, [&](Denormals m) { return taken([&](double t) { return !refusal_of({.time_s = t}, m); }); });
  row.on(Path::live, 0, [&](Denormals m) {
    const MosaicCase c = without_light(3, 64, 48), next = case_of({.read_noise_e = 3}, flat(0, 0, 0), 64, 48, 92);
    return taken([&](double t) {  // as if nothing were said of it
      LiveMeans stream(c, m), silent(c, m);
      stream.take(c, 1), silent.take(c, 1);
      return largest_difference(stream.take(next, t), silent.take(next, 1)) > 0;
    });
  });
}

TEST(HardCaseSensor, SingularSensitivitiesAreRefused) {
  HardCase row({sensor_group, "singular matrix of sensitivities", "an error", "matrices returned"});
  row.on(Path::reference, 0, [](Denormals m) {
    const auto nikon = *isp::camera_sensitivity("Nikon_D5100");
    return in_mode(m, [&] { return isp::spectral_matrix({nikon[0], nikon[0], nikon[2]}).has_value(); }) ? 1.0 : 0.0;
  });
  row.none(levels, no_colour_yet).none(instruction_sets, no_colour_yet);
  const Matrix3 singular{{{1, 0, 0}, {1, 0, 0}, {0, 0, 1}}};
  row.on(Path::file, 0, [&](Denormals m) {
    RawFrame frame = simulated({.luminance_cd_m2 = 1}, m);
    for (ColourCalibration& light : frame.colour.calibrations) light.xyz_to_camera = singular;
    InlineExecutor one;
    return in_mode(m, [&] { return isp::develop(frame, {}, one).has_value(); }) ? 1.0 : 0.0;
  });
  row.on(Path::live, 0, [&](Denormals m) {
    isp::LiveSetup setup;
    setup.colour.calibrations = {{.cct_k = 6504, .xyz_to_camera = singular}};
    return live_takes(setup, {.black_dn = PerSite<double>{512, 512, 512, 512}}, m) ? 1.0 : 0.0;
  });
}

void spectrum_row(std::string_view name, const Spectrum& light, const std::vector<double>& widths_nm) {
  HardCase row({sensor_group, name, "closed form: photons bin by bin (reference, relative), 5 standard errors (others)",
                "relative to 1e-15; standard errors"});
  row.on(Path::reference, {1, rounding}, [&](Denormals m) {
    const auto found = in_mode(m, [&] { return isp::bin_widths_nm(light); });
    double worst = 0;
    for (std::size_t i = 0; i < widths_nm.size(); ++i) keep_worst(worst, std::abs(found[i] / widths_nm[i] - 1) / 1e-15);
    return worst;
  });
  const auto error = [&](Denormals m) { return error_of_green({.luminance_cd_m2 = 3, .light = &light}, m); };
  row.none(levels, not_denoised).on_each_set(5, error).on(Path::file, 5, error).none(Path::live, drawn_before);
}

TEST(HardCaseSensor, ASingleBin) {
  spectrum_row("a spectrum of one bin", *Spectrum::of({540, 545, 550, 555, 560}, {0, 0, 1, 0, 0}), {2.5, 5, 5, 5, 2.5});
}

TEST(HardCaseSensor, UnevenSteps) {
  spectrum_row("steps of 1 to 120 nm",
               *Spectrum::of({400, 401, 410, 450, 530, 531, 600, 720}, {1, 3, 2, 0.5, 2, 4, 1, 0.2}),
               {0.5, 5, 24.5, 60, 40.5, 35, 94.5, 60});
}

}  // namespace
}  // namespace lowlux::hard_cases
