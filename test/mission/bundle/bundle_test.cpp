// Verified bundles: what was packed comes back, nothing that was changed is accepted, and the plans
// are proved again.

#include "mission/bundle/bundle.h"

#include <algorithm>
#include <limits>
#include <random>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "mission/bundle/bundled_dive.h"
#include "mission/bundle/plan_proof.h"
#include "mission/bundle/seal.h"
#include "mission/bundle/vehicle_difference.h"
#include "mission/check/route.h"
#include "mission/check/route_plan.h"
#include "planning/world/scene.h"
#include "planning/world/sdf.h"
#include "test/common/file_content.h"
#include "test/common/long_tests.h"
#include "test/common/sanitizers.h"

namespace dive::mission {
namespace {

using dive::testing::content_of;
using ::testing::HasSubstr;
using Bytes = std::vector<std::uint8_t>;

link::Key key_of(std::uint8_t byte) {
  link::Key key;
  key.fill(byte);
  return key;
}

/// The bundle of a shipped mission, of which everything but the verdict is as the command makes it.
Bundle make_bundle(const std::string& name) {
  Diagnostics diagnostics;
  const std::string folder = fmt::format("{}/missions/", DIVE_SOURCE_DIR);
  const auto mission = load_mission(folder + name + ".xml", diagnostics);
  const auto world = planning::load_sdf(mission->map_path, diagnostics);
  const auto model = vehicle::parse_urdf(vehicle::aqua2_urdf(), diagnostics);
  const planning::Scene scene(*world);
  const Route route = nominal_route(*mission, scene);
  Bundle bundle;
  bundle.header.version = "1.2.3";
  bundle.header.mission_name = name + ".xml";
  bundle.header.mission_xml = mission->source.content();
  bundle.header.map_name = mission->map_file.value;
  bundle.header.map_xml = content_of(mission->map_path);
  bundle.header.vehicle_urdf = vehicle::aqua2_urdf().content();
  bundle.verdict = R"({"ok":true})";
  RouteRequests requests(route, 1);
  for (PlannedRouteLeg& leg : plan_route(route, *mission, *world, model->hull, {}, 1)) {
    bundle.legs.push_back({leg.state, leg.goal, requests.next(), leg.plan});
    requests.arrive(leg.plan.waypoints);
  }
  return bundle;
}

const Bundle& window_bundle() {
  static const Bundle bundle = make_bundle("window");
  return bundle;
}

Bytes packed(const Bundle& bundle, const std::optional<link::Key>& key = std::nullopt) {
  auto bytes = pack_bundle(bundle, key);
  EXPECT_TRUE(bytes) << bytes.error();
  return std::move(*bytes);
}

TEST(Bundle, GivesBackWhatWasPacked) {
  const Bundle& bundle = window_bundle();
  const auto opened = parse_bundle(packed(bundle), std::nullopt);
  ASSERT_TRUE(opened) << opened.error();
  EXPECT_EQ(opened->bundle.header.mission_xml,
            content_of(fmt::format("{}/missions/window.xml", DIVE_SOURCE_DIR)));
  EXPECT_EQ(opened->bundle.header.map_xml,
            content_of(fmt::format("{}/missions/maps/window.sdf", DIVE_SOURCE_DIR)));
  EXPECT_EQ(opened->bundle.header.vehicle_urdf, vehicle::aqua2_urdf().content());
  ASSERT_EQ(opened->bundle.legs.size(), bundle.legs.size());
  ASSERT_GT(bundle.legs.size(), 2U);
  for (std::size_t i = 0; i < bundle.legs.size(); ++i) {
    EXPECT_EQ(opened->bundle.legs[i].goal, bundle.legs[i].goal);
    EXPECT_EQ(opened->bundle.legs[i].plan.waypoints.size(), bundle.legs[i].plan.waypoints.size());
  }
  EXPECT_EQ(opened->bundle.verdict, "{\"ok\":true}");
  EXPECT_EQ(packed(opened->bundle), packed(bundle)) << "every bit survives";
}

TEST(Bundle, KeepsMeshesWithTheirTriangles) {
  Bundle bundle = window_bundle();
  planning::TriangleMesh mesh;
  mesh.vertices = {Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitX(),
                   Eigen::Vector3d::UnitY() / 3.0};
  mesh.triangles.push_back({0, 1, 2});
  const Eigen::Vector3d scale(1.0, 2.0, 3.0);
  bundle.meshes = {BundledMesh{false, "a.stl", scale, mesh}, BundledMesh{true, "a.stl", scale, {}}};
  const auto opened = parse_bundle(packed(bundle), std::nullopt);
  ASSERT_TRUE(opened) << opened.error();
  ASSERT_EQ(opened->bundle.meshes.size(), 2U);
  EXPECT_EQ(opened->bundle.meshes[0].mesh.vertices, mesh.vertices);
  EXPECT_EQ(opened->bundle.meshes[0].mesh.triangles, mesh.triangles);
  EXPECT_TRUE(opened->bundle.meshes[1].is_simulation);

  bundle.meshes[0].mesh.triangles[0][2] = 3;
  EXPECT_FALSE(parse_bundle(packed(bundle), std::nullopt)) << "there is no vertex 3";
  bundle.meshes[0].mesh = mesh;
  bundle.meshes[0].mesh.vertices[1].x() = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(parse_bundle(packed(bundle), std::nullopt));
}

TEST(Bundle, IsAcceptedOnlyWithTheKeyOfItsCode) {
  const Bundle& bundle = window_bundle();
  const Bytes coded = packed(bundle, key_of(1));
  const auto right = parse_bundle(coded, key_of(1));
  ASSERT_TRUE(right) << right.error();
  EXPECT_TRUE(right->has_code && right->is_authentic);
  const auto unknown = parse_bundle(coded, std::nullopt);
  ASSERT_TRUE(unknown) << unknown.error();
  EXPECT_TRUE(unknown->has_code);
  EXPECT_FALSE(unknown->is_authentic);
  EXPECT_THAT(parse_bundle(coded, key_of(2)).error(), HasSubstr("another key"));
  EXPECT_THAT(parse_bundle(packed(bundle), key_of(1)).error(), HasSubstr("it has no code"));

  // Sealed by someone without the key, who keeps the code or makes another.
  Bytes content(coded.begin(),
                coded.end() - static_cast<std::ptrdiff_t>(check_seal(coded, {})->size));
  content[content.size() / 2] ^= 1U;
  append_seal(static_cast<std::int64_t>(bundle.legs.size()), key_of(3), content);
  EXPECT_THAT(parse_bundle(content, key_of(1)).error(), HasSubstr("another key"));
}

TEST(Bundle, ReportsWhatIsWrongWithAFile) {
  EXPECT_THAT(parse_bundle({}, std::nullopt).error(), HasSubstr("cut off"));
  EXPECT_THAT(parse_bundle(Bytes(1000, 0), std::nullopt).error(), HasSubstr("changed or damaged"));
  EXPECT_FALSE(read_bundle("/nowhere/there.bundle", std::nullopt));
  EXPECT_FALSE(read_bundle(::testing::TempDir(), std::nullopt));
  Bytes empty;
  append_seal(0, std::nullopt, empty);
  EXPECT_THAT(parse_bundle(empty, std::nullopt).error(), HasSubstr("first record is not valid"));
}

// ------------------------------------------------------------------------------ mutations

/// Changes bytes as a bad disk, a bad copy or an editor does; the result differs.
class Mutator {
 public:
  explicit Mutator(Bytes original) : original_(std::move(original)), random_(20261126) {}

  const Bytes& next() {
    do {
      changed_ = original_;
      switch (below(6)) {
        case 0:
          changed_[below(changed_.size())] ^= static_cast<std::uint8_t>(1U << below(8));
          break;
        case 1:
          for (std::size_t i = 0, n = 1 + below(16); i < n; ++i) {
            changed_[below(changed_.size())] = static_cast<std::uint8_t>(below(256));
          }
          break;
        case 2:
          changed_.resize(below(changed_.size()));
          break;
        case 3:
          swap_blocks();
          break;
        case 4:
          changed_.insert(changed_.begin() + static_cast<std::ptrdiff_t>(below(changed_.size())),
                          1 + below(100), static_cast<std::uint8_t>(below(256)));
          break;
        default:
          changed_.erase(changed_.begin() + static_cast<std::ptrdiff_t>(below(changed_.size())));
      }
    } while (changed_ == original_);
    return changed_;
  }

 private:
  std::size_t below(std::size_t bound) { return random_() % bound; }
  void swap_blocks() {
    const std::size_t size = 1 + below(changed_.size() / 2);
    const std::size_t first = below(changed_.size() - 2 * size + 1);
    const std::size_t second = first + size + below(changed_.size() - first - 2 * size + 1);
    const auto begin = changed_.begin();
    std::swap_ranges(begin + static_cast<std::ptrdiff_t>(first),
                     begin + static_cast<std::ptrdiff_t>(first + size),
                     begin + static_cast<std::ptrdiff_t>(second));
  }

  Bytes original_;
  Bytes changed_;
  std::mt19937_64 random_;
};

/// The number of changed bundles that are accepted, with the key and without.
int accepted_of(int mutations) {
  const Bytes original = packed(window_bundle(), key_of(1));
  EXPECT_TRUE(parse_bundle(original, key_of(1)));
  Mutator mutator(original);
  int accepted = 0;
  for (int i = 0; i < mutations; ++i) {
    const Bytes& changed = mutator.next();
    const bool has_key = i % 2 == 0;
    accepted += parse_bundle(changed, has_key ? std::optional(key_of(1)) : std::nullopt) ? 1 : 0;
  }
  return accepted;
}

TEST(BundleMutations, NoneOfSomeIsAccepted) { EXPECT_EQ(accepted_of(10'000), 0); }

TEST(BundleMutations, NoneOfAMillionIsAccepted) {
  DIVE_SKIP_LONG_TEST();
  DIVE_SKIP_UNDER_SANITIZERS("takes an hour; the test above runs under them");
  EXPECT_EQ(accepted_of(1'000'000), 0);
}

// A person who changes a bundle can compute the hash again, but not the code.
TEST(BundleMutations, SealedAgainAreNotAcceptedWithAKeyAndHarmlessWithout) {
  const Bytes original = packed(window_bundle());
  const Bytes content(original.begin(),
                      original.end() - static_cast<std::ptrdiff_t>(check_seal(original, {})->size));
  Mutator mutator(content);
  for (int i = 0; i < 3'000; ++i) {
    Bytes changed = mutator.next();
    append_seal(0, std::nullopt, changed);
    ASSERT_FALSE(parse_bundle(changed, key_of(1)));
    const auto opened = parse_bundle(changed, std::nullopt);
    if (!opened) continue;  // a checksum of a record is wrong
    const auto dive = bundled_dive(opened->bundle);
    if (dive) {
      static_cast<void>(
          prove_plans(opened->bundle.legs, dive->mission, dive->world, dive->model.hull));
    }
  }
}

// ---------------------------------------------------------------------- plans and vehicle

class PlansOfABundle : public ::testing::Test {
 protected:
  PlansOfABundle() : bundle_(window_bundle()), dive_(*bundled_dive(bundle_)) {}

  /// What is wrong with the plans; empty if they are proved.
  std::string problem() const {
    const auto proof = prove_plans(bundle_.legs, dive_.mission, dive_.world, dive_.model.hull);
    return proof ? "" : proof.error();
  }
  std::vector<Pose>& path(std::size_t leg) { return bundle_.legs.at(leg).plan.waypoints; }

  Bundle bundle_;
  BundledDive dive_;
};

TEST_F(PlansOfABundle, AreProvedAgain) {
  const auto proof = prove_plans(bundle_.legs, dive_.mission, dive_.world, dive_.model.hull);
  ASSERT_TRUE(proof) << proof.error();
  EXPECT_EQ(proof->legs, bundle_.legs.size());
  EXPECT_GE(proof->clearance_m, dive_.mission.limits.clearance.value - 0.003);
}

TEST_F(PlansOfABundle, AreRefusedIfAWaypointWasMovedIntoAWall) {
  // Of some leg, straight up or down, whichever meets something: the map has a floor.
  Pose& middle = path(1).at(path(1).size() / 2);
  middle.p.z() = dive_.mission.limits.max_depth.value * -1.0;
  EXPECT_THAT(problem(),
              ::testing::AnyOf(HasSubstr("of clearance is proved"), HasSubstr("limits of depth")));
  EXPECT_THAT(problem(), HasSubstr(bundle_.legs[1].goal));
}

TEST_F(PlansOfABundle, AreRefusedIfTheyClaimWhatTheyDoNotKeep) {
  // The same path is not enough for a mission that asks for more.
  dive_.mission.limits.clearance.value += 0.5;
  EXPECT_THAT(problem(), HasSubstr("m of clearance is proved, and it claims"));
}

TEST_F(PlansOfABundle, AreRefusedIfAnObstacleWasAddedToTheMap) {
  planning::Obstacle rock{"rock", planning::Sphere{0.2}, {}};
  rock.X_WO.p = path(0).at(path(0).size() / 2).p;
  dive_.world.obstacles.push_back(rock);
  EXPECT_THAT(problem(), HasSubstr("of clearance is proved"));
}

TEST_F(PlansOfABundle, AreRefusedIfTheyAreNotThoseOfTheRoute) {
  const Bundle whole = bundle_;
  bundle_.legs.pop_back();
  EXPECT_THAT(problem(), HasSubstr("legs"));
  bundle_ = whole;
  std::swap(bundle_.legs[0], bundle_.legs[1]);
  EXPECT_THAT(problem(), HasSubstr("the route leads to"));
  bundle_ = whole;
  path(0).back().p.x() += 1.0;
  EXPECT_THAT(problem(), HasSubstr("does not lead to the goal"));
  bundle_ = whole;
  path(0).front().p.y() += 0.1;
  EXPECT_THAT(problem(), HasSubstr("does not begin where the leg does"));
  bundle_ = whole;
  path(0)[1].p.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(problem(), HasSubstr("not valid"));
  bundle_ = whole;
  bundle_.legs[0].plan.accepted = false;
  EXPECT_THAT(problem(), HasSubstr("not accepted"));
}

vehicle::Model vehicle_of(std::string urdf) {
  Diagnostics diagnostics;
  auto model = vehicle::parse_urdf(SourceText("test.urdf", std::move(urdf)), diagnostics);
  EXPECT_TRUE(model);
  return std::move(*model);
}

TEST(VehicleDifference, IsOfMeaningNotOfWriting) {
  const std::string urdf = vehicle::aqua2_urdf().content();
  const vehicle::Model aqua2 = vehicle_of(urdf);
  std::string commented = urdf;
  commented.insert(commented.find("</robot>"), "<!-- a comment -->\n");
  EXPECT_EQ(vehicle_difference(aqua2, vehicle_of(commented)), "");

  vehicle::Model wider = aqua2;
  wider.hull.parts.front().vertices.front().y() += 0.05;
  EXPECT_THAT(vehicle_difference(aqua2, wider), HasSubstr("another hull"));
  vehicle::Model slower = aqua2;
  slower.motion.full_speed -= 0.1;
  EXPECT_THAT(vehicle_difference(aqua2, slower), HasSubstr("another motion model: "));
  vehicle::Model heavier = aqua2;
  heavier.mass_kg += 1.0;
  EXPECT_THAT(vehicle_difference(aqua2, heavier), HasSubstr("another mass"));
}

}  // namespace
}  // namespace dive::mission
