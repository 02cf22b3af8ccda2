#include "estimation/visual_inertial/front_end/track_stereo.h"

#include <cmath>
#include <cstdint>

#include <fmt/format.h>

#include "estimation/visual_inertial/front_end/image_check.h"

namespace dive::estimation {
namespace {

constexpr Utime kMaxStampDifference = 1000;  // us between left and right
constexpr int kSearchPeriod = 6;             // images, for a feature without a stereo match

}  // namespace

TrackStereo::TrackStereo(const StereoOptions& options, const CameraModel& left,
                         const CameraModel& right, int window_px, double min_contrast)
    : right_(right),
      min_contrast_(min_contrast),
      matcher_(options, left, right, window_px),
      image_(window_px, StereoMatcher::kLevels) {}

std::string TrackStereo::match(const EqualisedImage& left, Utime left_utime,
                               const ImageFrame& right, std::size_t image,
                               std::vector<Track>& tracks) {
  if (std::string problem = format_problem(right, right_); !problem.empty()) return problem;
  if (std::abs(right.utime - left_utime) > kMaxStampDifference) {
    return fmt::format("stamped {} us, more than {} us from the left image, {} us", right.utime,
                       kMaxStampDifference, left_utime);
  }
  const ImageStatistics statistics = image_.set(right);
  if (statistics.contrast < min_contrast_) {
    return fmt::format("no contrast: standard deviation {:.1f} of 255, less than {:.1f}",
                       statistics.contrast, min_contrast_);
  }
  if (std::string thrown = image_.prepare(); !thrown.empty()) return thrown;
  std::vector<StereoQuery> queries;
  std::vector<std::size_t> of;
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    const Track& track = tracks[i];
    const auto turn = static_cast<std::uint64_t>(track.id) + image;
    if (!track.inverse_depth && !track.is_new && turn % kSearchPeriod != 0) continue;
    queries.push_back({track.pixel, track.n, track.inverse_depth});
    of.push_back(i);
  }
  const auto matches = matcher_.match(left.both(), image_.both(), queries);
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

}  // namespace dive::estimation
