#include "calib/profile/profile_io.h"

#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace lowlux::calib {
namespace {

using Json = nlohmann::ordered_json;

/// Figures whose decimals are long.
CameraProfile awkward_profile() {
  GainProfile gain;
  gain.gain_setting = std::string("ISO 1600 \"high\"");
  gain.iso = 1600.1;
  gain.sensor = SensorModel{.name = "Sensor \xc3\xa9",
                            .system_gain_dn_per_e = 1.0 / 3,
                            .read_noise_e = std::nextafter(1.5, 2),
                            .full_well_e = 7900.123456789012,
                            .bits = 14,
                            .black_level_dn = 512.0 + 1.0 / 7,
                            .white_level_dn = 16383,
                            .quantisation = Quantisation::floor,
                            .dark_current_e_per_s = {1e-300, 0.1, 2.0 / 3},
                            .dark_temperature_c = -10.1,
                            .dark_doubling_c = 6.3,
                            .prnu = 0.0081,
                            .dsnu = 0.21,
                            .hot_pixel_fraction = 1e-5,
                            .hot_pixel_current_e_per_s = 311.7,
                            .row_noise_e = 0.3,
                            .column_noise_e = 0.7};
  gain.errors = {.system_gain_dn_per_e = 0.001 / 3,
                 .read_noise_e = 0.01,
                 .full_well_e = 11.1,
                 .dark_current_e_per_s = {1e-310, 0.003, 0.007},  // below the smallest normal number
                 .dark_doubling_c = 0.05,
                 .prnu = 1e-5,
                 .dsnu = 1e-3};
  gain.pedestal_dn = PerSite<Estimate>{{{512, 0}, {512 + 1.0 / 7, 0.01 / 3}, {512 + 2.0 / 7, 0.02 / 3}, {513, 0.01}}};
  gain.hot_pixels = {{3, 4, 100.1}, {6000, 5999, 1e-7}};
  Provenance provenance{Provenance::Kind::measured, "photon transfer", "a program", "2026-01-02",
                        {"a.dng", "b/c.dng"},       1.0 / 9,           17};
  gain.provenance = {provenance, {.kind = Provenance::Kind::quoted, .figures = "full well"}};
  ColourProfile colour;
  colour.illuminant = "tungsten";
  colour.calibration.cct_k = 2856.1;
  colour.calibration.xyz_to_camera = {{{1.1, -0.1 / 3, 0.2}, {0, 2.0 / 3, 0}, {0, 0, -999.9}}};
  colour.calibration.forward = Matrix3{{{0.1 / 3, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  colour.patches_ciede2000 = 1.0 / 7;
  colour.condition_number = 31.4;
  colour.scotopic_weights = {-0.1, 1.0 / 3, 0.5};
  colour.provenance = provenance;
  CameraProfile profile{"Maker", "Model 1", {gain, gain}, {colour, colour}};
  profile.colours[1].calibration.forward.reset();
  profile.gains[0].pedestal_holds = BlackPoint::Holds::pedestal_and_dark;
  profile.gains[0].dark_exposure_s = MeasuredRange{1e-3, 100.0 / 3};
  profile.gains[0].dark_temperature_c = MeasuredRange{-10.1, -10.1};
  profile.gains[0].dark_chromaticity = std::array<Estimate, 3>{{{0.3, 0.1 / 3}, {1.0 / 3, 0}, {-0.01, 0.2}}};
  profile.gains[1].iso.reset();
  profile.gains[1].sensor.reset();
  profile.gains[1].pedestal_dn.reset();
  profile.gains[1].hot_pixels.clear();
  profile.gains[1].provenance.clear();
  return profile;
}

TEST(ProfileIo, ReadingBackGivesTheSameBits) {
  const CameraProfile profile = awkward_profile();
  const auto text = profile_text(profile);
  ASSERT_TRUE(text) << text.error().message;
  const auto read = parse_profile(*text);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(*profile_text(*read), *text);
  ASSERT_EQ(read->gains.size(), 2U);
  const GainProfile &found = read->gains[0], &truth = profile.gains[0];
  ASSERT_TRUE(found.sensor);
  EXPECT_EQ(found.gain_setting, truth.gain_setting);
  EXPECT_EQ(found.iso, truth.iso);
  EXPECT_EQ(found.sensor->name, truth.sensor->name);
  EXPECT_EQ(found.sensor->system_gain_dn_per_e, truth.sensor->system_gain_dn_per_e);
  EXPECT_EQ(found.sensor->read_noise_e, truth.sensor->read_noise_e);
  EXPECT_EQ(found.sensor->full_well_e, truth.sensor->full_well_e);
  EXPECT_EQ(found.sensor->bits, truth.sensor->bits);
  EXPECT_EQ(found.sensor->black_level_dn, truth.sensor->black_level_dn);
  EXPECT_EQ(found.sensor->white_level_dn, truth.sensor->white_level_dn);
  EXPECT_EQ(found.sensor->quantisation, truth.sensor->quantisation);
  EXPECT_EQ(found.sensor->dark_current_e_per_s, truth.sensor->dark_current_e_per_s);
  EXPECT_EQ(found.sensor->dark_temperature_c, truth.sensor->dark_temperature_c);
  EXPECT_EQ(found.sensor->dark_doubling_c, truth.sensor->dark_doubling_c);
  EXPECT_EQ(found.sensor->prnu, truth.sensor->prnu);
  EXPECT_EQ(found.sensor->dsnu, truth.sensor->dsnu);
  EXPECT_EQ(found.sensor->hot_pixel_fraction, truth.sensor->hot_pixel_fraction);
  EXPECT_EQ(found.sensor->hot_pixel_current_e_per_s, truth.sensor->hot_pixel_current_e_per_s);
  EXPECT_EQ(found.sensor->row_noise_e, truth.sensor->row_noise_e);
  EXPECT_EQ(found.sensor->column_noise_e, truth.sensor->column_noise_e);
  EXPECT_EQ(found.errors.system_gain_dn_per_e, truth.errors.system_gain_dn_per_e);
  EXPECT_EQ(found.errors.read_noise_e, truth.errors.read_noise_e);
  EXPECT_EQ(found.errors.full_well_e, truth.errors.full_well_e);
  EXPECT_EQ(found.errors.dark_current_e_per_s, truth.errors.dark_current_e_per_s);
  EXPECT_EQ(found.errors.dark_doubling_c, truth.errors.dark_doubling_c);
  EXPECT_EQ(found.errors.prnu, truth.errors.prnu);
  EXPECT_EQ(found.errors.dsnu, truth.errors.dsnu);
  EXPECT_EQ(found.pedestal_dn, truth.pedestal_dn);
  ASSERT_EQ(found.hot_pixels.size(), 2U);
  EXPECT_EQ(found.hot_pixels[1].x, 6000);
  EXPECT_EQ(found.hot_pixels[1].y, 5999);
  EXPECT_EQ(found.hot_pixels[1].excess_e_per_s, 1e-7);
  ASSERT_EQ(found.provenance.size(), 2U);
  EXPECT_EQ(found.provenance[0].files, truth.provenance[0].files);
  EXPECT_EQ(found.provenance[0].reduced_chi_square, 1.0 / 9);
  EXPECT_EQ(found.provenance[0].degrees_of_freedom, 17);
  EXPECT_EQ(found.provenance[0].date, "2026-01-02");
  EXPECT_EQ(found.provenance[1].kind, Provenance::Kind::quoted);
  EXPECT_EQ(found.pedestal_holds, BlackPoint::Holds::pedestal_and_dark);
  EXPECT_EQ(found.dark_exposure_s, truth.dark_exposure_s);
  EXPECT_EQ(found.dark_temperature_c, truth.dark_temperature_c);
  EXPECT_EQ(found.dark_chromaticity, truth.dark_chromaticity);
  EXPECT_FALSE(read->gains[1].iso);
  EXPECT_FALSE(read->gains[1].sensor);
  EXPECT_FALSE(read->gains[1].pedestal_dn);
  ASSERT_EQ(read->colours.size(), 2U);
  const ColourProfile &colour = read->colours[0], &expected = profile.colours[0];
  EXPECT_EQ(colour.illuminant, "tungsten");
  EXPECT_EQ(colour.calibration.cct_k, 2856.1);
  EXPECT_EQ(colour.calibration.xyz_to_camera, expected.calibration.xyz_to_camera);
  EXPECT_EQ(colour.calibration.forward, expected.calibration.forward);
  EXPECT_EQ(colour.patches_ciede2000, 1.0 / 7);
  EXPECT_FALSE(colour.cross_validated_ciede2000);
  EXPECT_EQ(colour.condition_number, 31.4);
  EXPECT_EQ(colour.scotopic_weights, (std::array<double, 3>{-0.1, 1.0 / 3, 0.5}));
  EXPECT_EQ(colour.provenance.files, truth.provenance[0].files);
  EXPECT_FALSE(read->colours[1].calibration.forward);
}

TEST(ProfileIo, EmptyProfilesAreProfiles) {
  const auto text = profile_text({});
  ASSERT_TRUE(text);
  EXPECT_TRUE(parse_profile(*text)->gains.empty());
}

Error error_after(const std::function<void(Json&)>& change) {
  Json document = Json::parse(*profile_text(awkward_profile()));
  change(document);
  const auto read = parse_profile(document.dump());
  return read ? Error{} : read.error();
}

TEST(ProfileIo, EveryErrorNamesTheKeysPath) {
  struct Case {
    std::string where;
    std::function<void(Json&)> change;
  };
  const Case cases[] = {
      {"format", [](Json& j) { j["format"] = "another"; }},
      {"format", [](Json& j) { j.erase("format"); }},
      {"version", [](Json& j) { j["version"] = 0; }},
      {"version", [](Json& j) { j["version"] = "1"; }},
      {"maker", [](Json& j) { j["maker"] = "x"; }},
      {"gains", [](Json& j) { j["gains"] = Json::object(); }},
      {"gains", [](Json& j) { j["gains"] = Json::array_t(257, j["gains"][0]); }},
      {"gains[1]", [](Json& j) { j["gains"][1] = 5; }},
      {"gains[0].iso", [](Json& j) { j["gains"][0]["iso"] = -1; }},
      {"gains[0].iso", [](Json& j) { j["gains"][0]["iso"] = nullptr; }},
      {"gains[0].sensor.read_noise_dn", [](Json& j) { j["gains"][0]["sensor"]["read_noise_dn"] = 1; }},
      {"gains[0].sensor.read_noise_e", [](Json& j) { j["gains"][0]["sensor"].erase("read_noise_e"); }},
      {"gains[0].sensor.read_noise_e", [](Json& j) { j["gains"][0]["sensor"]["read_noise_e"] = 3; }},
      {"gains[0].sensor.read_noise_e.value", [](Json& j) { j["gains"][0]["sensor"]["read_noise_e"]["value"] = -1; }},
      {"gains[0].sensor.read_noise_e.standard_error",
       [](Json& j) { j["gains"][0]["sensor"]["read_noise_e"]["standard_error"] = true; }},
      {"gains[0].sensor.system_gain_dn_per_e.value",
       [](Json& j) { j["gains"][0]["sensor"]["system_gain_dn_per_e"]["value"] = 0; }},
      {"gains[0].sensor.bits", [](Json& j) { j["gains"][0]["sensor"]["bits"] = 12.5; }},
      {"gains[0].sensor.bits", [](Json& j) { j["gains"][0]["sensor"]["bits"] = 1e300; }},
      {"gains[0].sensor.quantisation", [](Json& j) { j["gains"][0]["sensor"]["quantisation"] = "ceil"; }},
      {"gains[0].sensor.name", [](Json& j) { j["gains"][0]["sensor"]["name"] = 7; }},
      {"gains[0].sensor", [](Json& j) { j["gains"][0]["sensor"]["black_level_dn"] = 16383; }},  // black at white
      {"gains[0].pedestal_dn.site_11", [](Json& j) { j["gains"][0]["pedestal_dn"].erase("site_11"); }},
      {"gains[0].pedestal_dn.site_10.value", [](Json& j) { j["gains"][0]["pedestal_dn"]["site_10"]["value"] = 70000; }},
      {"gains[0].pedestal_holds", [](Json& j) { j["gains"][0]["pedestal_holds"] = "dark"; }},
      {"gains[0].dark_exposure_s", [](Json& j) { j["gains"][0]["dark_exposure_s"]["low"] = 1e6; }},
      {"gains[0].dark_temperature_c.high", [](Json& j) { j["gains"][0]["dark_temperature_c"]["high"] = 201; }},
      {"gains[0].dark_chromaticity.blue", [](Json& j) { j["gains"][0]["dark_chromaticity"].erase("blue"); }},
      {"gains[1].sensor", [](Json& j) { j["gains"][1]["sensor"] = nullptr; }},
      {"colours[1].xyz_to_camera", [](Json& j) { j["colours"][1]["xyz_to_camera"].erase(2); }},
      {"colours[1].xyz_to_camera[1]", [](Json& j) { j["colours"][1]["xyz_to_camera"][1] = 4; }},
      {"colours[1].xyz_to_camera[1]", [](Json& j) { j["colours"][1]["xyz_to_camera"][1].push_back(4); }},
      {"colours[1].xyz_to_camera[1][2]", [](Json& j) { j["colours"][1]["xyz_to_camera"][1][2] = "x"; }},
      {"colours[1].xyz_to_camera[0][0]", [](Json& j) { j["colours"][1]["xyz_to_camera"][0][0] = 1001; }},
      {"colours[1].xyz_to_camera", [](Json& j) { j["colours"][1]["xyz_to_camera"][1][1] = 0; }},  // singular
      {"colours[0].forward.balanced_camera_to_xyz",
       [](Json& j) { j["colours"][0]["forward"]["balanced_camera_to_xyz"] = 1; }},
      {"colours[0].scotopic_weights", [](Json& j) { j["colours"][0]["scotopic_weights"]["green"] = -1; }},
      {"colours[0].condition_number", [](Json& j) { j["colours"][0]["condition_number"] = 0.5; }},
      {"gains[0].hot_pixels[1].x_px", [](Json& j) { j["gains"][0]["hot_pixels"][1]["x_px"] = -1; }},
      {"gains[0].provenance[0].files[1]", [](Json& j) { j["gains"][0]["provenance"][0]["files"][1] = 1; }},
      {"gains[0].provenance[1].kind", [](Json& j) { j["gains"][0]["provenance"][1]["kind"] = "guessed"; }},
  };
  for (const Case& c : cases) {
    const Error error = error_after(c.change);
    EXPECT_EQ(error.where, c.where);
    EXPECT_EQ(error.code, ErrorCode::malformed) << c.where;
    EXPECT_EQ(error.message.rfind(c.where + ": ", 0), 0U) << error.message;
    EXPECT_EQ(error.message.find('\n'), std::string::npos);
  }
}

TEST(ProfileIo, RefusesVersionsOfTheFuture) {
  const Error error = error_after([](Json& j) { j["version"] = 2; });
  EXPECT_EQ(error.code, ErrorCode::unsupported);
  EXPECT_EQ(error.where, "version");
}

TEST(ProfileIo, RefusesKeysThatAreThereTwice) {
  const std::string good = *profile_text(awkward_profile());
  const std::size_t at = good.find("\"bits\": 14,");
  const std::string text = good.substr(0, at).append("\"bits\": 12, ").append(good.substr(at));
  EXPECT_EQ(parse_profile(text).error().where, "gains.sensor.bits");
}

TEST(ProfileIo, ObjectsOfManyKeysAreRefusedBeforeTheyTakeTime) {
  // 100,000 keys compared each with all others took 20 s; reading past them takes some hundredths.
  std::string text = "{";
  for (int i = 0; i < 100'000; ++i) text += "\"" + std::to_string(i) + "\":1,";
  const auto start = std::chrono::steady_clock::now();
  const auto read = parse_profile(text + "\"format\":1}");
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(2));
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().message, "profile: an object has more than 64 keys");
}

TEST(ProfileIo, ListsOfManyObjectsAreReadInLinearTime) {
  // The JSON library's callbacks made 200,000 objects take about 30 s; 0.1 s is usual.
  std::string text = "{\"a\":[{}";
  for (int i = 1; i < 200'000; ++i) text += ",{}";
  const auto start = std::chrono::steady_clock::now();
  EXPECT_FALSE(parse_profile(text + "]}"));
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(5));
}

TEST(ProfileIo, DamagedTextNamesAByteWithinTheFile) {
  const auto read = parse_profile("{\n\"format\": ");
  ASSERT_FALSE(read);
  EXPECT_NE(read.error().message.find("line 2 cannot be read, near byte 12 of 12"), std::string::npos)
      << read.error().message;
}

TEST(ProfileIo, RefusesWhatIsNoProfile) {
  const std::string good = *profile_text(awkward_profile());
  for (const std::string& text :
       {std::string(), std::string("{"), std::string("[]"), std::string("null"), std::string("\0", 1),
        std::string("{}"), good.substr(0, good.size() / 2), good + "x", std::string(1000000, '['),
        std::string("{\"format\": \"\xff\"}"), std::string("{\"version\": 1e999}")}) {
    EXPECT_FALSE(parse_profile(text));
  }
  EXPECT_EQ(parse_profile(std::string(largest_profile_bytes + 1, ' ')).error().code, ErrorCode::too_large);
}

TEST(ProfileIo, RefusesToWriteWhatItWouldNotRead) {
  const auto where = [](const std::function<void(CameraProfile&)>& change) {
    CameraProfile profile = awkward_profile();
    change(profile);
    const auto text = profile_text(profile);
    return text ? "none" : text.error().where;
  };
  const double nan = std::nan(""), infinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(where([](CameraProfile&) {}), "none");
  EXPECT_EQ(where([&](CameraProfile& p) { p.gains[0].sensor->read_noise_e = nan; }),
            "gains[0].sensor.read_noise_e.value");
  EXPECT_EQ(where([&](CameraProfile& p) { p.gains[0].errors.prnu = infinity; }), "gains[0].sensor.prnu.standard_error");
  EXPECT_EQ(where([](CameraProfile& p) { p.gains[0].sensor->bits = 17; }), "gains[0].sensor.bits");
  EXPECT_EQ(where([](CameraProfile& p) { p.gains[0].hot_pixels.resize(100001); }), "gains[0].hot_pixels");
  EXPECT_EQ(where([](CameraProfile& p) { p.gains[0].sensor->white_level_dn = 3; }), "gains[0].sensor");
  EXPECT_EQ(where([](CameraProfile& p) { p.make = std::string(1, char{-1}); }), "");
}

}  // namespace
}  // namespace lowlux::calib
