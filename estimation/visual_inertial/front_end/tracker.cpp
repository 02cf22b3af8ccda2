#include "estimation/visual_inertial/front_end/tracker.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "common/assert.h"
#include "common/random.h"
#include "common/range_check.h"
#include "estimation/visual_inertial/front_end/anchor_patch.h"
#include "estimation/visual_inertial/front_end/corners.h"
#include "estimation/visual_inertial/front_end/epipolar.h"
#include "estimation/visual_inertial/front_end/klt.h"
#include "estimation/visual_inertial/front_end/local_contrast.h"
#include "estimation/visual_inertial/front_end/stereo.h"

namespace dive::estimation {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector2d;
using Eigen::Vector2f;
using Eigen::Vector3d;

constexpr std::uint64_t kRansacStream = 31;
constexpr int kBorder = 8;               // px, untracked border of the image
constexpr std::size_t kSpan = 16;        // images, of the check for drift
constexpr Utime kStereoSlack = 1000;     // us between left and right
constexpr int kFewFeatures = 20;         // of fewer features a loss is not reported
constexpr double kLostShare = 0.1;       // fraction left when tracking is lost
constexpr int kSearchEvery = 6;          // images, for a feature without a stereo match
constexpr int kLookBackEvery = 2;        // images, for each feature
constexpr float kMinCorrelation = 0.8F;  // of the present with the first appearance of a feature
constexpr float kMaxGrowth = 3.0F;       // of its area, or its inverse

struct Track {
  std::int64_t id = 0;
  Vector2f pixel;
  Vector2d n;                           // normalised, in the left camera
  Vector2d speed = Vector2d::Zero();    // rate of n beside the rotation, 1/s
  std::optional<Vector2d> right;        // position in the right camera now
  std::optional<double> inverse_depth;  // at its last stereo match
  bool is_new = true;
  std::optional<AnchorPatch> anchor;                    // its first appearance
  Eigen::Matrix2f shape = Eigen::Matrix2f::Identity();  // present affine shape of that appearance
  std::size_t turned = 0;            // images with a known rotation over which it was tracked
  std::array<Vector2d, kSpan> past;  // n, by image modulo kSpan
};

// A camera's image with equalised contrast, and the same at half the size.
struct Prepared {
  std::vector<std::uint8_t> full;
  std::vector<std::uint8_t> half;
  int width = 0;
  int height = 0;

  [[nodiscard]] GrayView view() const { return {full.data(), width, height}; }
  [[nodiscard]] GrayView half_view() const { return {half.data(), width / 2, height / 2}; }

  ImageStatistics take(const ImageFrame& image) {
    width = image.width;
    height = image.height;
    const ImageStatistics statistics = even_contrast({image.pixels.data(), width, height}, full);
    halve(view(), half);
    return statistics;
  }
};

bool is_as_agreed(const ImageFrame& image, const CameraModel& camera) {
  return image.format == ImageFrame::Format::kGray8 && image.width == camera.width &&
         image.height == camera.height &&
         image.pixels.size() ==
             static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
}

std::string disagreement(const ImageFrame& image, const CameraModel& camera) {
  return fmt::format(
      "a {} picture of {} x {} pixels in {} bytes, where a grey one of {} x {} was "
      "agreed",
      image.format == ImageFrame::Format::kGray8 ? "grey" : "colour", image.width, image.height,
      image.pixels.size(), camera.width, camera.height);
}

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

const char* to_string(ImageFault fault) {
  switch (fault) {
    case ImageFault::kNone:
      return "none";
    case ImageFault::kNotAsAgreed:
      return "not_as_agreed";
    case ImageFault::kNotLater:
      return "not_later";
    case ImageFault::kFrozen:
      return "frozen";
    case ImageFault::kNoContrast:
      return "no_contrast";
    case ImageFault::kFewFeatures:
      return "few_features";
    case ImageFault::kLost:
      return "lost";
    case ImageFault::kLibraryError:
      return "library_error";
  }
  return "?";
}

struct Tracker::Impl {
  Impl(TrackerOptions given, const CameraModel& left_camera,
       const std::optional<CameraModel>& right_camera, std::uint64_t seed)
      : options(given),
        left(left_camera),
        right(right_camera),
        klt(given.window_px),
        grid({given.min_gradient, given.min_distance_px}, left_camera.width, left_camera.height,
             given.max_features, kBorder),
        random(seed, kRansacStream) {
    if (right) {
      StereoOptions of_stereo;
      of_stereo.min_depth_m = options.min_depth_m;
      stereo.emplace(of_stereo, left, *right, options.window_px);
    }
  }

  [[nodiscard]] double focal() const { return 0.5 * (left.fx + left.fy); }

  // True if the image is rejected, with the reason.
  [[nodiscard]] bool refuses(const ImageFrame& image, ImageQuality& quality) const {
    const auto refuse = [&](ImageFault fault, std::string reason) {
      quality.fault = fault;
      quality.reason = std::move(reason);
      return true;
    };
    if (!is_as_agreed(image, left)) {
      return refuse(ImageFault::kNotAsAgreed, disagreement(image, left));
    }
    if (last_utime && image.utime <= *last_utime) {
      return refuse(ImageFault::kNotLater, fmt::format("stamped {} us, and the one before {} us",
                                                       image.utime, *last_utime));
    }
    if (last_utime && image.pixels == raw) {
      return refuse(ImageFault::kFrozen, "bit for bit the picture before: the camera is frozen");
    }
    return false;
  }

  [[nodiscard]] bool has_no_contrast(ImageQuality& quality) const {
    if (quality.contrast >= options.min_contrast) return false;
    quality.fault = ImageFault::kNoContrast;
    quality.reason = fmt::format(
        "nothing to see: mean {:.1f}, standard deviation {:.1f} of 255, where {:.1f} is needed",
        quality.brightness, quality.contrast, options.min_contrast);
    return true;
  }

  // Predicted positions of the tracks, by the rotation and each one's last motion. Drops tracks
  // predicted outside the image.
  [[nodiscard]] std::vector<Vector2f> predict(const std::optional<Quaterniond>& q, double dt) {
    std::vector<Vector2f> guesses;
    std::vector<Track> kept;
    for (Track& track : tracks) {
      Vector2d n = track.n;
      if (q) {
        const Vector3d turned = *q * track.n.homogeneous();
        if (!(turned.z() > 0.05)) continue;
        n = turned.hnormalized();
      }
      const Vector2d pixel = left.distort(n + dt * track.speed);
      if (!left.in_image(pixel, kBorder)) continue;
      guesses.push_back(pixel.cast<float>());
      kept.push_back(std::move(track));
    }
    tracks = std::move(kept);
    return guesses;
  }

  // Tracks all features from the last image into this one and back; drops failures. Returns a
  // library's exception as text, else empty.
  [[nodiscard]] std::string follow(const std::optional<Quaterniond>& q, double dt) {
    const std::vector<Vector2f> guesses = predict(q, dt);
    std::vector<Vector2f> from;
    for (const Track& track : tracks) from.push_back(track.pixel);
    const auto found = klt.follow(last.view(), now.view(), from, guesses, options.levels);
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
    const int back_levels = q ? 0 : std::max(0, options.levels - 1);
    const auto back = klt.follow(now.view(), last.view(), end, back_guesses, back_levels);
    if (!back) return back.error();
    for (std::size_t i = 0; i < there.size(); ++i) {
      const auto& returned = (*back)[i];
      if (!returned || (*returned - start[i]).norm() > static_cast<float>(options.back_px)) {
        continue;
      }
      if (move(there[i], end[i], q, dt)) tracks.push_back(std::move(there[i]));
    }
    return {};
  }

  // Aligns the first patch of every other track with the image: its position becomes the track's.
  // Drops tracks whose appearance has changed.
  void look_back() {
    std::erase_if(tracks, [&](Track& track) {
      const auto turn = static_cast<std::uint64_t>(track.id) + count;
      if (turn % kLookBackEvery != 0) return false;
      const auto found = track.anchor->find(now.view(), {track.pixel, track.shape});
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
  [[nodiscard]] bool move(Track& track, const Vector2f& pixel, const std::optional<Quaterniond>& q,
                          double dt) const {
    const auto n = left.undistort(pixel.cast<double>());
    if (!n) return false;
    const Vector2d turned = q ? Vector2d((*q * track.n.homogeneous()).hnormalized()) : track.n;
    track.speed = (*n - turned) / dt;
    track.pixel = pixel;
    track.n = *n;
    track.is_new = false;
    track.turned = q ? track.turned + 1 : 0;
    return true;
  }

  // Drops features that do not move with the rest, over the last `pictures` images; returns their
  // number.
  [[nodiscard]] int drop_moving(std::size_t images, const Quaterniond& q, double tolerance_px) {
    std::vector<TurnedMatch> matches;
    std::vector<std::size_t> of;
    for (std::size_t i = 0; i < tracks.size(); ++i) {
      if (tracks[i].turned < images) continue;
      const Vector2d& before = tracks[i].past[(count - images) % kSpan];
      const Vector3d turned = q * before.homogeneous();
      if (!(turned.z() > 0.05)) continue;
      matches.push_back({turned / turned.z(), tracks[i].n});
      of.push_back(i);
    }
    const std::vector<bool> agrees =
        agree_with_one_translation(matches, tolerance_px / focal(), random);
    std::vector<bool> drop(tracks.size(), false);
    for (std::size_t k = 0; k < of.size(); ++k) drop[of[k]] = !agrees[k];
    std::vector<Track> kept;
    for (std::size_t i = 0; i < tracks.size(); ++i) {
      if (!drop[i]) kept.push_back(std::move(tracks[i]));
    }
    const std::size_t before = tracks.size();
    tracks = std::move(kept);
    return static_cast<int>(before - tracks.size());
  }

  // Checks by the rotations since the last image, since the one kSpan before, and half way.
  [[nodiscard]] int drop_all_moving(const Quaterniond& q) {
    for (Quaterniond& since : turned_since) since = (q * since).normalized();
    turned_since[(count - 1) % kSpan] = q;
    int dropped = drop_moving(1, q, options.epipolar_px);
    for (const std::size_t span : {kSpan / 2, kSpan}) {
      dropped += drop_moving(span, turned_since[(count - span) % kSpan], options.drift_px);
    }
    return dropped;
  }

  [[nodiscard]] std::string add_new(int& added) {
    std::vector<Vector2f> taken;
    for (const Track& track : tracks) taken.push_back(track.pixel);
    const int few = options.max_features / 2;
    const int have = static_cast<int>(tracks.size());
    int cells = options.cells_per_image;
    if (have == 0) {
      cells = grid.cells();
    } else if (have < few) {
      cells *= 3;
    }
    const auto corners = grid.find(now.half_view(), taken, options.max_features - have, cells);
    if (!corners) return corners.error();
    for (const Vector2f& pixel : *corners) {
      const auto n = left.undistort(pixel.cast<double>());
      if (!n) continue;
      Track track;
      track.anchor = AnchorPatch::cut(now.view(), pixel);
      if (!track.anchor) continue;
      track.id = next_id++;
      track.pixel = pixel;
      track.n = *n;
      track.past.fill(*n);
      tracks.push_back(track);
      ++added;
    }
    return {};
  }

  [[nodiscard]] std::string right_unfit(const ImageFrame& image, Utime utime) const {
    if (!stereo) return "there is no calibration of a right camera";
    if (!is_as_agreed(image, *right)) return disagreement(image, *right);
    if (std::abs(image.utime - utime) > kStereoSlack) {
      return fmt::format("stamped {} us, and the left one {} us", image.utime, utime);
    }
    return {};
  }

  [[nodiscard]] std::string match_right(const ImageFrame& image) {
    const ImageStatistics statistics = now_right.take(image);
    if (statistics.contrast < options.min_contrast) {
      return fmt::format("nothing to see: standard deviation {:.1f} of 255", statistics.contrast);
    }
    std::vector<StereoQuery> queries;
    std::vector<std::size_t> of;
    for (std::size_t i = 0; i < tracks.size(); ++i) {
      const Track& track = tracks[i];
      const auto turn = static_cast<std::uint64_t>(track.id) + count;
      if (!track.inverse_depth && !track.is_new && turn % kSearchEvery != 0) continue;
      queries.push_back({track.pixel, track.n, track.inverse_depth});
      of.push_back(i);
    }
    const auto matches = stereo->match({now.view(), now.half_view()},
                                       {now_right.view(), now_right.half_view()}, queries);
    if (!matches) return matches.error();
    for (std::size_t k = 0; k < of.size(); ++k) {
      Track& track = tracks[of[k]];
      const auto& match = (*matches)[k];
      track.inverse_depth.reset();
      if (!match) continue;
      track.right = match->right;
      track.inverse_depth = match->inverse_depth;
    }
    return {};
  }

  void forget() {
    tracks.clear();
    turned_since.fill(Quaterniond::Identity());
  }

  // Tracks the features of the last image into this one; sets the fault if there is one.
  void follow_all(Utime utime, const std::optional<Quaterniond>& q, ImageQuality& quality) {
    const double dt = last_utime ? to_seconds(utime - *last_utime) : 0.0;
    if (!last_utime || dt > options.max_gap_s) {
      forget();
      return;
    }
    const int before = static_cast<int>(tracks.size());
    const std::string thrown = follow(q, dt);
    if (!thrown.empty()) {
      forget();
      quality.fault = ImageFault::kLibraryError;
      quality.reason = thrown;
      return;
    }
    look_back();
    quality.lost = before - static_cast<int>(tracks.size());
    if (q) quality.moving = drop_all_moving(*q);
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
                                  const std::optional<Quaterniond>& q) {
    TrackedImage result;
    result.frame.utime = image.utime;
    ImageQuality& quality = result.quality;
    if (refuses(image, quality)) return result;
    const ImageStatistics statistics = now.take(image);
    quality.brightness = statistics.brightness;
    quality.contrast = statistics.contrast;
    quality.sharpness = statistics.sharpness;
    if (has_no_contrast(quality)) return result;

    for (Track& track : tracks) track.right.reset();
    ++count;
    follow_all(image.utime, q, quality);
    if (const std::string thrown = add_new(quality.added); !thrown.empty()) {
      quality.fault = ImageFault::kLibraryError;
      quality.reason = thrown;
    }
    if (right_image != nullptr) {
      quality.right_reason = right_unfit(*right_image, image.utime);
      if (quality.right_reason.empty()) quality.right_reason = match_right(*right_image);
    }
    for (Track& track : tracks) {
      track.past[count % kSpan] = track.n;
      quality.stereo += track.right ? 1 : 0;
    }
    std::swap(last, now);
    raw = image.pixels;
    last_utime = image.utime;
    fill(result.frame);
    if (quality.fault == ImageFault::kNone &&
        static_cast<int>(tracks.size()) < options.min_features) {
      quality.fault = ImageFault::kFewFeatures;
      quality.reason =
          fmt::format("{} features, where {} are needed", tracks.size(), options.min_features);
    }
    return result;
  }

  TrackerOptions options;
  CameraModel left;
  std::optional<CameraModel> right;
  Klt klt;
  std::optional<StereoMatcher> stereo;
  CornerGrid grid;
  Random random;

  std::vector<Track> tracks;  // by id
  std::int64_t next_id = 0;
  std::size_t count = 0;  // number of used images
  std::optional<Utime> last_utime;
  std::vector<std::uint8_t> raw;  // the last image, unprocessed
  Prepared last;
  Prepared now;
  Prepared now_right;
  // Rotation of the left camera since each image, by image modulo kSpan.
  std::array<Quaterniond, kSpan> turned_since;
};

Tracker::Tracker(TrackerOptions options, const CameraModel& left,
                 const std::optional<CameraModel>& right, std::uint64_t seed) {
  DIVE_DEMAND(options.validate().empty() && left.validate().empty());
  DIVE_DEMAND(left.width >= 64 && left.height >= 64);
  impl_ = std::make_unique<Impl>(options, left, right, seed);
}
Tracker::Tracker(Tracker&&) noexcept = default;
Tracker& Tracker::operator=(Tracker&&) noexcept = default;
Tracker::~Tracker() = default;

std::optional<Utime> Tracker::utime() const { return impl_->last_utime; }

TrackedImage Tracker::step(const ImageFrame& left, const ImageFrame* right,
                           const std::optional<Eigen::Quaterniond>& q_C1C0) {
  DIVE_DEMAND(!q_C1C0 || std::abs(q_C1C0->norm() - 1.0) < 1e-6);
  return impl_->step(left, right, q_C1C0);
}

}  // namespace dive::estimation
