#include "planning/map_matching/map_matcher.h"

#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include "common/random.h"
#include "planning/map_matching/map_agreement.h"
#include "test/planning/map_matching/place.h"

namespace dive::planning {
namespace {

using Eigen::Vector3d;

using testing::kReach;
using testing::Place;
using testing::UprightBox;

Place room() {
  return {-4.0,
          {{{6.0, 1.0, -2.0}, {1.0, 5.0, 4.0}, 0.2},
           {{3.0, 4.0, -3.0}, {2.0, 0.5, 2.0}, -0.4},
           {{3.5, -2.5, -3.5}, {0.6, 0.6, 1.0}, 0.7}}};
}

const Pose kTruth{{0.3, 0.4, -2.0}, from_rpy(0.05, -0.1, 0.15)};

PosePrior prior_off_by(double x, double y, double yaw, double sigma_m, double sigma_yaw) {
  PosePrior prior;
  prior.X_WB = Pose{kTruth.p + Vector3d(x, y, 0.0), from_rpy(0.0, 0.0, yaw) * kTruth.q};
  prior.heading_correction = yaw;
  prior.covariance.diagonal() << sigma_m * sigma_m, sigma_m * sigma_m, sigma_yaw * sigma_yaw;
  return prior;
}

// The most likely error of position and heading that a fix leaves.
Vector3d error_of(const MapFix& fix) {
  const Vector3d step = fix.information.ldlt().solve(fix.gradient);
  return Vector3d(fix.position_W.x() - kTruth.p.x(), fix.position_W.y() - kTruth.p.y(),
                  fix.heading_correction) +
         step;
}

TEST(MapMatcher, FindsThePositionAndTheHeadingInARoom) {
  const Place place = room();
  const MapMatcher matcher(place.map());
  Random random(1);
  for (const Vector3d& off :
       {Vector3d(0.1, -0.08, 0.03), Vector3d(-0.25, 0.2, -0.05), Vector3d(0.0, 0.0, 0.0)}) {
    const MapFix fix = matcher.match(place.scan(kTruth, random),
                                     prior_off_by(off.x(), off.y(), off.z(), 0.2, 0.04));
    ASSERT_EQ(fix.problem, MapFixProblem::kNone);
    EXPECT_TRUE(is_well_formed(fix));
    const Vector3d error = error_of(fix);
    EXPECT_LT(error.head<2>().norm(), 0.02);
    EXPECT_LT(std::abs(error.z()), 0.005);
    EXPECT_LT(fix.gated, fix.used / 10);
  }
}

TEST(MapMatcher, AFloorGivesTheHeightThatNoSensorMeasures) {
  const Place place;
  const MapMatcher matcher(place.map());
  Random random(9);
  PosePrior prior = prior_off_by(0.0, 0.0, 0.0, 0.05, 0.02);
  prior.X_WB.p.z() += 0.3;
  prior.height_sigma_m = 0.5;
  const MapFix fix = matcher.match(place.scan(kTruth, random), prior);
  ASSERT_EQ(fix.problem, MapFixProblem::kNone);
  EXPECT_NEAR(fix.height_W, kTruth.p.z(), 0.03);
  EXPECT_GT(fix.height_sigma_m, 0.0);
  EXPECT_LT(fix.height_sigma_m, 0.05);
}

TEST(MapMatcher, AWallGivesNoInformationAlongItself) {
  const Place place{-4.0, {{{5.0, 0.0, -2.0}, {1.0, 60.0, 4.0}, 0.3}}};
  const MapMatcher matcher(place.map());
  Random random(2);
  const MapFix fix =
      matcher.match(place.scan(kTruth, random), prior_off_by(0.05, 0.05, 0.0, 0.1, 0.02));
  ASSERT_EQ(fix.problem, MapFixProblem::kNone);
  const Eigen::Vector2d along(-std::sin(0.3), std::cos(0.3));
  const Eigen::Vector2d across(std::cos(0.3), std::sin(0.3));
  const Eigen::Matrix2d information = fix.information.topLeftCorner<2, 2>();
  EXPECT_LT(along.dot(information * along), 1.0) << "less than a sigma of 1 m";
  EXPECT_GT(across.dot(information * across), 1000.0) << "a sigma of 3 cm";
}

TEST(MapMatcher, ABareFloorGivesNoInformation) {
  const Place place;
  const MapMatcher matcher(place.map());
  Random random(3);
  const MapFix fix =
      matcher.match(place.scan(kTruth, random), prior_off_by(0.3, 0.1, 0.1, 0.3, 0.1));
  ASSERT_EQ(fix.problem, MapFixProblem::kNone);
  EXPECT_LT(fix.information.norm(), 1e-6);
  EXPECT_LT(fix.gradient.norm(), 1e-6);
}

// Ground that slopes by 15 degrees: a camera that is turned by half a degree in its mount measures
// it centimetres off, which is no information about the position.
TEST(MapMatcher, AnErrorOfTiltIsNoPositionOnSlopingGround) {
  const Vector3d normal = Vector3d(-std::sin(0.26), 0.0, std::cos(0.26));
  World world;
  world.obstacles.push_back({"slope", HalfSpace{normal}, Pose{{0.0, 0.0, -4.0}, {1, 0, 0, 0}}});
  const MapMatcher matcher(world);
  const Pose X_WB{{0.3, 0.4, -2.0}, from_rpy(0.0, 0.0, 0.15)};
  RangeScan scan;
  scan.utime = 1'000'000;
  scan.reach = kReach;
  for (int i = 0; i < 1200; ++i) {
    const Vector3d along_B =
        (from_rpy(0.0, 0.7, 0.0) *
         Vector3d(1.0, 1.7 * (0.5 - (i % 40 + 0.5) / 40.0), 1.0 * (0.5 - (i / 40 + 0.5) / 30.0)))
            .normalized();
    const Vector3d direction = X_WB.q * so3_exp(Vector3d(0.0, 0.009, 0.0)) * along_B;
    const double range = normal.dot(Vector3d(0.0, 0.0, -4.0) - X_WB.p) / normal.dot(direction);
    scan.points_B.push_back(
        ((range > 0.0 && range < kReach ? range : 2.0 * kReach) * along_B).cast<float>());
  }
  PosePrior prior;
  prior.X_WB = X_WB;
  prior.covariance.diagonal() << 0.04, 0.04, 1e-4;
  const MapFix fix = matcher.match(scan, prior);
  ASSERT_EQ(fix.problem, MapFixProblem::kNone);
  const Eigen::Matrix3d P = (fix.information + prior.covariance.inverse()).inverse();
  const Vector3d shift = P * fix.gradient + Vector3d(fix.position_W.x() - X_WB.p.x(),
                                                     fix.position_W.y() - X_WB.p.y(), 0.0);
  EXPECT_LT(shift.head<2>().norm(), 2.0 * std::sqrt(P(0, 0)));
}

// A prior that is good to centimetres decides; another one may find the place ambiguous.
TEST(MapMatcher, WhatTheMapLacksDoesNotMoveThePosition) {
  Place seen = room();
  const MapMatcher matcher(seen.map());
  seen.boxes.push_back({{2.5, 0.3, -3.0}, {0.5, 1.0, 2.0}, 0.1});
  Random random(4);
  for (const double sigma_m : {0.06, 0.1}) {
    const MapFix fix =
        matcher.match(seen.scan(kTruth, random), prior_off_by(0.08, -0.06, 0.01, sigma_m, 0.02));
    EXPECT_GT(fix.gated, fix.used / 20);
    if (sigma_m > 0.08 && fix.problem == MapFixProblem::kAmbiguous) continue;
    ASSERT_EQ(fix.problem, MapFixProblem::kNone);
    EXPECT_LT(error_of(fix).head<2>().norm(), 0.03);
  }
}

TEST(MapMatcher, AmongPipesAtEqualDistancesItReportsTheOtherPlaces) {
  Place place;
  for (int i = -10; i <= 10; ++i) {
    place.boxes.push_back({{3.0, 0.4 * i, -2.5}, {0.15, 0.15, 3.0}});
  }
  const MapMatcher matcher(place.map());
  Random random(5);
  const MapFix uncertain =
      matcher.match(place.scan(kTruth, random), prior_off_by(0.0, 0.25, 0.0, 0.25, 0.02));
  EXPECT_EQ(uncertain.problem, MapFixProblem::kAmbiguous);
  EXPECT_GT(uncertain.ambiguity, 0.05);
  const MapFix certain =
      matcher.match(place.scan(kTruth, random), prior_off_by(0.0, 0.05, 0.0, 0.03, 0.02));
  ASSERT_EQ(certain.problem, MapFixProblem::kNone);
  EXPECT_LT(std::abs(error_of(certain).y()), 0.03);
}

TEST(MapMatcher, APriorThatFixesHaveConfirmedDecidesBetweenPlacesThatFitAlike) {
  Place place;
  for (int i = -10; i <= 10; ++i) {
    place.boxes.push_back({{3.0, 0.4 * i, -2.5}, {0.15, 0.15, 3.0}});
  }
  const MapMatcher matcher(place.map());
  Random random(6);
  PosePrior prior = prior_off_by(0.0, 0.04, 0.0, 0.1, 0.02);
  const RangeScan scan = place.scan(kTruth, random);
  EXPECT_EQ(matcher.match(scan, prior).problem, MapFixProblem::kAmbiguous);
  prior.is_tracked = true;
  const MapFix tracked = matcher.match(scan, prior);
  ASSERT_EQ(tracked.problem, MapFixProblem::kNone);
  EXPECT_LT(std::abs(error_of(tracked).y()), 0.03);
}

// A row of pipes: shifted by 0.4 m it looks the same, apart from its gaps and its ends. The vehicle
// swims along it, its position wrong from the start.
class Row {
 public:
  explicit Row(const std::vector<int>& pipes) : seen_(row(pipes)), matcher_(seen_.map()) {
    for (UprightBox& box : seen_.boxes) {
      box.centre += 0.04 * Vector3d(random_.normal(), random_.normal(), 0.0);
    }
  }
  // The fix at a true position along the row.
  MapFix at(double y, double wrong_by) {
    const Pose truth{{0.3, y, -2.0}, from_rpy(0.0, 0.0, 0.0)};
    PosePrior prior;
    prior.X_WB = Pose{truth.p + Vector3d(0.0, wrong_by, 0.0), truth.q};
    prior.odometry_O = prior.X_WB.p.head<2>();
    prior.covariance.diagonal() << 0.04, 0.04, 0.0004;
    return matcher_.place(seen_.scan(truth, random_), prior, search_).fix;
  }

 private:
  static Place row(const std::vector<int>& pipes) {
    Place place;
    for (const int i : pipes) {
      place.boxes.push_back({{2.5, 0.4 * i, -2.5}, {0.12, 0.12, 3.0}});
    }
    return place;
  }

  Random random_{31};
  Place seen_;
  MapMatcher matcher_;
  PlaceSearch search_;
};

TEST(MapMatcher, TheEvidenceOfManyScansFindsTheRightPlaceAlongARowWithGaps) {
  Row row({-6, -5, -4, -2, -1, 0, 1, 2, 4, 5, 6, 7, 8, 9, 11, 12, 13, 14});
  MapFix fix;
  for (double y = -2.0; y < 3.0; y += 0.2) fix = row.at(y, 0.38);
  ASSERT_EQ(fix.problem, MapFixProblem::kNone) << "ambiguity " << fix.ambiguity;
  EXPECT_NEAR(fix.position_W.y(), 2.8, 0.12);
}

TEST(MapMatcher, WhileAScanIsAmbiguousOnePlaceMovesAsTheVehicleDoes) {
  std::vector<int> equal(40);
  std::iota(equal.begin(), equal.end(), -25);
  Row row(equal);
  std::optional<double> last;
  int compared = 0;
  for (double y = -2.0; y < -1.0; y += 0.02) {
    // Dead reckoning that is too slow by a tenth.
    const MapFix fix = row.at(y, 0.25 - 0.1 * (y + 2.0));
    if (fix.problem != MapFixProblem::kAmbiguous || fix.information.isZero()) {
      last.reset();
      continue;
    }
    const double now = fix.position_W.y() + fix.gradient.y() / fix.information(1, 1);
    if (last) {
      EXPECT_NEAR(now - *last, 0.02, 0.03) << y;
      ++compared;
    }
    last = now;
  }
  EXPECT_GT(compared, 3);
}

// Most of what the vehicle sees is a level floor, which fits anywhere. It must know where the pipes
// are before it is between them.
TEST(MapMatcher, FewPointsOnThinPipesTellThePositionOverALevelFloor) {
  Place place{-1.6, {}};
  for (const double y : {-1.1, 1.2}) place.boxes.push_back({{4.0, y, -0.8}, {0.1, 0.1, 1.6}});
  const MapMatcher matcher(place.map());
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    Random random(seed);
    PlaceSearch search;
    MapFix fix;
    Pose truth{{0.8, 0.0, -1.0}, Eigen::Quaterniond::Identity()};
    for (; truth.p.x() < 2.6; truth.p.x() += 0.2) {
      PosePrior prior;
      prior.X_WB = Pose{truth.p + Vector3d(0.9, -0.6, 0.0), truth.q};
      prior.odometry_O = prior.X_WB.p.head<2>();
      prior.covariance.diagonal() << 0.25, 0.25, 0.0004;
      fix = matcher.place(place.scan(truth, random), prior, search).fix;
    }
    ASSERT_EQ(fix.problem, MapFixProblem::kNone) << "ambiguity " << fix.ambiguity;
    EXPECT_NEAR(fix.position_W.x(), truth.p.x() - 0.2, 0.1) << seed;
    EXPECT_NEAR(fix.position_W.y(), truth.p.y(), 0.1) << seed;
  }
}

TEST(MapMatcher, ObjectsOffTheirPlacesMakeAFixLessCertain) {
  Place mapped;
  for (int i = 0; i < 9; ++i) {
    mapped.boxes.push_back({{2.2 + 0.9 * (i % 3), 0.8 * (i - 4), -3.0}, {0.3, 0.3, 2.0}, 0.5 * i});
  }
  const MapMatcher matcher(mapped.map());
  Random random(9);
  double sum = 0.0;
  constexpr int kScans = 60;
  for (int i = 0; i < kScans; ++i) {
    Place seen = mapped;
    for (UprightBox& box : seen.boxes) {
      box.centre += 0.1 * Vector3d(random.normal(), random.normal(), 0.0);
    }
    const MapFix fix =
        matcher.match(seen.scan(kTruth, random), prior_off_by(0.0, 0.0, 0.0, 0.1, 0.02));
    if (fix.problem != MapFixProblem::kNone) continue;
    const Vector3d error = error_of(fix);
    sum += error.dot(fix.information * error) / 3.0;
  }
  EXPECT_LT(sum / kScans, 6.0) << "13 with the weights of objects that are where they are drawn";
}

TEST(MapMatcher, APlateIsMatchedWithTheSideThatIsMet) {
  const Place place{
      -4.0,
      {{{3.0, 0.0, -2.0}, {0.02, 8.0, 4.0}, 0.0}, {{2.0, -1.2, -2.0}, {4.0, 0.02, 4.0}, 0.0}}};
  const MapMatcher matcher(place.map());
  Random random(6);
  const MapFix fix =
      matcher.match(place.scan(kTruth, random), prior_off_by(0.08, -0.08, 0.0, 0.1, 0.01));
  ASSERT_EQ(fix.problem, MapFixProblem::kNone);
  EXPECT_LT(error_of(fix).head<2>().norm(), 0.02);
}

// A box as a mesh, whose triangles may face either way.
Surface mesh_of(const UprightBox& box) {
  Surface surface{"mesh", {}};
  for (int i = 0; i < 8; ++i) {
    const Vector3d corner(i & 1 ? 0.5 : -0.5, i & 2 ? 0.5 : -0.5, i & 4 ? 0.5 : -0.5);
    surface.mesh.vertices.push_back(box.centre + Eigen::AngleAxisd(box.yaw, Vector3d::UnitZ()) *
                                                     corner.cwiseProduct(box.size));
  }
  surface.mesh.triangles = {{0, 1, 3}, {0, 3, 2}, {4, 7, 5}, {4, 6, 7}, {0, 5, 1}, {0, 4, 5},
                            {2, 3, 7}, {2, 6, 7}, {0, 6, 2}, {0, 4, 6}, {1, 7, 3}, {1, 5, 7}};
  return surface;
}

TEST(MapMatcher, AMeshGivesWhatItsPrimitiveGives) {
  const Place place = room();
  World meshes = place.map();
  meshes.obstacles.resize(1);
  for (const UprightBox& box : place.boxes) meshes.surfaces.push_back(mesh_of(box));
  Random random(7);
  const RangeScan scan = place.scan(kTruth, random);
  const PosePrior prior = prior_off_by(0.1, -0.05, 0.02, 0.1, 0.02);
  const MapFix of_primitives = MapMatcher(place.map()).match(scan, prior);
  const MapFix of_meshes = MapMatcher(meshes).match(scan, prior);
  ASSERT_EQ(of_meshes.problem, MapFixProblem::kNone);
  EXPECT_LT((error_of(of_meshes) - error_of(of_primitives)).norm(), 0.01);
  EXPECT_NEAR(of_meshes.used, of_primitives.used, 20);
}

TEST(MapMatcher, TheInformationIsThatOfTheError) {
  const Place place = room();
  const MapMatcher matcher(place.map());
  Random random(8);
  double sum = 0.0;
  constexpr int kScans = 60;
  for (int i = 0; i < kScans; ++i) {
    const MapFix fix = matcher.match(
        place.scan(kTruth, random),
        prior_off_by(0.05 * random.normal(), 0.05 * random.normal(), 0.0, 0.05, 0.02));
    const Vector3d error = error_of(fix);
    sum += error.dot(fix.information * error) / 3.0;
  }
  EXPECT_LT(sum / kScans, 1.5) << "never more certain than it is";
}

TEST(MapMatcher, AScanOfTheMappedRoomConfirmsIt) {
  const MapMatcher matcher(room().map());
  Random random(10);
  const MapAgreement places =
      matcher.match(room().scan(kTruth, random), prior_off_by(0.1, -0.1, 0.02, 0.1, 0.02))
          .agreement;
  EXPECT_GE(places.confirmed, 8) << "of a wall of 5 m and two lower boxes";
  EXPECT_EQ(places.missing, 0);
  EXPECT_EQ(places.unmapped, 0);
}

TEST(MapMatcher, WhatIsGoneAndWhatIsNewIsCountedByPlace) {
  Place seen = room();
  const MapMatcher matcher(seen.map());
  Random random(11);
  const auto places = [&] {
    return matcher.match(seen.scan(kTruth, random), prior_off_by(0.0, 0.0, 0.0, 0.05, 0.02))
        .agreement;
  };
  seen.boxes.push_back({{2.5, 0.3, -3.0}, {0.5, 1.0, 2.0}, 0.1});
  const MapAgreement with_another = places();
  EXPECT_GE(with_another.unmapped, 2);
  EXPECT_LE(with_another.unmapped, 8);
  EXPECT_EQ(with_another.missing, 0);
  EXPECT_GT(with_another.confirmed, 0);
  seen.boxes.pop_back();
  seen.boxes.erase(seen.boxes.begin());
  const MapAgreement without_wall = places();
  EXPECT_GE(without_wall.missing, 5);
  EXPECT_EQ(without_wall.unmapped, 0);
  EXPECT_EQ(with_another.missing_object, -1);
  EXPECT_EQ(without_wall.missing_object, 1) << "the floor is 0, the wall the first box";
}

// Seen from above, a ray that passes the edge of a deck at the true position meets it at an
// estimated one that is wrong by a quarter of a metre.
TEST(MapAgreement, ADeckIsNotMissingWhereOnlyItsEdgeIs) {
  Place place{-12.0, {{{4.0, 0.0, -4.0}, {4.0, 6.0, 0.2}}}};
  const World map = place.map();
  const MapSurface surface(map);
  const Pose X_WB{{-1.0, 0.0, -2.0}, from_rpy(0.0, 0.3, 0.0)};
  const auto missing = [&](const Vector3d& error) {
    Random random(14);
    RangeScan scan = place.scan(X_WB, random);
    return agreement(surface, scan, Pose{X_WB.p + error, X_WB.q}, 0.1).missing;
  };
  for (const Vector3d& error :
       {Vector3d(0.25, 0.0, 0.0), Vector3d(-0.25, 0.0, 0.0), Vector3d(0.0, 0.25, 0.0)}) {
    EXPECT_EQ(missing(error), 0) << error.transpose();
  }
  place.boxes.clear();
  EXPECT_GE(missing(Vector3d::Zero()), 4) << "a deck that is gone";
}

TEST(MapMatcher, AFlatGroundNeitherConfirmsNorContradicts) {
  const MapMatcher matcher(Place{}.map());
  Random random(12);
  const MapAgreement places =
      matcher.match(Place{}.scan(kTruth, random), prior_off_by(0.0, 0.0, 0.0, 0.1, 0.02)).agreement;
  EXPECT_EQ(places.confirmed + places.missing + places.unmapped, 0);
}

TEST(MapMatcher, AGroundThatIsDeeperThanMappedIsMissing) {
  const Place mapped{-3.2, {}};
  const MapMatcher matcher(mapped.map());
  Random random(13);
  const MapAgreement places =
      matcher.match(Place{-5.0, {}}.scan(kTruth, random), prior_off_by(0.0, 0.0, 0.0, 0.1, 0.02))
          .agreement;
  EXPECT_GT(places.missing, 5);
  EXPECT_EQ(places.confirmed, 0);
}

TEST(MapMatcher, AnUncertainPositionWithoutAFixContradictsNothing) {
  const MapMatcher matcher(room().map());
  Random random(14);
  const MapAgreement places =
      matcher.match(Place{-9.0, {}}.scan(kTruth, random), prior_off_by(0.0, 0.0, 0.0, 2.0, 0.02))
          .agreement;
  EXPECT_EQ(places.confirmed + places.missing + places.unmapped, 0);
}

RC_GTEST_PROP(MapMatcher, AnyScanGivesAWellFormedFix, ()) {
  static const MapMatcher kMatcher(room().map());
  RangeScan scan;
  const auto count = *rc::gen::inRange(0, 200);
  for (int i = 0; i < count; ++i) {
    const auto value = [] {
      return *rc::gen::oneOf(rc::gen::map(rc::gen::inRange(-2000, 2000),
                                          [](int x) { return static_cast<float>(x) / 100.0F; }),
                             rc::gen::element(std::numeric_limits<float>::quiet_NaN(),
                                              std::numeric_limits<float>::infinity(), 1e30F));
    };
    scan.points_B.emplace_back(value(), value(), value());
  }
  const MapFix fix = kMatcher.match(scan, prior_off_by(0.1, 0.1, 0.1, 0.3, 0.3));
  RC_ASSERT(is_well_formed(fix));
}

}  // namespace
}  // namespace dive::planning
