#include "estimation/visual_inertial/filter/feature_tracks.h"

namespace dive::estimation {
namespace {

// d pixel / d n; empty if the camera has no image of n.
std::optional<Eigen::Matrix2d> to_pixels(const CameraModel& camera, const Eigen::Vector2d& n) {
  if (!n.allFinite() || !camera.project(n.homogeneous())) return std::nullopt;
  return camera.jacobian(n);
}

}  // namespace

std::optional<TrackObservation> observation_of(const FeatureObservation& feature,
                                               std::int64_t frame,
                                               std::span<const CameraModel> cameras) {
  const auto left = to_pixels(cameras[0], feature.left);
  if (!left || (feature.right && !feature.right->allFinite())) return std::nullopt;
  TrackObservation observation{frame, feature.left, std::nullopt};
  observation.to_pixels[0] = *left;
  if (cameras.size() < 2 || !feature.right) return observation;
  const auto right = to_pixels(cameras[1], *feature.right);
  if (!right) return std::nullopt;
  observation.right = feature.right;
  observation.to_pixels[1] = *right;
  return observation;
}

void FeatureTracks::add(std::int64_t id, const TrackObservation& observation) {
  FeatureTrack& track = tracks_[id];
  track.id = id;
  track.last_frame = observation.frame;
  track.observations.push_back(observation);
}

void FeatureTracks::forget_frame(std::int64_t frame) {
  for (auto& [id, track] : tracks_) {
    std::erase_if(track.observations, [frame](const TrackObservation& observation) {
      return observation.frame == frame;
    });
  }
}

void FeatureTracks::use_up(std::int64_t id) {
  if (const auto found = tracks_.find(id); found != tracks_.end()) {
    found->second.observations.clear();
  }
}

void FeatureTracks::forget_lost(std::int64_t frame) {
  std::erase_if(tracks_, [frame](const auto& entry) { return entry.second.last_frame != frame; });
}

}  // namespace dive::estimation
