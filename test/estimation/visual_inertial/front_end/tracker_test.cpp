#include "estimation/visual_inertial/front_end/tracker.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <set>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/estimation/visual_inertial/painted_room.h"

namespace dive::estimation {
namespace {

using ::testing::HasSubstr;
using testing::PaintedRoom;
using testing::pixel_of;
using testing::seen_at;
using testing::test_camera;
using testing::wide_camera;

using Path = std::function<Pose(double)>;  // X_WB at a time, s

constexpr Utime kPeriod = 50'000;

// Swims past the wall at x = 4, turning and pitching gently.
Pose swimming(double t) {
  return {{0.4 * t, 0.3 * t, 0.1 * std::sin(t)}, from_rpy(0.1 * t, 0.1 * std::sin(t), 0.2 * t)};
}

Pose camera_pose(const CameraModel& camera, const Path& path, int k) {
  return path(to_seconds(k * kPeriod)) * camera.X_BC;
}

CameraTurn turn(const CameraModel& camera, const Path& path, int from, int to) {
  return {camera_pose(camera, path, to).q.conjugate() * camera_pose(camera, path, from).q};
}

// Distance in pixels of each feature from the true position of its first observed point.
class Truth {
 public:
  Truth(const PaintedRoom& room, const CameraModel& camera) : room_(room), camera_(camera) {}

  std::map<std::int64_t, double> errors(const FeatureFrame& frame, const Pose& X_WC) {
    std::map<std::int64_t, double> result;
    for (const FeatureObservation& f : frame.features) {
      const auto [it, is_new] = points_.try_emplace(f.id, room_.wall_at(X_WC, f.left));
      if (is_new) continue;
      const auto n = seen_at(X_WC, it->second);
      result[f.id] = n ? (pixel_of(camera_, *n) - pixel_of(camera_, f.left)).norm() : 1e9;
    }
    return result;
  }

 private:
  const PaintedRoom& room_;
  CameraModel camera_;
  std::map<std::int64_t, Eigen::Vector3d> points_;
};

double median(const std::map<std::int64_t, double>& errors, double share = 0.5) {
  std::vector<double> values;
  for (const auto& [id, e] : errors) values.push_back(e);
  std::sort(values.begin(), values.end());
  return values.at(static_cast<std::size_t>(share * static_cast<double>(values.size() - 1)));
}

// The left camera of EuRoC, and 120 x 90 degrees.
class Lens : public ::testing::TestWithParam<CameraModel> {};
INSTANTIATE_TEST_SUITE_P(Tracker, Lens,
                         ::testing::Values(test_camera(), wide_camera(0.0, 752, 564)));

// A tracker that uses only the last image is off by half a pixel after forty.
TEST_P(Lens, StaysOnWhatItSawFirst) {
  PaintedRoom room({4, 3, 2});
  const CameraModel& camera = GetParam();
  Tracker tracker({}, camera, std::nullopt, 1);
  Truth truth(room, camera);
  TrackedImage last;
  for (int k = 0; k < 40; ++k) {
    const Pose X_WC = camera_pose(camera, swimming, k);
    last = tracker.step(room.image(camera, X_WC, k * kPeriod), nullptr,
                        turn(camera, swimming, std::max(0, k - 1), k));
    ASSERT_EQ(last.quality.fault, ImageFault::kNone) << last.quality.reason;
    EXPECT_LE(last.frame.features.size(), 200U);
    const auto errors = truth.errors(last.frame, X_WC);
    if (k == 0) continue;
    EXPECT_LT(median(errors), 0.2) << k;
    EXPECT_LT(median(errors, 0.98), 1.0) << k;  // no track has changed to another point
  }
  EXPECT_GT(last.quality.tracked, 120);
  EXPECT_EQ(last.quality.tracked + last.quality.added,
            static_cast<int>(last.frame.features.size()));
}

TEST(Tracker, SpreadsFeaturesOverTheImage) {
  PaintedRoom room({4, 3, 2});
  const CameraModel camera = test_camera();
  Tracker tracker({}, camera, std::nullopt, 1);
  const TrackedImage tracked_image =
      tracker.step(room.image(camera, camera_pose(camera, swimming, 0), 0), nullptr, std::nullopt);
  int quarter[2][2] = {};
  for (const FeatureObservation& f : tracked_image.frame.features) {
    ++quarter[f.left.x() > 0 ? 1 : 0][f.left.y() > 0 ? 1 : 0];
  }
  for (const auto& row : quarter) {
    for (const int n : row) EXPECT_GT(n, 30);
  }
  EXPECT_GT(tracked_image.quality.added, 150);
}

TEST_P(Lens, FindsDepthInStereo) {
  PaintedRoom room({4, 3, 2});
  CameraModel left = GetParam();
  CameraModel right = GetParam();
  left.X_BC.p.y() = 0.06;
  right.X_BC.p.y() = -0.06;
  right.X_BC.q = right.X_BC.q * from_rpy(0.01, -0.008, 0.005);
  Tracker tracker({}, left, right, 1);
  for (int k = 0; k < 6; ++k) {
    const Pose X_WL = camera_pose(left, swimming, k);
    const Pose X_WR = camera_pose(right, swimming, k);
    const ImageFrame right_image = room.image(right, X_WR, k * kPeriod + 100);
    const TrackedImage tracked_image =
        tracker.step(room.image(left, X_WL, k * kPeriod), &right_image,
                     turn(left, swimming, std::max(0, k - 1), k));
    EXPECT_TRUE(tracked_image.quality.right_reason.empty()) << tracked_image.quality.right_reason;
    std::map<std::int64_t, double> errors;
    for (const FeatureObservation& f : tracked_image.frame.features) {
      if (!f.right) continue;
      const auto n = seen_at(X_WR, room.wall_at(X_WL, f.left));
      ASSERT_TRUE(n);
      errors[f.id] = (pixel_of(right, *n) - pixel_of(right, *f.right)).norm();
    }
    EXPECT_EQ(tracked_image.quality.stereo, static_cast<int>(errors.size()));
    EXPECT_GT(errors.size(), 0.75 * static_cast<double>(tracked_image.frame.features.size())) << k;
    EXPECT_LT(median(errors), 0.15) << k;
    EXPECT_LT(median(errors, 0.99), 2.0) << k;
  }
}

// From the smallest to the largest images, of 120 x 90 degrees.
TEST(Tracker, WorksAtEveryResolution) {
  for (const auto& [width, height] : {std::pair(320, 240), {1600, 1200}}) {
    PaintedRoom room({4, 3, 2});
    const CameraModel camera = wide_camera(0.0, width, height);
    Tracker tracker({}, camera, std::nullopt, 1);
    Truth truth(room, camera);
    TrackedImage last;
    for (int k = 0; k < 5; ++k) {
      const Pose X_WC = camera_pose(camera, swimming, k);
      last = tracker.step(room.image(camera, X_WC, k * kPeriod), nullptr,
                          turn(camera, swimming, std::max(0, k - 1), k));
      ASSERT_EQ(last.quality.fault, ImageFault::kNone) << last.quality.reason;
      const auto errors = truth.errors(last.frame, X_WC);
      if (k == 0) continue;
      EXPECT_LT(median(errors), 0.3) << width << " image " << k;
    }
    EXPECT_GT(last.quality.tracked, 90) << width;
  }
}

// Nine degrees from image to image: 70 pixels, and more at the edge.
TEST(Tracker, KeepsThroughAFastTurnWhatItLosesWithoutGyro) {
  const CameraModel camera = test_camera();
  const Path turning = [](double t) { return Pose{{0, 0, 0}, from_rpy(0, 0, 3.1 * t)}; };
  int kept[2] = {};
  for (const bool gyro : {false, true}) {
    PaintedRoom room({4, 3, 2});
    Tracker tracker({}, camera, std::nullopt, 1);
    Truth truth(room, camera);
    for (int k = 0; k < 4; ++k) {
      const Pose X_WC = camera_pose(camera, turning, k);
      std::optional<CameraTurn> q;
      if (gyro) q = turn(camera, turning, std::max(0, k - 1), k);
      const TrackedImage tracked_image =
          tracker.step(room.image(camera, X_WC, k * kPeriod), nullptr, q);
      for (const auto& [id, error] : truth.errors(tracked_image.frame, X_WC)) {
        if (error < 1.0) ++kept[gyro ? 1 : 0];
        if (gyro) {
          EXPECT_LT(error, 3.0);
        }
      }
    }
  }
  EXPECT_GT(kept[1], 300);
  EXPECT_LT(kept[0], kept[1] / 3);
}

struct Snowed {
  int found = 0;         // number of features
  int found_flakes = 0;  // features on marine snow
  int walls = 0;
  int flakes = 0;
};

// Features tracked over 18 images and more, in the last ten of forty, by the object of their first
// observation.
Snowed snowed() {
  PaintedRoom room({4, 3, 2});
  room.snow(400, {1.5, 0.0, 0.0}, 1.5, 0.05);
  const CameraModel camera = test_camera();
  Tracker tracker({}, camera, std::nullopt, 1);
  std::map<std::int64_t, bool> is_flake;
  std::map<std::int64_t, int> seen_for;
  Snowed result;
  for (int k = 0; k < 40; ++k) {
    const Pose X_WC = camera_pose(camera, swimming, k);
    const TrackedImage tracked_image = tracker.step(room.image(camera, X_WC, k * kPeriod), nullptr,
                                                    turn(camera, swimming, std::max(0, k - 1), k));
    for (const FeatureObservation& f : tracked_image.frame.features) {
      const auto [flake, is_new] =
          is_flake.try_emplace(f.id, room.has_flake(camera, X_WC, k * kPeriod, f.left));
      if (is_new) ++result.found;
      if (is_new && flake->second) ++result.found_flakes;
      if (++seen_for[f.id] >= 18 && k >= 30) ++(is_flake[f.id] ? result.flakes : result.walls);
    }
  }
  return result;
}

TEST(Tracker, ThrowsOutSnow) {
  const Snowed snow = snowed();
  EXPECT_GT(snow.found_flakes, 0.4 * snow.found);  // dense snow
  EXPECT_LT(snow.flakes, 0.05 * (snow.walls + snow.flakes));
  EXPECT_GT(snow.walls, 300);
}

// Before initialisation the gyro of a MEMS unit errs by up to 0.1 rad/s. About the optical axis
// that moves features across their epipolar lines.
TEST(Tracker, KeepsWhatTheGyrosBiasWouldExplain) {
  PaintedRoom room({4, 3, 2});
  const CameraModel camera = test_camera();
  const double dt = to_seconds(kPeriod);
  const Eigen::Quaterniond by_bias = so3_exp(dt * Eigen::Vector3d(0.02, -0.02, 0.1));
  const auto removed_with = [&](double sigma) {
    Tracker tracker({}, camera, std::nullopt, 1);
    int removed = 0;
    for (int k = 0; k < 20; ++k) {
      CameraTurn by_gyro = turn(camera, swimming, std::max(0, k - 1), k);
      by_gyro.q_C1C0 = by_bias * by_gyro.q_C1C0;
      by_gyro.sigma = sigma * dt;
      const Pose X_WC = camera_pose(camera, swimming, k);
      removed +=
          tracker.step(room.image(camera, X_WC, k * kPeriod), nullptr, by_gyro).quality.moving;
    }
    return removed;
  };
  EXPECT_LT(removed_with(0.1), 20);
  EXPECT_GT(removed_with(0.004), 200);
}

TEST(Tracker, FollowsAsTheLightGoesDown) {
  PaintedRoom room({4, 3, 2});
  const CameraModel camera = test_camera();
  Tracker tracker({}, camera, std::nullopt, 1);
  Truth truth(room, camera);
  double light = 1.0;
  for (int k = 0; k < 8; ++k, light *= 0.85) {
    const Pose X_WC = camera_pose(camera, swimming, k);
    const TrackedImage tracked_image =
        tracker.step(room.image(camera, X_WC, k * kPeriod, 0.5, light), nullptr,
                     turn(camera, swimming, std::max(0, k - 1), k));
    const auto errors = truth.errors(tracked_image.frame, X_WC);
    if (k == 0) continue;
    EXPECT_GT(tracked_image.quality.tracked, 130) << k;
    EXPECT_LT(median(errors), 0.5) << k;
  }
}

TEST(Tracker, NeverGivesAnIdTwice) {
  PaintedRoom room({4, 3, 2});
  const CameraModel camera = test_camera();
  Tracker tracker({}, camera, std::nullopt, 1);
  std::set<std::int64_t> gone;
  std::set<std::int64_t> last;
  for (const int k : {0, 1, 2, 40, 41, 42, 90, 91}) {  // gaps: all tracks restart
    const TrackedImage tracked_image = tracker.step(
        room.image(camera, camera_pose(camera, swimming, k), k * kPeriod), nullptr, std::nullopt);
    std::set<std::int64_t> ids;
    for (const FeatureObservation& f : tracked_image.frame.features) {
      EXPECT_TRUE(ids.insert(f.id).second);
      EXPECT_FALSE(gone.contains(f.id));
    }
    for (const std::int64_t id : last) {
      if (!ids.contains(id)) gone.insert(id);
    }
    last = ids;
  }
  EXPECT_GT(gone.size(), 300U);
}

TEST(Tracker, DoesTheSameTwice) {
  const CameraModel left = test_camera(0.06);
  const CameraModel right = test_camera(-0.06);
  std::vector<double> runs[2];
  for (auto& run : runs) {
    PaintedRoom room({4, 3, 2});
    room.snow(500, {1.5, 0.0, 0.0}, 1.5, 0.05);
    Tracker tracker({}, left, right, 1);
    for (int k = 0; k < 4; ++k) {
      const ImageFrame r = room.image(right, camera_pose(right, swimming, k), k * kPeriod);
      const TrackedImage tracked_image =
          tracker.step(room.image(left, camera_pose(left, swimming, k), k * kPeriod), &r,
                       turn(left, swimming, std::max(0, k - 1), k));
      for (const FeatureObservation& f : tracked_image.frame.features) {
        run.insert(run.end(), {static_cast<double>(f.id), f.left.x(), f.left.y()});
        if (f.right) run.push_back(f.right->x());
      }
    }
  }
  EXPECT_EQ(runs[0], runs[1]);
}

class Refusing : public ::testing::Test {
 protected:
  TrackedImage step(const ImageFrame& image, const ImageFrame* right = nullptr) {
    const auto pose = [&](Utime utime) { return swimming(to_seconds(utime)) * camera.X_BC; };
    const Utime last = tracker.utime().value_or(image.utime);
    return tracker.step(image, right, CameraTurn{pose(image.utime).q.conjugate() * pose(last).q});
  }
  ImageFrame at(int k, double light = 1.0) {
    return room.image(camera, camera_pose(camera, swimming, k), k * kPeriod, 1.0, light);
  }

  PaintedRoom room{{4, 3, 2}};
  CameraModel camera = test_camera(0.06);
  Tracker tracker{{}, camera, test_camera(-0.06), 1};
};

// A rejected image leaves the tracker unchanged, so that the next good image continues.
TEST_F(Refusing, ContinuesAfterEveryBadImage) {
  const ImageFrame first = at(0);
  ASSERT_EQ(step(first).quality.fault, ImageFault::kNone);
  ImageFrame small = at(1);
  small.height -= 1;
  ImageFrame torn = at(1);
  torn.pixels.pop_back();
  ImageFrame colour = at(1);
  colour.format = ImageFrame::Format::kRgb8;
  ImageFrame same_stamp = at(1);
  same_stamp.utime = 0;
  ImageFrame earlier = at(1);
  earlier.utime = -kPeriod;
  ImageFrame frozen = first;
  frozen.utime = kPeriod;
  ImageFrame dazzled = at(1);
  std::fill(dazzled.pixels.begin(), dazzled.pixels.end(), std::uint8_t{255});
  const struct {
    ImageFrame image;
    ImageFault fault;
    const char* words;
  } bad[] = {{small, ImageFault::kNotAsAgreed, "752 x 479"},
             {torn, ImageFault::kNotAsAgreed, "360959 bytes"},
             {colour, ImageFault::kNotAsAgreed, "colour"},
             {same_stamp, ImageFault::kNotLater, "stamped 0 us"},
             {earlier, ImageFault::kNotLater, "-50000 us"},
             {frozen, ImageFault::kFrozen, "frozen"},
             {at(1, 0.01), ImageFault::kNoContrast, "mean 1."},
             {dazzled, ImageFault::kNoContrast, "mean 255.0"}};
  for (const auto& [image, fault, words] : bad) {
    const TrackedImage refused = step(image);
    EXPECT_EQ(refused.quality.fault, fault) << to_string(refused.quality.fault);
    EXPECT_THAT(refused.quality.reason, HasSubstr(words));
    EXPECT_TRUE(refused.frame.features.empty());
    EXPECT_EQ(tracker.utime(), Utime{0});
  }
  const TrackedImage good = step(at(2));
  EXPECT_EQ(good.quality.fault, ImageFault::kNone);
  EXPECT_GT(good.quality.tracked, 100);
}

TEST_F(Refusing, ContinuesWithOneCameraWhenTheOtherIsBad) {
  ImageFrame late = at(0);
  late.utime += 5000;
  EXPECT_THAT(step(at(0), &late).quality.right_reason, HasSubstr("stamped 5000 us"));
  ImageFrame small = at(1);
  small.width = 10;
  EXPECT_THAT(step(at(1), &small).quality.right_reason, HasSubstr("10 x 480"));
  const ImageFrame dark = at(2, 0.005);
  const TrackedImage tracked_image = step(at(2), &dark);
  EXPECT_THAT(tracked_image.quality.right_reason, HasSubstr("no contrast"));
  EXPECT_GT(tracked_image.quality.tracked, 100);
  EXPECT_EQ(tracked_image.quality.stereo, 0);

  Tracker one_eyed({}, camera, std::nullopt, 1);
  const ImageFrame r = at(3);
  EXPECT_THAT(one_eyed.step(at(3), &r, std::nullopt).quality.right_reason,
              HasSubstr("no calibration"));
}

TEST_F(Refusing, ReportsALossOfAllFeatures) {
  ASSERT_EQ(step(at(0)).quality.fault, ImageFault::kNone);
  Random random(7);
  ImageFrame other = at(1);
  for (std::uint8_t& pixel : other.pixels) pixel = static_cast<std::uint8_t>(random.bits());
  const TrackedImage tracked_image = step(other);
  EXPECT_EQ(tracked_image.quality.fault, ImageFault::kLost);
  EXPECT_THAT(tracked_image.quality.reason, HasSubstr("are left"));
  EXPECT_GT(tracked_image.quality.lost, 100);
}

TEST_F(Refusing, ReportsFewFeatures) {
  ImageFrame image;
  image.width = 752;
  image.height = 480;
  image.pixels.assign(752 * 480, 10);
  for (std::size_t i = 0; i < 5; ++i) {
    const std::size_t corner = 752 * 100 + 100 * i + 100;
    for (std::size_t y = 0; y < 30; ++y) {
      for (std::size_t x = 0; x < 30; ++x) image.pixels[corner + 752 * y + x] = 200;
    }
  }
  TrackerOptions options;
  options.min_features = 150;
  Tracker careful(options, camera, std::nullopt, 1);
  const TrackedImage tracked_image = careful.step(image, nullptr, std::nullopt);
  EXPECT_EQ(tracked_image.quality.fault, ImageFault::kFewFeatures);
  EXPECT_THAT(tracked_image.quality.reason, HasSubstr("at least 150 are needed"));
  EXPECT_GT(tracked_image.frame.features.size(), 4U);
}

TEST_F(Refusing, DetectsABlurredImage) {
  const double sharp = step(at(0)).quality.sharpness;
  ImageFrame blurred = at(1);
  const std::vector<std::uint8_t> pixels = blurred.pixels;
  for (std::size_t i = 8; i + 8 < pixels.size(); ++i) {
    int sum = 0;
    for (std::size_t k = 0; k < 17; ++k) sum += pixels[i - 8 + k];
    blurred.pixels[i] = static_cast<std::uint8_t>(sum / 17);
  }
  EXPECT_LT(step(blurred).quality.sharpness, 0.3 * sharp);
}

TEST(TrackerOptions, NamesWhatIsWrong) {
  EXPECT_EQ(TrackerOptions{}.validate(), "");
  TrackerOptions options;
  options.window_px = 15;
  EXPECT_THAT(options.validate(), HasSubstr("window_px"));
  options = {};
  options.max_features = 0;
  EXPECT_THAT(options.validate(), HasSubstr("max_features is 0"));
  options = {};
  options.back_px = std::nan("");
  EXPECT_THAT(options.validate(), HasSubstr("back_px"));
}

}  // namespace
}  // namespace dive::estimation
