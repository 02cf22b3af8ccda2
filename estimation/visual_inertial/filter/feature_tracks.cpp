#include "estimation/visual_inertial/filter/feature_tracks.h"

namespace dive::estimation {
namespace {

// Adds what depends on the camera; false if it has no image of n.
bool add_camera(const CameraModel& camera, const Eigen::Vector2d& n, std::size_t which,
                TrackObservation& observation) {
  if (!n.allFinite()) return false;
  const auto pixel = camera.project(n.homogeneous());
  if (!pixel) return false;
  observation.pixel[which] = *pixel;
  observation.to_pixels[which] = camera.jacobian(n);
  observation.row_s[which] = camera.row_time(*pixel);
  return true;
}

}  // namespace

std::optional<TrackObservation> observation_of(const FeatureObservation& feature,
                                               std::int64_t frame,
                                               std::span<const CameraModel> cameras) {
  TrackObservation observation{frame, feature.left, std::nullopt};
  if (!add_camera(cameras[0], feature.left, 0, observation) ||
      (feature.right && !feature.right->allFinite())) {
    return std::nullopt;
  }
  if (cameras.size() < 2 || !feature.right) return observation;
  if (!add_camera(cameras[1], *feature.right, 1, observation)) return std::nullopt;
  observation.right = feature.right;
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
