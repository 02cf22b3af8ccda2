#include "estimation/visual_inertial/front_end/motion_check.h"

#include <vector>

#include "estimation/visual_inertial/front_end/epipolar.h"

namespace dive::estimation {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr std::uint64_t kRansacStream = 31;
constexpr double kTurnSigmas = 2.0;  // of the turn's error that are tolerated

}  // namespace

MotionCheck::MotionCheck(const CameraModel& camera, Tolerances tolerances, std::uint64_t seed)
    : camera_(camera), tolerances_(tolerances), random_(seed, kRansacStream) {
  reset();
}

void MotionCheck::reset() { turned_since_.fill({}); }

int MotionCheck::remove_moving(std::vector<Track>& tracks, std::size_t image,
                               const CameraTurn& turn) {
  for (CameraTurn& since : turned_since_) {
    since.q_C1C0 = (turn.q_C1C0 * since.q_C1C0).normalized();
    since.sigma += turn.sigma;  // the bias has one sign
  }
  turned_since_[(image - 1) % Track::kPast] = turn;
  int removed = remove_over(tracks, image, 1, turn, tolerances_.last);
  for (const std::size_t span : {Track::kPast / 2, Track::kPast}) {
    removed += remove_over(tracks, image, span, turned_since_[(image - span) % Track::kPast],
                           tolerances_.drift);
  }
  return removed;
}

// By the motion over the last `span` images, in which the camera turned so.
int MotionCheck::remove_over(std::vector<Track>& tracks, std::size_t image, std::size_t span,
                             const CameraTurn& turn, double tolerance) {
  std::vector<TurnedMatch> matches;
  std::vector<std::size_t> of;
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    if (tracks[i].turned < span) continue;
    const Vector2d& before = tracks[i].past[(image - span) % Track::kPast];
    const Vector3d turned = turn.q_C1C0 * before.homogeneous();
    if (!(turned.z() > 0.05)) continue;
    matches.push_back({turned / turned.z(), tracks[i].n, camera_.jacobian(tracks[i].n)});
    of.push_back(i);
  }
  const std::vector<bool> agrees = agree_with_one_translation(
      matches, tolerance + kTurnSigmas * turn.sigma * camera_.focal(), random_);
  std::vector<bool> drop(tracks.size(), false);
  for (std::size_t k = 0; k < of.size(); ++k) drop[of[k]] = !agrees[k];
  // A track is still in its old place when it is asked for.
  return static_cast<int>(std::erase_if(tracks, [&](const Track& track) {
    return drop[static_cast<std::size_t>(&track - tracks.data())];
  }));
}

}  // namespace dive::estimation
