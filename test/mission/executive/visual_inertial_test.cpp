// The executive with synthetic vision estimates: the active estimator causes an event of the
// machine, is a variable of guards, and a reason to replan.

#include <algorithm>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "mission/executive/executive.h"

namespace dive::mission {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

constexpr const char* kMission = R"(<mission xmlns="urn:dive:mission:1" id="test">
  <vehicle model="aqua2" speed="0.4" attitude="horizontal"/>
  <map file="none.sdf" fixes="off"/>
  <start x="0" y="0" z="3" z_units="DEPTH" heading_deg="90"/>
  <limits max_depth="6" min_altitude="0.3" clearance="0.6" mission_timeout="100"
          battery_reserve="0.2"/>
  <estimation estimator="visual_inertial"/>
  <failsafes><localisation_lost rung="hold" margin="3" persistence="0.2"/></failsafes>
  <states initial="far">
    <goto id="far" x="30" y="0" z="3" z_units="DEPTH" timeout="90" on_timeout="up">
      <transition event="estimator.switched" cond="estimator == primitive and elapsed &gt; 6 s"
                  target="wait"/>
      <transition event="loop.closed"><log message="place recognised"/></transition>
    </goto>
    <hold id="wait" duration="50"><transition event="done.state.wait" target="up"/></hold>
    <surface id="up"><transition event="done.state.up" target="end"/></surface>
    <final id="end"/>
  </states>
</mission>)";

class VisualInertialExecutiveTest : public ::testing::Test {
 protected:
  void SetUp() override { use(kMission); }

  void use(const std::string& text) {
    Diagnostics diagnostics;
    model_ = *vehicle::parse_urdf(vehicle::aqua2_urdf(), diagnostics);
    mission_ =
        parse_mission(SourceText("test.xml", text), diagnostics, MapFile::kNotNeeded).value();
    executive_.emplace(mission_, world_, model_, ExecutiveOptions{});
  }

  StepOutputs tick() {
    now_ += 20'000;
    StepInputs inputs;
    inputs.now = now_;
    noise_ = -noise_;
    inputs.imu = ImuSample{now_, from_rpy(0, 0, noise_), Eigen::Vector3d::Zero(), {0, 0, 9.81}};
    inputs.depth = DepthSample{now_, 3.0 + noise_};
    inputs.health = HealthSample{now_, 1.0, 20.0, false};
    if (query_) {
      PlanReply reply;
      reply.id = query_->id;
      reply.plan.status = planning::PlanStatus::kSuccess;
      reply.plan.accepted = true;
      reply.plan.waypoints = {query_->request.start, query_->request.goal};
      reply.plan.clearance_m = 1.0;
      inputs.plan = reply;
      query_.reset();
    }
    if (sees_ && now_ % 60'000 == 0) inputs.vision = update();
    if (mission_.unknown) inputs.free_ahead = planning::FreeAhead{now_ - 40'000, 3.0};
    inputs.map_correction = std::exchange(map_correction_, std::nullopt);
    StepOutputs outputs = executive_->step(inputs);
    if (outputs.plan_query) {
      query_ = outputs.plan_query;
      causes_.push_back(query_->cause);
    }
    for (const auto& t : outputs.transitions) events_.push_back(t.event);
    for (const auto& a : outputs.actions) notes_.push_back(a.text);
    for (const auto& f : outputs.failsafes) rungs_.push_back(f.rung + " " + f.cause);
    return outputs;
  }

  [[nodiscard]] estimation::VisionEstimate update() const {
    estimation::VisionEstimate update;
    update.frame_utime = now_ - 40'000;
    update.period_s = 0.06;
    update.fault = fault_;
    update.loops = loops_;
    update.estimate.utime = update.frame_utime;
    update.estimate.valid = true;
    update.estimate.X_WB.p = {0.0, 0.1, -3.0};
    update.estimate.X_WB.q = from_rpy(0.0, 0.0, yaw_offset_);
    update.estimate.v_WB_B = v_B_;
    update.estimate.covariance = sigma_ * sigma_ * Matrix6d::Identity();
    return update;
  }

  StepOutputs run(double seconds) {
    StepOutputs outputs;
    for (const Utime end = now_ + from_seconds(seconds); now_ < end;) outputs = tick();
    return outputs;
  }

  Mission mission_;
  planning::World world_;
  vehicle::Model model_;
  std::optional<Executive> executive_;
  Utime now_ = 0;
  double noise_ = 1e-4;
  bool sees_ = true;
  double sigma_ = 0.03;
  double yaw_offset_ = 0.0;  ///< rad, from the compass heading to the true one.
  Eigen::Vector3d v_B_ = Eigen::Vector3d::Zero();
  estimation::ClosedLoops loops_;
  std::optional<MapCorrection> map_correction_;  ///< In the next tick.
  estimation::VisionFault fault_ = estimation::VisionFault::kNone;
  std::optional<PlanQuery> query_;
  std::vector<std::string> events_, notes_, causes_, rungs_;
};

// In a known environment loops correct the estimates, and there is no map to move.
TEST_F(VisualInertialExecutiveTest, InAnUnknownEnvironmentALoopMovesTheVehicleItsTrailAndItsPlan) {
  const std::string known = "file=\"none.sdf\" fixes=\"off\"";
  for (const bool is_unknown : {true, false}) {
    std::string text = kMission;
    if (is_unknown) {
      text.replace(text.find(known), known.size(),
                   "unknown=\"optimistic\" mapping_sensor=\"stereo\"");
    }
    use(text);
    causes_.clear();
    const Eigen::Vector3d before = run(3.0).estimate.X_WB.p;
    const Eigen::Vector3d trail_before = executive_->trail().breadcrumbs().front().p_W;
    const Eigen::Vector3d moved(0.5, -0.2, 0.0);
    map_correction_ = MapCorrection{{{0, {0.0, moved.head<2>()}}}};
    const Eigen::Vector3d expected = is_unknown ? Eigen::Vector3d(before + moved) : before;
    EXPECT_LT((tick().estimate.X_WB.p - expected).norm(), 0.01);
    EXPECT_LT((executive_->trail().breadcrumbs().front().p_W - trail_before -
               (is_unknown ? moved : Eigen::Vector3d::Zero()))
                  .norm(),
              1e-9);
    EXPECT_LT((run(2.0).estimate.X_WB.p - expected).norm(), 0.02) << "vision does not pull back";
    EXPECT_EQ(std::ranges::count(causes_, "position corrected"), is_unknown ? 1 : 0);
  }
}

TEST_F(VisualInertialExecutiveTest, AChangeOfEstimatorIsAnEventAVariableAndAReasonToReplan) {
  EXPECT_EQ(run(1.0).estimate.source, estimation::EstimatorKind::kVisualInertial);
  EXPECT_THAT(notes_,
              Contains("estimator visual_inertial: the visual-inertial estimates are good"));
  run(5.0);
  EXPECT_THAT(causes_, Contains("estimator switched"));
  EXPECT_THAT(events_, ::testing::Not(Contains("estimator.switched"))) << "its guard is false";
  fault_ = estimation::VisionFault::kBlurred;
  const StepOutputs outputs = run(0.5);
  EXPECT_EQ(outputs.estimate.source, estimation::EstimatorKind::kPrimitive);
  EXPECT_THAT(notes_, Contains("estimator primitive: the images are blurred"));
  EXPECT_THAT(events_, Contains("estimator.switched"));
  EXPECT_EQ(outputs.status.state, "wait");
}

// The stored drift is over ground and may be an error of vision: the flippers act through the
// water.
TEST_F(VisualInertialExecutiveTest, ADriftThatVisionLeavesBehindIsNotBrakedAgainst) {
  v_B_ = {0.6, 0.0, 0.0};
  run(6.0);
  fault_ = estimation::VisionFault::kBlurred;
  const StepOutputs outputs = run(6.0);
  ASSERT_EQ(outputs.status.state, "wait");
  EXPECT_GT(outputs.estimate.v_WB_B.x(), 0.1) << "a drift is remembered";
  EXPECT_NEAR(outputs.rates.surge, 0.0, 0.01);
}

// Vision has estimated that the compass is 10 degrees off. Commands are headings of the estimate:
// if it points as commanded, the flippers have nothing to turn.
TEST_F(VisualInertialExecutiveTest, ACompassErrorThatVisionHasCorrectedIsNotFlown) {
  yaw_offset_ = deg_to_rad(10.0);
  run(6.0);
  fault_ = estimation::VisionFault::kBlurred;
  const StepOutputs outputs = run(6.0);
  ASSERT_EQ(outputs.status.state, "wait");
  ASSERT_NEAR(to_rpy(outputs.estimate.X_WB.q).z(), yaw_offset_, 0.01) << "it is remembered";
  ASSERT_NEAR(to_rpy(outputs.command.o).z(), yaw_offset_, 0.01) << "it stays as it is";
  EXPECT_NEAR(outputs.rates.yaw, 0.0, 0.01);
}

TEST_F(VisualInertialExecutiveTest, ALoopClosureIsReportedOnceAndIsAnEvent) {
  run(1.0);
  loops_ = {1, 10'000'000, 95'000'000, 0.25, 0.02};
  run(1.0);
  const std::string note =
      "loop closed: recognised the place of 85 s before: corrected by 0.250 m and 1.15 deg";
  EXPECT_THAT(notes_, Contains(note).Times(1));
  EXPECT_THAT(notes_, Contains("place recognised").Times(1));
  EXPECT_THAT(events_, Contains("loop.closed"));
  loops_ = {2, 11'500'000, 96'500'000, 0.004, 0.0};
  run(1.0);
  EXPECT_THAT(notes_, Contains("place recognised").Times(1)) << "the next keyframe is no news";
  loops_ = {3, 13'000'000, 98'000'000, 0.06, 0.0};
  run(1.0);
  EXPECT_THAT(notes_, Contains("place recognised").Times(2))
      << "but when it moves the vehicle, it is";
}

// A wall 1 m to port: some 0.75 m from the flippers.
TEST_F(VisualInertialExecutiveTest, TheFailsafeOfAnUncertainPositionUsesThePublishedEstimate) {
  world_.obstacles.push_back({"wall", planning::Box{{60, 1, 10}}, Pose{{0, 1.6, -5}}});
  use(kMission);
  run(2.0);
  EXPECT_THAT(rungs_, ::testing::IsEmpty());
  sigma_ = 0.5;
  run(2.0);
  EXPECT_THAT(rungs_, Contains("hold localisation_lost"));
}

TEST_F(VisualInertialExecutiveTest, AnUncertainPositionIsNoFailureWhereNothingIsNear) {
  sigma_ = 0.5;
  run(2.0);
  EXPECT_THAT(rungs_, ::testing::IsEmpty());
}

TEST_F(VisualInertialExecutiveTest, AMissionWithoutVisionIgnoresIt) {
  std::string text = kMission;
  const std::string asks = "<estimation estimator=\"visual_inertial\"/>";
  text.replace(text.find(asks), asks.size(), "<estimation estimator=\"primitive\"/>");
  use(text);
  EXPECT_EQ(run(2.0).estimate.source, estimation::EstimatorKind::kPrimitive);
  EXPECT_THAT(notes_, ::testing::IsEmpty());
}

}  // namespace
}  // namespace dive::mission
