// Every kind of expectation, met and unmet, on synthetic dive records.

#include "mission/scenario/evaluation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace dive::mission {
namespace {

using ::testing::HasSubstr;
using Kind = Occurrence::Kind;

// A scenario with the expectations `written`, and a step 'leak' whose id can be referred to.
Scenario expecting(const std::string& written) {
  Diagnostics diagnostics;
  const std::string text =
      "<scenario xmlns=\"urn:dive:scenario:1\" id=\"s\" mission=\"m.xml\">\n"
      "<at time=\"10\" id=\"leak\"><fault name=\"leak\"/></at>\n<expect>\n" +
      written + "\n</expect></scenario>";
  std::optional<Scenario> scenario = parse_scenario(SourceText("s.xml", text), diagnostics);
  EXPECT_TRUE(scenario) << (diagnostics.list().empty() ? "" : render(diagnostics.list()[0], false));
  return scenario.value_or(Scenario{});
}

DiveRecord dive() {
  DiveRecord record;
  record.occurrences = {{Kind::kEntered, 0.0, "east"},
                        {Kind::kHeading, 0.0, "east"},
                        {Kind::kPayload, 1.0, "camera_on"},
                        {Kind::kReplan, 4.0, "period"},
                        {Kind::kReplan, 8.0, "period"},
                        {Kind::kStep, 10.0, "leak", {}, 0},
                        {Kind::kRung, 12.0, "abort_and_surface", "leak"},
                        {Kind::kEvent, 12.0, "failsafe.leak"},
                        {Kind::kEntered, 12.0, "dive.abort_retrace"},
                        {Kind::kLine, 13.0, "water in the hull"}};
  record.nearest_m.assign(8, 0.4);
  record.max_depth_m = 3.2;
  record.end_W = {6.0, 5.0, 0.0};
  record.result.outcome = "aborted";
  record.result.final_state = "dive.aborted";
  record.result.cause = "failsafe leak";
  record.result.duration_s = 40.0;
  record.result.distance_m = 14.0;
  record.result.nearest.clearance_m = 0.8;
  record.result.diver_clearance_m = 0.9;
  record.result.energy_wh = 0.6;
  record.result.plans = 3;
  record.result.replans = 2;
  record.result.final_depth_m = 0.1;
  record.result.final_error_m = 0.2;
  return record;
}

bool holds(const std::string& written) { return evaluate(expecting(written), dive()).at(0).passed; }

struct Pair {
  const char* so;
  const char* not_so;
};

class EveryKind : public ::testing::TestWithParam<Pair> {};

TEST_P(EveryKind, HoldsAndFails) {
  const auto& [so, not_so] = GetParam();
  EXPECT_TRUE(holds(so)) << so;
  EXPECT_FALSE(holds(not_so)) << not_so;
}

TEST_P(EveryKind, IsTheOppositeWhenTurnedRound) {
  for (const char* written : {GetParam().so, GetParam().not_so}) {
    std::string negated = written;
    negated.insert(negated.find("/>"), " not=\"true\"");
    EXPECT_NE(holds(written), holds(negated)) << written;
    Scenario scenario = expecting(written);
    scenario.expectations[0] = negate(scenario.expectations[0]);
    EXPECT_EQ(evaluate(scenario, dive())[0].passed, holds(negated));
  }
}

INSTANTIATE_TEST_SUITE_P(
    OfExpectation, EveryKind,
    ::testing::Values(
        Pair{"<outcome is=\"aborted\"/>", "<outcome is=\"success\"/>"},
        Pair{"<final_state is=\"dive.aborted\"/>", "<final_state is=\"surfaced\"/>"},
        Pair{"<enters state=\"dive.abort_retrace\"/>", "<enters state=\"dive.abort_surface\"/>"},
        Pair{"<enters state=\"dive.abort_retrace\" within=\"12\"/>",
             "<enters state=\"dive.abort_retrace\" within=\"11.9\"/>"},
        Pair{"<enters state=\"dive.abort_retrace\" within=\"2\" after=\"leak\"/>",
             "<enters state=\"dive.abort_retrace\" within=\"1.9\" after=\"leak\"/>"},
        Pair{"<enters state=\"east\"/>", "<enters state=\"east\" after=\"leak\"/>"},
        Pair{"<event name=\"failsafe.leak\"/>", "<event name=\"failsafe.battery\"/>"},
        Pair{"<rung is=\"abort_and_surface\"/>", "<rung is=\"hold\"/>"},
        Pair{"<rung is=\"abort_and_surface\" cause=\"leak\"/>",
             "<rung is=\"abort_and_surface\" cause=\"battery\"/>"},
        Pair{"<replan cause=\"period\" times=\"2\"/>", "<replan cause=\"period\" times=\"1\"/>"},
        Pair{"<replan cause=\"period\" times=\"1\" within=\"5\"/>",
             "<replan cause=\"deviation\"/>"},
        Pair{"<payload command=\"camera_on\"/>", "<payload command=\"camera_off\"/>"},
        Pair{"<line contains=\"in the hull\"/>", "<line contains=\"in the battery\"/>"},
        Pair{"<heads_for goal=\"east\"/>", "<heads_for goal=\"north\"/>"},
        Pair{"<reaches goal=\"east\" radius=\"0.5\"/>", "<reaches goal=\"east\" radius=\"0.3\"/>"},
        Pair{"<ends_near x=\"6\" y=\"4\" radius=\"1.1\"/>",
             "<ends_near x=\"6\" y=\"4\" radius=\"0.9\"/>"},
        Pair{"<collisions at_most=\"0\"/>", "<collisions at_least=\"1\"/>"},
        Pair{"<min_clearance at_least=\"0.7\"/>", "<min_clearance at_least=\"0.9\"/>"},
        Pair{"<diver_clearance at_least=\"0.85\"/>", "<diver_clearance at_most=\"0.85\"/>"},
        Pair{"<max_depth at_most=\"3.3\"/>", "<max_depth at_most=\"3.1\"/>"},
        Pair{"<final_depth at_most=\"0.2\"/>", "<final_depth at_least=\"0.2\"/>"},
        Pair{"<duration at_least=\"30\" at_most=\"50\"/>",
             "<duration at_least=\"41\" at_most=\"50\"/>"},
        Pair{"<distance at_most=\"15\"/>", "<distance at_most=\"13\"/>"},
        Pair{"<energy at_most=\"0.7\"/>", "<energy at_most=\"0.5\"/>"},
        Pair{"<plans at_least=\"3\" at_most=\"3\"/>", "<plans at_most=\"2\"/>"},
        Pair{"<replans at_most=\"2\"/>", "<replans at_most=\"1\"/>"},
        Pair{"<position_error at_most=\"0.3\"/>", "<position_error at_most=\"0.1\"/>"}));

TEST(Judge, ReportsWhatHappenedInstead) {
  const auto actual = [](const char* written) {
    return evaluate(expecting(written), dive()).at(0).actual;
  };
  EXPECT_EQ(actual("<outcome is=\"success\"/>"), "aborted (failsafe leak)");
  EXPECT_EQ(actual("<enters state=\"up\"/>"), "never; but east, dive.abort_retrace");
  EXPECT_EQ(actual("<rung is=\"hold\"/>"), "never; but abort_and_surface (leak)");
  EXPECT_EQ(actual("<replan cause=\"period\" after=\"leak\"/>"), "nothing of that kind");
  EXPECT_EQ(actual("<enters state=\"dive.abort_retrace\" within=\"1\" after=\"leak\"/>"),
            "1 time(s), after 2.00 s");
  EXPECT_EQ(actual("<max_depth at_most=\"3\"/>"), "3.2");
}

TEST(Judge, AlwaysExpectsNoCollisionAndAllScriptedSteps) {
  const Scenario scenario = expecting("<outcome is=\"aborted\"/>");
  ASSERT_EQ(scenario.expectations.size(), 3U);
  DiveRecord harmed = dive();
  harmed.result.collisions.push_back({12.5, {1, 2, -3}, "rock", std::nullopt});
  EXPECT_FALSE(evaluate(scenario, harmed)[1].passed);
  EXPECT_THAT(evaluate(scenario, harmed)[1].actual,
              HasSubstr("with 'rock' at 12.50 s and (1.00, 2.00, -3.00) m"));
  EXPECT_TRUE(evaluate(scenario, dive())[1].passed);
  DiveRecord short_dive = dive();
  std::erase_if(short_dive.occurrences,
                [](const Occurrence& one) { return one.kind == Kind::kStep; });
  EXPECT_TRUE(evaluate(scenario, dive())[2].passed);
  EXPECT_FALSE(evaluate(scenario, short_dive)[2].passed);
}

TEST(Judge, WhatIsMeasuredFromAStepThatNeverHappenedNeitherIsNorIsNot) {
  DiveRecord record = dive();
  std::erase_if(record.occurrences, [](const Occurrence& one) { return one.kind == Kind::kStep; });
  for (const char* negation : {"", " not=\"true\""}) {
    const ExpectationResult result =
        evaluate(expecting("<enters state=\"up\" after=\"leak\"" + std::string(negation) + "/>"),
                 record)
            .at(0);
    EXPECT_FALSE(result.passed);
    EXPECT_THAT(result.actual, HasSubstr("'leak' never happened"));
  }
}

TEST(Judge, NoPassedExpectationPassesNegated) {
  EXPECT_TRUE(insensitive_expectations(
                  expecting("<outcome is=\"aborted\"/><max_depth at_most=\"4\"/>"), dive())
                  .empty());
}

}  // namespace
}  // namespace dive::mission
