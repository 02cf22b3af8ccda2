#include "estimation/visual_inertial/filter/feature_tracks.h"

namespace dive::estimation {

void FeatureTracks::add(std::int64_t id, const TrackObservation& observation) {
  Track& track = tracks_[id];
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
