#include "mission/document/guard.h"

#include <cmath>
#include <functional>
#include <limits>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

namespace dive::mission {
namespace {

// An expression with its text and its value, computed by C++'s own operators.
struct Truth {
  std::string text;
  std::function<bool(const GuardVariables&)> meaning;
};
struct Number {
  std::string text;
  std::function<double(const GuardVariables&)> meaning;
};

rc::Gen<std::string> blanks() { return rc::gen::element<std::string>(" ", "  ", "\t", "\n "); }

enum class Kind { kLength, kTime, kFraction, kTemperature };

rc::Gen<Number> variable_of(Kind kind) {
  const auto variable = [](std::string name, double GuardVariables::*member) {
    return Number{std::move(name), [member](const GuardVariables& v) { return v.*member; }};
  };
  switch (kind) {
    case Kind::kLength:
      return rc::gen::element(variable("depth", &GuardVariables::depth),
                              variable("altitude", &GuardVariables::altitude),
                              variable("distance_to_goal", &GuardVariables::distance_to_goal),
                              variable("clearance", &GuardVariables::clearance),
                              variable("cross_track", &GuardVariables::cross_track),
                              variable("position_sigma", &GuardVariables::position_sigma),
                              variable("penetration", &GuardVariables::penetration));
    case Kind::kTime:
      return rc::gen::element(variable("elapsed", &GuardVariables::elapsed),
                              variable("state_elapsed", &GuardVariables::state_elapsed));
    case Kind::kFraction:
      return rc::gen::element(variable("battery_fraction", &GuardVariables::battery_fraction),
                              variable("budget_used", &GuardVariables::budget_used));
    case Kind::kTemperature:
      break;
  }
  return rc::gen::just(variable("temperature", &GuardVariables::temperature));
}

// Numbers of a kind, with or without a unit: quarters, so that the products below are exact.
rc::Gen<Number> literal_of(Kind kind) {
  std::vector<std::pair<std::string, double>> units = {{"", 1.0}};
  if (kind == Kind::kLength) units.insert(units.end(), {{"m", 1.0}, {" m", 1.0}, {"km", 1000.0}});
  if (kind == Kind::kTime) units.insert(units.end(), {{"s", 1.0}, {" min", 60.0}, {"h", 3600.0}});
  return rc::gen::map(rc::gen::tuple(rc::gen::inRange(-40, 41), rc::gen::elementOf(units)),
                      [](const std::tuple<int, std::pair<std::string, double>>& t) {
                        const double written = std::get<0>(t) / 4.0;
                        const auto& [unit, scale] = std::get<1>(t);
                        const double value = written * scale;
                        return Number{fmt::format("{}{}", written, unit),
                                      [value](const GuardVariables&) { return value; }};
                      });
}

rc::Gen<Number> arbitrary_number(Kind kind) {
  return rc::gen::oneOf(literal_of(kind), variable_of(kind));
}

Truth comparison(const Number& a, const std::string& op, const Number& b,
                 const std::string& blank) {
  return {a.text + blank + op + blank + b.text, [a, op, b](const GuardVariables& v) {
            const double x = a.meaning(v);
            const double y = b.meaning(v);
            if (op == "<") return x < y;
            if (op == "<=") return x <= y;
            if (op == ">") return x > y;
            if (op == ">=") return x >= y;
            return op == "==" ? x == y : x != y;
          }};
}

// `level`: 0 may be an "or", 1 an "and", 2 a "not", 3 needs parentheses for any of them.
rc::Gen<Truth> arbitrary_truth(int depth, int level);

rc::Gen<Truth> arbitrary_chain(int depth, bool is_or) {
  const int level = is_or ? 1 : 2;
  return rc::gen::map(rc::gen::tuple(arbitrary_truth(depth - 1, level),
                                     arbitrary_truth(depth - 1, level), blanks()),
                      [is_or](const std::tuple<Truth, Truth, std::string>& t) {
                        const auto& [a, b, blank] = t;
                        return Truth{a.text + blank + (is_or ? "or" : "and") + blank + b.text,
                                     [a, b, is_or](const GuardVariables& v) {
                                       return is_or ? a.meaning(v) || b.meaning(v)
                                                    : a.meaning(v) && b.meaning(v);
                                     }};
                      });
}

rc::Gen<Truth> arbitrary_truth(int depth, int level) {
  const auto compared = rc::gen::map(
      rc::gen::mapcat(
          rc::gen::element(Kind::kLength, Kind::kTime, Kind::kFraction, Kind::kTemperature),
          [](Kind kind) {
            return rc::gen::tuple(arbitrary_number(kind),
                                  rc::gen::element<std::string>("<", "<=", ">", ">=", "==", "!="),
                                  arbitrary_number(kind), rc::gen::element<std::string>("", " "));
          }),
      [](const std::tuple<Number, std::string, Number, std::string>& t) {
        return comparison(std::get<0>(t), std::get<1>(t), std::get<2>(t), std::get<3>(t));
      });
  const auto overhead =
      rc::gen::just(Truth{"overhead", [](const GuardVariables& v) { return v.overhead; }});
  if (depth == 0) return rc::gen::oneOf(compared, overhead);
  const auto inside = rc::gen::map(arbitrary_truth(depth - 1, 0), [](const Truth& a) {
    return Truth{"(" + a.text + ")", a.meaning};
  });
  const auto negated = rc::gen::map(arbitrary_truth(depth - 1, 3), [](const Truth& a) {
    return Truth{"not " + a.text, [a](const GuardVariables& v) { return !a.meaning(v); }};
  });
  if (level >= 3) return rc::gen::oneOf(compared, overhead, inside);
  if (level == 2) return rc::gen::oneOf(compared, overhead, inside, negated);
  if (level == 1) return rc::gen::oneOf(compared, inside, negated, arbitrary_chain(depth, false));
  return rc::gen::oneOf(compared, negated, arbitrary_chain(depth, false),
                        arbitrary_chain(depth, true));
}

rc::Gen<GuardVariables> arbitrary_variables() {
  const auto value = rc::gen::map(rc::gen::inRange(-40, 41), [](int quarter) {
    return quarter == 40 ? std::numeric_limits<double>::infinity() : quarter / 4.0;
  });
  return rc::gen::map(rc::gen::tuple(rc::gen::container<std::vector<double>>(12, value),
                                     rc::gen::arbitrary<bool>()),
                      [](const std::tuple<std::vector<double>, bool>& t) {
                        const std::vector<double>& v = std::get<0>(t);
                        return GuardVariables{v[0], v[1], v[2], v[3],  v[4],  v[5],          v[6],
                                              v[7], v[8], v[9], v[10], v[11], std::get<1>(t)};
                      });
}

RC_GTEST_PROP(Guard, MeansWhatItSays, ()) {
  const Truth truth = *arbitrary_truth(4, 0);
  RC_PRE(truth.text.size() <= Guard::kMaxLength);
  Guard::Error error;
  const std::optional<Guard> guard = Guard::parse(truth.text, error);
  if (!guard) RC_FAIL(truth.text + ": " + error.message);
  for (int i = 0; i < 10; ++i) {
    const GuardVariables variables = *arbitrary_variables();
    RC_ASSERT(guard->evaluate(variables) == truth.meaning(variables));
  }
}

// For any text, parsing ends with a guard or with an error that points into the text.
RC_GTEST_PROP(Guard, AnswersToAnything, ()) {
  const auto words = *rc::gen::container<std::vector<std::string>>(rc::gen::element<std::string>(
      "depth", "overhead", "and", "or", "not", "(", ")", "<", ">=", "==", "=", "!", "3", "-", ".5",
      "1e9", "1e999", "3m", "min", "%", "estimator", "primitive", "&&", "\xc3\xa9", "x", " ",
      "\xff"));
  std::string text;
  for (const std::string& word : words) text += word + (*rc::gen::arbitrary<bool>() ? " " : "");
  Guard::Error error;
  const std::optional<Guard> guard = Guard::parse(text, error);
  if (guard) {
    RC_ASSERT(guard->text() == text);
    static_cast<void>(guard->evaluate({}));
  } else {
    RC_ASSERT(error.offset <= text.size());
    RC_ASSERT(!error.message.empty());
  }
}

TEST(Guard, NotBindsTighterThanAndAndThatThanOr) {
  Guard::Error error;
  GuardVariables variables;
  variables.overhead = true;
  const auto is_true = [&](const char* text) {
    const std::optional<Guard> guard = Guard::parse(text, error);
    EXPECT_TRUE(guard) << text << ": " << error.message;
    return guard && guard->evaluate(variables);
  };
  EXPECT_TRUE(is_true("overhead or overhead and not overhead"));
  EXPECT_FALSE(is_true("(overhead or overhead) and not overhead"));
  EXPECT_FALSE(is_true("not overhead or not overhead"));
  EXPECT_TRUE(is_true("not not overhead"));
  EXPECT_TRUE(is_true("(depth) == - 0.0"));
}

TEST(Guard, ReadsPercentAndEstimators) {
  Guard::Error error;
  GuardVariables variables;
  variables.battery_fraction = 0.35;
  variables.estimator = EstimatorName::kVisualInertial;
  for (const char* text : {"battery_fraction < 40 %", "battery_fraction > 30%",
                           "estimator == visual_inertial", "primitive != estimator"}) {
    const std::optional<Guard> guard = Guard::parse(text, error);
    ASSERT_TRUE(guard) << text << ": " << error.message;
    EXPECT_TRUE(guard->evaluate(variables)) << text;
  }
}

TEST(Guard, ComparisonsWithNanAreFalse) {
  Guard::Error error;
  GuardVariables variables;
  variables.altitude = std::nan("");
  for (const char* text : {"altitude < 1", "altitude >= 1", "altitude == altitude"}) {
    EXPECT_FALSE(Guard::parse(text, error)->evaluate(variables)) << text;
  }
  EXPECT_TRUE(Guard::parse("altitude != altitude", error)->evaluate(variables));
}

struct BadGuard {
  std::string text;
  std::size_t offset;
  std::string phrase;
};

class Bad : public ::testing::TestWithParam<BadGuard> {};

TEST_P(Bad, IsRefusedAtTheRightPlace) {
  const BadGuard& bad = GetParam();
  Guard::Error error;
  EXPECT_FALSE(Guard::parse(bad.text, error));
  EXPECT_EQ(error.offset, bad.offset) << bad.text << ": " << error.message;
  EXPECT_NE((error.message + " " + error.hint).find(bad.phrase), std::string::npos)
      << bad.text << ": " << error.message << " / " << error.hint;
}

INSTANTIATE_TEST_SUITE_P(
    Guards, Bad,
    ::testing::Values(
        BadGuard{"", 0, "empty"}, BadGuard{"  ", 0, "empty"}, BadGuard{"depth", 0, "'depth > 3'"},
        BadGuard{"depth >", 7, "the end"}, BadGuard{"depth > > 3", 8, "'>'"},
        BadGuard{"depth and 3", 0, "true or false"},
        BadGuard{"overhead and 3", 13, "true or false"},
        BadGuard{"not (depth)", 4, "true or false"}, BadGuard{"1 < overhead", 4, "only numbers"},
        BadGuard{"(depth > 1) == (depth > 2)", 0, "only numbers"},
        BadGuard{"depth > 3)", 9, "no '('"}, BadGuard{"((depth > 3)", 12, "expected ')'"},
        BadGuard{"depth > 3 overhead", 10, "expected 'and'"},
        BadGuard{"depth > 3 or altitud < 1", 13, "did you mean 'altitude'?"},
        BadGuard{"salinity > 3", 0, "the variables are depth, altitude"},
        BadGuard{"depth > 0,5", 9, "decimal point"}, BadGuard{"depth > 3ft", 9, "no unit 'ft'"},
        BadGuard{"depth > 3 ft", 10, "found 'ft'"},
        BadGuard{"depth > 3 min", 8, "a length cannot be compared with a time"},
        BadGuard{"depth < elapsed", 8, "a length cannot be compared with a time"},
        BadGuard{"40 % < depth", 7, "a fraction cannot be compared with a length"},
        BadGuard{"estimator == 1", 13, "an estimator cannot be compared with a number"},
        BadGuard{"estimator < primitive", 12, "no order"},
        BadGuard{"estimator", 0, "'estimator == primitive'"},
        BadGuard{"depth > 1.2.3", 8, "not a number"}, BadGuard{"depth > 1e999", 8, "out of range"},
        BadGuard{"depth > nan", 8, "no variable 'nan'"}, BadGuard{"depth > -overhead", 9, "'-'"},
        BadGuard{"depth > 3 && overhead", 10, "write 'and'"},
        BadGuard{"depth > 3 || overhead", 10, "write 'or'"},
        BadGuard{"!overhead", 0, "write 'not'"}, BadGuard{"depth = 3", 6, "'=='"},
        BadGuard{"0 < depth < 3", 10, "chained"}, BadGuard{"overhead and \xc3\xa9", 13, "\xc3\xa9"},
        BadGuard{"and", 0, "'and'"}, BadGuard{std::string("depth > 3\0", 10), 9, ""},
        BadGuard{std::string(33, '(') + "overhead" + std::string(33, ')'), 32, "nested"},
        BadGuard{std::string(513, ' '), 512, "longer than 512"}));

TEST(Guard, BoundsAreInclusive) {
  Guard::Error error;
  EXPECT_TRUE(Guard::parse(std::string(32, '(') + "overhead" + std::string(32, ')'), error));
  const std::string filled = "overhead" + std::string(512 - 8, ' ');
  EXPECT_TRUE(Guard::parse(filled, error));
  std::string long_chain = "overhead";
  while (long_chain.size() + 12 <= Guard::kMaxLength) long_chain += " or overhead";
  ASSERT_TRUE(Guard::parse(long_chain, error)) << error.message;
  EXPECT_FALSE(Guard::parse(long_chain, error)->evaluate({}));
  std::string many = "0<1";
  while (many.size() + 8 <= Guard::kMaxLength) many += " and 0<1";
  EXPECT_TRUE(Guard::parse(many, error)->evaluate({}));
}

}  // namespace
}  // namespace dive::mission
