#include "config/quantity.h"

#include <gmock/gmock.h>

#include <cmath>

namespace opaline::config {
namespace {

TEST(Quantity, TakesANumberAndAUnitOfItsKind) {
  EXPECT_EQ(parse_quantity("33 ms", Unit::kTime), 0.033);
  EXPECT_EQ(parse_quantity("1/30 s", Unit::kTime), 1.0 / 30.0);
  EXPECT_EQ(parse_quantity(" 8s ", Unit::kTime), 8.0);
  EXPECT_EQ(parse_quantity("2.4 cm", Unit::kLength), 24.0);
  EXPECT_EQ(parse_quantity("500 um", Unit::kLength), 0.5);
  EXPECT_EQ(parse_quantity("10 deg", Unit::kAngle), 10.0);
}

TEST(Quantity, PrintsSharesInPerCent) {
  EXPECT_EQ(parse_quantity("2 %", Unit::kShare), 0.02);
  EXPECT_DOUBLE_EQ(parse_quantity("0.35%", Unit::kShare).value(), 0.0035);
  for (const char* text : {"2 %", "0.35 %", "0 %", "7 %", "14.3 %", "50 %", "100 %"})
    EXPECT_EQ(format_quantity(parse_quantity(text, Unit::kShare).value(), Unit::kShare), text);
}

TEST(Quantity, RefusesWhatIsNotOne) {
  for (const char* text :
       {"", "8", "s", "8 mm", "8 S", "1/0 s", "8 s s", "nan s", "inf s", "1e999 s"}) {
    EXPECT_EQ(parse_quantity(text, Unit::kTime), std::nullopt) << text;
  }
}

TEST(Quantity, PrintsTimesSoThatTheyReadBackToTheNanosecond) {
  for (const double ns : {1.0, 999.0, 1e3, 33'333'333.0, 16'666'667.0, 1e8, 5e8, 123'456'789.0}) {
    const std::string text = format_quantity(ns * 1e-9, Unit::kTime);
    EXPECT_EQ(std::round(parse_quantity(text, Unit::kTime).value() * 1e9), ns) << text;
  }
  EXPECT_EQ(format_quantity(0.033333333, Unit::kTime), "1/30 s");
  EXPECT_EQ(format_quantity(0.1, Unit::kTime), "100 ms");
  EXPECT_EQ(format_quantity(8.0, Unit::kTime), "8 s");
}

TEST(Quantity, SaysWhatARangeAllows) {
  EXPECT_EQ(describe(Range{}, Unit::kPlain), "");
  EXPECT_EQ(describe(Range::at_least(1), Unit::kPlain), "at least 1");
  EXPECT_EQ(describe(Range::above(0), Unit::kLength), "more than 0 mm");
  EXPECT_EQ(describe(Range::between(0, 1), Unit::kPlain), "0 to 1");
  EXPECT_EQ(describe(Range{.min = 1, .max = 16, .min_excluded = true}, Unit::kPlain),
            "more than 1, at most 16");
  constexpr Range kBelowOne{.min = 0, .max = 1, .max_excluded = true};
  EXPECT_EQ(describe(kBelowOne, Unit::kPlain), "at least 0, less than 1");
  EXPECT_TRUE(contains(kBelowOne, 0.0));
  EXPECT_FALSE(contains(kBelowOne, 1.0));
}

TEST(Quantity, FindsTheNameThatWasMeant) {
  constexpr std::array<std::string_view, 3> kNames{"regions", "retries", "reconstruction"};
  EXPECT_EQ(nearest("region", kNames), "regions");
  EXPECT_EQ(nearest("reconstuction", kNames), "reconstruction");
  EXPECT_EQ(nearest("colour", kNames), std::nullopt);
}

}  // namespace
}  // namespace opaline::config
