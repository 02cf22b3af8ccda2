// Contacts of the swept hull: their gradients against differences of the distance itself, and the
// pad against the true sweep of the vehicle.

#include "planning/trajopt/sweep_contacts.h"

#include <optional>
#include <vector>

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "common/assert.h"
#include "test/common/arbitrary.h"
#include "test/planning/reference.h"

namespace dive::planning {
namespace {

using Eigen::Vector3d;
using testing::arbitrary_double;
using testing::arbitrary_pose;
using testing::arbitrary_rotation_vector;
using testing::arbitrary_vector;
using testing::box_corners;
using testing::draw;
using testing::still;

const std::vector<Vector3d> kBody = box_corners({0.80, 0.48, 0.22});

// A segment of the path near the origin, any attitude, turning a little.
std::vector<Pose> arbitrary_segment() {
  const Pose a{draw(arbitrary_vector(1.0)), so3_exp(draw(arbitrary_rotation_vector()))};
  const Pose b{a * Vector3d(draw(arbitrary_double(0.3, 1.5)), draw(arbitrary_double(-0.2, 0.2)), 0),
               a.q * so3_exp(draw(arbitrary_vector(0.4)))};
  return {a, b};
}

std::vector<Pose> moved(std::vector<Pose> path, int k, double h) {
  Pose& pose = path[static_cast<std::size_t>(k / 6)];
  Vector6d step = h * Vector6d::Unit(k % 6);
  pose.p += step.head<3>();
  pose.q = pose.q * so3_exp(step.tail<3>());
  return path;
}

Contact contact_of(Scene& scene, const std::vector<Pose>& path) {
  std::vector<Vector3d> points;
  for (const Pose& pose : path) {
    for (const Vector3d& v : kBody) points.push_back(pose * v);
  }
  std::vector<Contact> contacts;
  scene.contacts(points, 1e6, contacts);
  return contacts.at(0);
}

// The slopes of the distance by each step, if they exist: both one-sided ones agree.
std::optional<Vector12d> numeric_gradient(Scene& scene, const std::vector<Pose>& path) {
  const double h = 1e-5;
  const double here = contact_of(scene, path).distance;
  Vector12d gradient;
  for (int k = 0; k < 12; ++k) {
    const double ahead = (contact_of(scene, moved(path, k, h)).distance - here) / h;
    const double behind = (here - contact_of(scene, moved(path, k, -h)).distance) / h;
    if (std::abs(ahead - behind) > 5e-3) return std::nullopt;
    gradient(k) = 0.5 * (ahead + behind);
  }
  return gradient;
}

// The pose of the nearest point, if each has one lowest vertex and no other near it.
enum class Toucher { kFirst, kSecond, kEdgeBetween, kUnclear };

Toucher toucher_of(const std::vector<Pose>& path, const Vector3d& n_W) {
  double lowest[2];
  for (std::size_t pose = 0; pose < 2; ++pose) {
    std::vector<double> heights;
    for (const Vector3d& v : kBody) heights.push_back(n_W.dot(path[pose] * v));
    std::sort(heights.begin(), heights.end());
    if (heights[1] - heights[0] < 5e-3) return Toucher::kUnclear;
    lowest[pose] = heights[0];
  }
  if (std::abs(lowest[0] - lowest[1]) < 1e-6) return Toucher::kEdgeBetween;
  if (std::abs(lowest[0] - lowest[1]) < 2e-3) return Toucher::kUnclear;
  return lowest[0] < lowest[1] ? Toucher::kFirst : Toucher::kSecond;
}

SweepContact only_contact(Scene& scene, const std::vector<Pose>& path) {
  SweepContacts sweep(scene, kBody);
  std::vector<SweepContact> found;
  sweep.find(path, 1e6, found);
  EXPECT_EQ(found.size(), 1U);
  return found.at(0);
}

// Walls, posts and boxes, so that the nearest feature is a face, an edge or a corner.
TEST(SweepContacts, GradientIsTheSlopeOfTheDistance) {
  int of_one_pose = 0;
  int of_the_edge = 0;
  EXPECT_TRUE(rc::check([&] {
    for (int trial = 0; trial < 20; ++trial) {
      const Vector3d size = *rc::gen::element(Vector3d(8.0, 8.0, 0.3), Vector3d(0.2, 0.2, 8.0),
                                              Vector3d(0.4, 0.3, 0.2));
      Pose X_WO = draw(arbitrary_pose());
      X_WO.p = 2.0 * X_WO.p.normalized();
      const World world{{{"o", Box{size}, X_WO}}};
      Scene scene(world);
      const std::vector<Pose> path = arbitrary_segment();
      const Contact nearest = contact_of(scene, path);
      const Toucher toucher = toucher_of(path, nearest.normal_W);
      if (nearest.distance < 0.02 || toucher == Toucher::kUnclear) continue;
      const auto expected = numeric_gradient(scene, path);
      if (!expected) continue;
      const SweepContact contact = only_contact(scene, path);
      RC_ASSERT((contact.gradient - *expected).cwiseAbs().maxCoeff() < 1e-2);
      (toucher == Toucher::kEdgeBetween ? of_the_edge : of_one_pose) += 1;
    }
  }));
  EXPECT_GT(of_one_pose, 200);
  EXPECT_GT(of_the_edge, 100);
}

TEST(SweepContacts, GradientHoldsInsideAWallToo) {
  int compared = 0;
  EXPECT_TRUE(rc::check([&] {
    const World world{{{"wall", Box{{8.0, 8.0, 2.0}}, Pose{Vector3d(0, 0, -1.0), {1, 0, 0, 0}}}}};
    Scene scene(world);
    std::vector<Pose> path = arbitrary_segment();
    const double lift = draw(arbitrary_double(-0.4, -0.05)) - contact_of(scene, path).distance;
    for (Pose& pose : path) pose.p.z() += lift;
    const Contact nearest = contact_of(scene, path);
    const auto expected = numeric_gradient(scene, path);
    const Toucher toucher = toucher_of(path, nearest.normal_W);
    if (nearest.distance >= 0.0 || !expected || toucher == Toucher::kUnclear) return;
    ++compared;
    RC_ASSERT((only_contact(scene, path).gradient - *expected).cwiseAbs().maxCoeff() < 1e-2);
  }));
  EXPECT_GT(compared, 10);
}

// A corner faces the flat side of a straight sweep, nearer to the one end or the other and above or
// below the middle: the push is divided in proportion to the corner's position along the motion.
TEST(SweepContacts, SharesThePushAsTheContactDividesTheMotion) {
  EXPECT_TRUE(rc::check([] {
    const Pose turn{draw(arbitrary_vector(1.0)), so3_exp(draw(arbitrary_rotation_vector()))};
    const double fraction = draw(arbitrary_double(0.05, 0.95));
    const double beside = draw(arbitrary_double(-0.1, 0.1));
    // The body's left side (y = 0.24) sweeps 2 m along x. The box stands on its corner.
    const Eigen::Quaterniond on_corner =
        Eigen::Quaterniond::FromTwoVectors(Vector3d(-1, -1, -1), -Vector3d::UnitY());
    const Vector3d corner(2.0 * fraction, 1.0, beside);
    const Vector3d centre = corner - on_corner * Vector3d(-0.1, -0.1, -0.1);
    const World world{{{"o", Box{{0.2, 0.2, 0.2}}, turn * Pose{centre, on_corner}}}};
    Scene scene(world);
    const std::vector<Pose> path{turn * still({0, 0, 0}), turn * still({2, 0, 0})};
    const SweepContact contact = only_contact(scene, path);
    const Vector3d away = turn.q * -Vector3d::UnitY();
    RC_ASSERT(std::abs(contact.distance - 0.76) < 1e-9);
    const Vector3d push = contact.gradient.head<3>() + contact.gradient.segment<3>(6);
    RC_ASSERT((push - away).norm() < 1e-6);
    const double share = contact.gradient.segment<3>(6).dot(away);
    // Any of the body's points at the same position may be chosen; its length is the tolerance.
    RC_ASSERT(std::abs(share - fraction) <= 0.2 + 1e-9);
    if (fraction > 0.3 && fraction < 0.7) RC_ASSERT(std::abs(share - fraction) < 1e-6);
  }));
}

TEST(SweepContacts, NamesEveryPairBelowTheCutoffInOrder) {
  World world;
  for (const double x : {0.0, 3.0, 6.0}) {
    world.obstacles.push_back({"north", Box{{1, 1, 1}}, still({x, 2.0, 0})});
    world.obstacles.push_back({"south", Box{{1, 1, 1}}, still({x, -2.5, 0})});
  }
  Scene scene(world);
  SweepContacts sweep(scene, kBody);
  std::vector<SweepContact> found(3);
  sweep.find(std::vector<Pose>{still({0, 0, 0}), still({3, 0, 0}), still({6, 0, 0})}, 1.5, found);
  // Sides at 0.24: north is 1.26 away, south 1.76; ends of segments touch the next pair of boxes.
  ASSERT_EQ(found.size(), 4U);
  const std::vector<std::pair<int, int>> expected{{0, 0}, {0, 2}, {1, 2}, {1, 4}};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(std::pair(found[i].segment, found[i].obstacle), expected[i]);
    EXPECT_NEAR(found[i].distance, 1.26, 1e-9);
    EXPECT_EQ(found[i].pad, 0.0);
  }
}

TEST(SweepContacts, CutoffIncludesThePad) {
  const World world{{{"o", Box{{1, 1, 1}}, still({0, 2.0, 0})}}};
  Scene scene(world);
  SweepContacts sweep(scene, kBody);
  const std::vector<Pose> turning{still({0, 0, 0}), {Vector3d(0.5, 0, 0), from_rpy(0, 0, 0.8)}};
  std::vector<SweepContact> found;
  sweep.find(turning, 1e6, found);
  ASSERT_EQ(found.size(), 1U);
  ASSERT_GT(found[0].pad, 0.02);
  const double padded = found[0].distance - found[0].pad;
  sweep.find(turning, padded + 1e-3, found);
  EXPECT_EQ(found.size(), 1U);
  sweep.find(turning, padded - 1e-3, found);
  EXPECT_TRUE(found.empty());
}

// Every point of the body, during the whole motion, is within the pad of a point of the hull of
// both poses; and for a body that turns on the spot about an axis across its longest radius no
// smaller pad suffices.
TEST(SweepContacts, HullOfTwoPosesAndPadHoldTheSweep) {
  const World nothing;
  Scene scene(nothing);
  const SweepContacts sweep(scene, kBody);
  EXPECT_TRUE(rc::check([&] {
    const Pose a{draw(arbitrary_vector(3.0)), so3_exp(draw(arbitrary_rotation_vector()))};
    const Pose b{draw(arbitrary_vector(3.0)), a.q * so3_exp(draw(arbitrary_vector(1.7)))};
    const double pad = sweep.pad(angle_between(a.q, b.q));
    for (double t = 0.0; t <= 1.0; t += 0.01) {
      const Pose between = interpolate(a, b, t);
      for (const Vector3d& v : kBody) {
        const Vector3d in_hull = (1.0 - t) * (a * v) + t * (b * v);
        RC_ASSERT((between * v - in_hull).norm() <= pad + 1e-12);
      }
    }
  }));
  const Vector3d& longest = kBody.back();
  const double angle = 0.9;
  const Eigen::Quaterniond turn = so3_exp(angle * longest.cross(Vector3d::UnitX()).normalized());
  const Vector3d middle = interpolate(Pose{}, Pose{Vector3d::Zero(), turn}, 0.5) * longest;
  const Vector3d chord = 0.5 * (longest + turn * longest);
  EXPECT_NEAR((middle - chord).norm(), sweep.pad(angle), 1e-12);
}

TEST(SweepContacts, RefusesABodyOfNoPoints) {
  const World nothing;
  Scene scene(nothing);
  EXPECT_THROW(SweepContacts(scene, {}), AssertionFailure);
}

}  // namespace
}  // namespace dive::planning
