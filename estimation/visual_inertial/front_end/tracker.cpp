#include "estimation/visual_inertial/front_end/tracker.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "common/assert.h"
#include "common/range_check.h"
#include "estimation/visual_inertial/front_end/corners.h"
#include "estimation/visual_inertial/front_end/equalised_image.h"
#include "estimation/visual_inertial/front_end/image_check.h"
#include "estimation/visual_inertial/front_end/klt.h"
#include "estimation/visual_inertial/front_end/motion_check.h"
#include "estimation/visual_inertial/front_end/track.h"
#include "estimation/visual_inertial/front_end/track_stereo.h"

namespace dive::estimation {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector2d;
using Eigen::Vector2f;
using Eigen::Vector3d;

constexpr int kBorder = 8;               // px, untracked border of the image
constexpr int kFewFeatures = 20;         // number below which a loss is not reported
constexpr double kLostShare = 0.1;       // fraction left when tracking is lost
constexpr int kAnchorPeriod = 2;         // images between two alignments of a track's anchor
constexpr float kMinCorrelation = 0.8F;  // of a feature's present with its first appearance
constexpr float kMaxGrowth = 3.0F;       // of its area, or its inverse

}  // namespace

std::string TrackerOptions::validate() const {
  if (window_px % 8 != 0)
    return fmt::format("window_px is {}; a multiple of 8 is needed", window_px);
  RangeCheck check;
  check("max_features", max_features, 16, 5000);
  check("window_px", window_px, 8, 64);
  check("levels", levels, 0, 5);
  check("min_gradient", min_gradient, 0.5, 100.0);
  check("min_distance_px", min_distance_px, 2.0, 200.0);
  check("cells_per_image", cells_per_image, 1, 10'000);
  check("back_px", back_px, 0.01, 10.0);
  check("epipolar_px", epipolar_px, 0.05, 20.0);
  check("drift_px", drift_px, 0.05, 40.0);
  check("min_contrast", min_contrast, 0.5, 100.0);
  check("min_features", min_features, 0, max_features);
  check("max_gap_s", max_gap_s, 0.01, 10.0);
  check("min_depth_m", min_depth_m, 0.01, 10.0);
  return check.problem();
}

struct Tracker::Impl {
  Impl(TrackerOptions given, const CameraModel& left_camera,
       const std::optional<CameraModel>& right_camera, std::uint64_t seed)
      : options(given),
        left(left_camera),
        klt(given.window_px),
        grid({given.min_gradient, given.min_distance_px}, left_camera.width, left_camera.height,
             given.max_features, kBorder),
        check(left_camera, given.min_contrast),
        motion(left_camera, {given.epipolar_px, given.drift_px}, seed),
        last(given.window_px, std::max(given.levels, StereoMatcher::kLevels)),
        now(given.window_px, std::max(given.levels, StereoMatcher::kLevels)) {
    if (right_camera) {
      StereoOptions of_stereo;
      of_stereo.min_depth_m = options.min_depth_m;
      stereo.emplace(of_stereo, left, *right_camera, options.window_px, options.min_contrast);
    }
  }

  // Predicted positions of the tracks, by the rotation and each one's last motion. Drops tracks
  // predicted outside the image.
  [[nodiscard]] std::vector<Vector2f> predict(const std::optional<CameraTurn>& turn, double dt) {
    std::vector<Vector2f> guesses;
    std::vector<Track> kept;
    for (Track& track : tracks) {
      Vector2d n = track.n;
      if (turn) {
        const Vector3d turned = turn->q_C1C0 * track.n.homogeneous();
        if (!(turned.z() > 0.05)) continue;
        n = turned.hnormalized();
      }
      const auto pixel = left.project((n + dt * track.speed).homogeneous());
      if (!pixel || !left.in_image(*pixel, kBorder)) continue;
      guesses.push_back(pixel->cast<float>());
      kept.push_back(std::move(track));
    }
    tracks = std::move(kept);
    return guesses;
  }

  // Tracks all features from the last image into this one and back; drops failures. Returns a
  // library's exception as text, else empty.
  [[nodiscard]] std::string follow(const std::optional<CameraTurn>& turn, double dt) {
    const std::vector<Vector2f> guesses = predict(turn, dt);
    std::vector<Vector2f> from;
    from.reserve(tracks.size());
    for (const Track& track : tracks) from.push_back(track.pixel);
    const auto found = klt.follow(last.for_klt(), now.for_klt(), from, guesses, options.levels);
    if (!found) return found.error();

    std::vector<Track> there;
    std::vector<Vector2f> start;
    std::vector<Vector2f> end;
    std::vector<Vector2f> back_guesses;
    for (std::size_t i = 0; i < tracks.size(); ++i) {
      const auto& pixel = (*found)[i];
      if (!pixel || !left.in_image(pixel->cast<double>(), kBorder)) continue;
      there.push_back(std::move(tracks[i]));
      start.push_back(from[i]);
      end.push_back(*pixel);
      // Back by the guessed step: a search from the position itself would succeed too easily.
      back_guesses.push_back(*pixel - (guesses[i] - from[i]));
    }
    tracks.clear();
    // With a rotation the guess is good to a few pixels, and no pyramid is needed.
    const int back_levels = turn ? 0 : std::max(0, options.levels - 1);
    const auto back = klt.follow(now.for_klt(), last.for_klt(), end, back_guesses, back_levels);
    if (!back) return back.error();
    for (std::size_t i = 0; i < there.size(); ++i) {
      const auto& returned = (*back)[i];
      if (!returned || (*returned - start[i]).norm() > static_cast<float>(options.back_px)) {
        continue;
      }
      if (move(there[i], end[i], turn, dt)) tracks.push_back(std::move(there[i]));
    }
    return {};
  }

  // Aligns the anchors of half of the tracks with the image: their positions become the tracks'.
  // Drops tracks whose appearance has changed.
  void align_to_anchors() {
    std::erase_if(tracks, [&](Track& track) {
      const auto turn = static_cast<std::uint64_t>(track.id) + image_number;
      if (turn % kAnchorPeriod != 0) return false;
      const auto found = track.anchor->find(now.full(), {track.pixel, track.shape});
      if (!found || found->correlation < kMinCorrelation) return true;
      const auto n = left.undistort(found->pixel.cast<double>());
      if (!n || !left.in_image(found->pixel.cast<double>(), kBorder)) return true;
      const float growth = found->shape.determinant();
      if (growth > kMaxGrowth || growth < 1.0F / kMaxGrowth) return true;
      track.pixel = found->pixel;
      track.shape = found->shape;
      track.n = *n;
      return false;
    });
  }

  // Moves the track to `pixel`; false if its distortion has no inverse.
  [[nodiscard]] bool move(Track& track, const Vector2f& pixel,
                          const std::optional<CameraTurn>& turn, double dt) const {
    const auto n = left.undistort(pixel.cast<double>());
    if (!n) return false;
    const Vector2d turned =
        turn ? Vector2d((turn->q_C1C0 * track.n.homogeneous()).hnormalized()) : track.n;
    track.speed = (*n - turned) / dt;
    track.pixel = pixel;
    track.n = *n;
    track.is_new = false;
    track.turned = turn ? track.turned + 1 : 0;
    return true;
  }

  // Finds new features where there are few. Returns a library's exception as text, else empty.
  [[nodiscard]] std::string add_new(int& added) {
    std::vector<Vector2f> taken;
    taken.reserve(tracks.size());
    for (const Track& track : tracks) taken.push_back(track.pixel);
    const int few = options.max_features / 2;
    const int have = static_cast<int>(tracks.size());
    int cells = options.cells_per_image;
    if (have == 0) {
      cells = grid.cells();
    } else if (have < few) {
      cells *= 3;
    }
    const auto corners = grid.find(now.half(), taken, options.max_features - have, cells);
    if (!corners) return corners.error();
    for (const Vector2f& pixel : *corners) {
      const auto n = left.undistort(pixel.cast<double>());
      if (!n) continue;
      Track track;
      const auto anchor = AnchorPatch::cut(now.full(), pixel);
      if (!anchor) continue;
      track.anchor = std::make_unique<const AnchorPatch>(*anchor);
      track.id = next_id++;
      track.pixel = pixel;
      track.n = *n;
      track.past.fill(*n);
      tracks.push_back(std::move(track));
      ++added;
    }
    return {};
  }

  void reset() {
    tracks.clear();
    motion.reset();
  }

  // Tracks the features of the last image into this one; sets the fault if there is one.
  void follow_all(Utime utime, const std::optional<CameraTurn>& turn, ImageQuality& quality) {
    const std::optional<Utime> last_utime = check.last_utime();
    const double dt = last_utime ? to_seconds(utime - *last_utime) : 0.0;
    if (!last_utime || dt > options.max_gap_s) {
      reset();
      return;
    }
    const int before = static_cast<int>(tracks.size());
    const std::string thrown = follow(turn, dt);
    if (!thrown.empty()) {
      reset();
      quality.fault = ImageFault::kLibraryError;
      quality.reason = thrown;
      return;
    }
    align_to_anchors();
    quality.lost = before - static_cast<int>(tracks.size());
    if (turn) quality.moving = motion.remove_moving(tracks, image_number, *turn);
    quality.tracked = static_cast<int>(tracks.size());
    if (before >= kFewFeatures && quality.tracked < kLostShare * before) {
      quality.fault = ImageFault::kLost;
      quality.reason = fmt::format("{} of {} features are left", quality.tracked, before);
    }
  }

  void fill(FeatureFrame& frame) const {
    frame.features.reserve(tracks.size());
    for (const Track& track : tracks) frame.features.push_back({track.id, track.n, track.right});
  }

  [[nodiscard]] TrackedImage step(const ImageFrame& image, const ImageFrame* right_image,
                                  const std::optional<CameraTurn>& turn) {
    TrackedImage result;
    result.frame.utime = image.utime;
    ImageQuality& quality = result.quality;
    if (!check.check(image, quality)) return result;
    if (!check.check_contrast(now.set(image), quality)) return result;
    if (const std::string thrown = now.prepare(); !thrown.empty()) {
      quality.fault = ImageFault::kLibraryError;
      quality.reason = thrown;
      return result;
    }

    for (Track& track : tracks) track.right.reset();
    ++image_number;
    follow_all(image.utime, turn, quality);
    if (const std::string thrown = add_new(quality.added); !thrown.empty()) {
      quality.fault = ImageFault::kLibraryError;
      quality.reason = thrown;
    }
    if (right_image != nullptr) {
      quality.right_reason =
          stereo ? stereo->match(now, image.utime, *right_image, image_number, tracks)
                 : "the right camera has no calibration";
    }
    for (Track& track : tracks) {
      track.past[image_number % Track::kPast] = track.n;
      quality.stereo += track.right ? 1 : 0;
    }
    std::swap(last, now);
    check.set_last(image);
    fill(result.frame);
    if (quality.fault == ImageFault::kNone &&
        static_cast<int>(tracks.size()) < options.min_features) {
      quality.fault = ImageFault::kFewFeatures;
      quality.reason =
          fmt::format("{} features; at least {} are needed", tracks.size(), options.min_features);
    }
    return result;
  }

  TrackerOptions options;
  CameraModel left;
  Klt klt;
  std::optional<TrackStereo> stereo;
  CornerGrid grid;
  ImageCheck check;
  MotionCheck motion;

  std::vector<Track> tracks;  // by id
  std::int64_t next_id = 0;
  std::size_t image_number = 0;  // number of used images
  EqualisedImage last;
  EqualisedImage now;
};

Tracker::Tracker(TrackerOptions options, const CameraModel& left,
                 const std::optional<CameraModel>& right, std::uint64_t seed) {
  DIVE_DEMAND(options.validate().empty() && left.validate().empty());
  DIVE_DEMAND(left.width >= kMinSide_px && left.height >= kMinSide_px);
  impl_ = std::make_unique<Impl>(options, left, right, seed);
}
Tracker::Tracker(Tracker&&) noexcept = default;
Tracker& Tracker::operator=(Tracker&&) noexcept = default;
Tracker::~Tracker() = default;

std::optional<Utime> Tracker::utime() const { return impl_->check.last_utime(); }

TrackedImage Tracker::step(const ImageFrame& left, const ImageFrame* right,
                           const std::optional<CameraTurn>& turn) {
  DIVE_DEMAND(!turn || std::abs(turn->q_C1C0.norm() - 1.0) < 1e-6);
  return impl_->step(left, right, turn);
}

}  // namespace dive::estimation
