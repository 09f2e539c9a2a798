#include "isp/model/colour/colour_difference.h"
#include "tests/support/numbers.h"

#include <gtest/gtest.h>

#include <cmath>
#include <iterator>

namespace lowlux::isp {
namespace {

using test::nan;

TEST(DeltaEab, IsTheDistance) {
  EXPECT_DOUBLE_EQ(delta_e_ab({50, 1, 2}, {53, 5, 14}), 13);
  EXPECT_DOUBLE_EQ(delta_e_ab({53, 5, 14}, {50, 1, 2}), 13);
  EXPECT_EQ(delta_e_ab({50, 1, 2}, {50, 1, 2}), 0);
  EXPECT_TRUE(std::isnan(delta_e_ab({50, 1, nan}, {50, 1, 2})));
}

TEST(DeltaE94c, HasItsCheckValuesAndKnowsTheReference) {
  // dC = 10 alone: 10 / (1 + 0.045 C) with C of the first.
  EXPECT_NEAR(delta_e_94c({60, 20, 0}, {60, 10, 0}), 10 / 1.9, 1e-12);
  EXPECT_NEAR(delta_e_94c({60, 10, 0}, {60, 20, 0}), 10 / 1.45, 1e-12);
  EXPECT_NEAR(delta_e_94c({60, 0, 0}, {60, 3, 4}), 5, 1e-12);
  // Of an independent program, six decimals.
  EXPECT_NEAR(delta_e_94c({60, 20, 10}, {60, 5, 12}), 10.052239, 1e-6);
  // colour-science 0.4 delta_E_CIE1994 at equal lightness prints 83.7792255.
  EXPECT_NEAR(delta_e_94c({60, 21.57210357, 272.22819350}, {60, 426.67945353, 72.39590835}), 83.7792255, 1e-6);
}

TEST(DeltaE94c, LightnessDoesNotCount) {
  EXPECT_EQ(delta_e_94c({10, 20, 10}, {90, 5, 12}), delta_e_94c({60, 20, 10}, {60, 5, 12}));
  EXPECT_EQ(delta_e_94c({10, 20, 10}, {90, 20, 10}), 0);
}

TEST(DeltaE94c, OfOneHueIsChromaAloneWhateverTheRounding) {
  // dH^2 is 0, its three terms are up to 1e4: what rounding leaves of it is 1e-12 either way, which as dH is 1e-6.
  for (int degrees = 0; degrees < 360; ++degrees) {
    const double h = degrees * std::acos(-1.0) / 180;
    const double found =
        delta_e_94c({50, 100 * std::cos(h), 100 * std::sin(h)}, {50, 7 * std::cos(h), 7 * std::sin(h)});
    EXPECT_NEAR(found, 93 / 5.5, 1e-6) << degrees;
  }
}

TEST(DeltaE94c, WithoutANumberThereIsNoDifference) {
  EXPECT_TRUE(std::isnan(delta_e_94c({50, nan, 0}, {50, 1, 1})));
  EXPECT_TRUE(std::isnan(delta_e_94c({50, 1, 1}, {50, 0, nan})));
}

struct SharmaPair {
  Lab first;
  Lab second;
  double delta_e;
};

// Sharma, Wu & Dalal 2005, Table 1.
constexpr SharmaPair sharma_pairs[] = {
    {{50, 2.6772, -79.7751}, {50, 0, -82.7485}, 2.0425},
    {{50, 3.1571, -77.2803}, {50, 0, -82.7485}, 2.8615},
    {{50, 2.8361, -74.0200}, {50, 0, -82.7485}, 3.4412},
    {{50, -1.3802, -84.2814}, {50, 0, -82.7485}, 1.0000},
    {{50, -1.1848, -84.8006}, {50, 0, -82.7485}, 1.0000},
    {{50, -0.9009, -85.5211}, {50, 0, -82.7485}, 1.0000},
    {{50, 0, 0}, {50, -1, 2}, 2.3669},
    {{50, -1, 2}, {50, 0, 0}, 2.3669},
    {{50, 2.4900, -0.0010}, {50, -2.4900, 0.0009}, 7.1792},
    {{50, 2.4900, -0.0010}, {50, -2.4900, 0.0010}, 7.1792},
    {{50, 2.4900, -0.0010}, {50, -2.4900, 0.0011}, 7.2195},
    {{50, 2.4900, -0.0010}, {50, -2.4900, 0.0012}, 7.2195},
    {{50, -0.0010, 2.4900}, {50, 0.0009, -2.4900}, 4.8045},
    {{50, -0.0010, 2.4900}, {50, 0.0010, -2.4900}, 4.8045},
    {{50, -0.0010, 2.4900}, {50, 0.0011, -2.4900}, 4.7461},
    {{50, 2.5, 0}, {50, 0, -2.5}, 4.3065},
    {{50, 2.5, 0}, {73, 25, -18}, 27.1492},
    {{50, 2.5, 0}, {61, -5, 29}, 22.8977},
    {{50, 2.5, 0}, {56, -27, -3}, 31.9030},
    {{50, 2.5, 0}, {58, 24, 15}, 19.4535},
    {{50, 2.5, 0}, {50, 3.1736, 0.5854}, 1.0000},
    {{50, 2.5, 0}, {50, 3.2972, 0}, 1.0000},
    {{50, 2.5, 0}, {50, 1.8634, 0.5757}, 1.0000},
    {{50, 2.5, 0}, {50, 3.2592, 0.3350}, 1.0000},
    {{60.2574, -34.0099, 36.2677}, {60.4626, -34.1751, 39.4387}, 1.2644},
    {{63.0109, -31.0961, -5.8663}, {62.8187, -29.7946, -4.0864}, 1.2630},
    {{61.2901, 3.7196, -5.3901}, {61.4292, 2.2480, -4.9620}, 1.8731},
    {{35.0831, -44.1164, 3.7933}, {35.0232, -40.0716, 1.5901}, 1.8645},
    {{22.7233, 20.0904, -46.6940}, {23.0331, 14.9730, -42.5619}, 2.0373},
    {{36.4612, 47.8580, 18.3852}, {36.2715, 50.5065, 21.2231}, 1.4146},
    {{90.8027, -2.0831, 1.4410}, {91.1528, -1.6435, 0.0447}, 1.4441},
    {{90.9257, -0.5406, -0.9208}, {88.6381, -0.8985, -0.7239}, 1.5381},
    {{6.7747, -0.2908, -2.4247}, {5.8714, -0.0985, -2.2286}, 0.6377},
    {{2.0776, 0.0795, -1.1350}, {0.9033, -0.0636, -0.5514}, 0.9082},
};
static_assert(std::size(sharma_pairs) == 34);

TEST(Ciede2000, AgreesWithAll34PairsOfSharmaWuDalal) {
  for (const SharmaPair& pair : sharma_pairs) {
    EXPECT_NEAR(ciede2000(pair.first, pair.second), pair.delta_e, 1e-4) << pair.first.a << " " << pair.first.b;
    EXPECT_NEAR(ciede2000(pair.second, pair.first), pair.delta_e, 1e-4) << pair.first.a << " " << pair.first.b;
  }
}

TEST(Ciede2000, IsZeroForEqualColoursAndPureLightnessHasItsClosedForm) {
  EXPECT_EQ(ciede2000({40, 12, -7}, {40, 12, -7}), 0);
  EXPECT_NEAR(ciede2000({49, 0, 0}, {51, 0, 0}), 2, 1e-12);  // S_L = 1 at a mean of 50
}

}  // namespace
}  // namespace lowlux::isp
