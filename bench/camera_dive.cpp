#include "bench/camera_dive.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "common/random.h"
#include "mission/simulation/simulated_dive.h"

namespace dive::bench {
namespace {

constexpr double kUnderWay = 0.1;  // m/s

// File of a stretch's stored images, one pair after the other.
std::string file_of(const std::string& folder, const StudySetup& setup, const std::string& water,
                    std::uint64_t seed, Utime begin, double seconds) {
  return fmt::format("{}/{}-{}-{}-{}-{:g}.gray", folder, setup.mission.id, water, seed, begin,
                     seconds);
}

// The cameras, or a file of their earlier images.
class CachedCamera {
 public:
  CachedCamera(const StudySetup& setup, const vehicle::StereoCameraOptions& options,
               std::uint64_t seed, const std::string& file)
      : camera_(setup.world, options, seed), file_(file) {
    if (file.empty()) return;
    if (std::filesystem::exists(file)) {
      in_.open(file, std::ios::binary);
    } else {
      out_.open(file + ".part", std::ios::binary);
    }
  }

  ~CachedCamera() {
    if (!out_.is_open()) return;
    out_.close();
    std::filesystem::rename(file_ + ".part", file_);
  }
  CachedCamera(const CachedCamera&) = delete;
  CachedCamera& operator=(const CachedCamera&) = delete;

  [[nodiscard]] std::optional<Images> render(Utime now, const Pose& X_WB) {
    const auto due = static_cast<std::int64_t>(to_seconds(now) * camera_.options().rate_hz + 1e-9);
    if (due <= last_) return std::nullopt;
    last_ = due;
    Images images;
    if (in_.is_open()) {
      for (std::size_t k = 0; k < 2; ++k) images[k] = read(now, static_cast<int>(k));
      return images;
    }
    vehicle::StereoFrames frames = camera_.take(now, X_WB);
    for (std::size_t k = 0; k < 2; ++k) {
      images[k] = std::move(*frames[k]);
      if (!out_.is_open()) continue;
      out_.write(reinterpret_cast<const char*>(images[k].pixels.data()),
                 static_cast<std::streamsize>(images[k].pixels.size()));
    }
    return images;
  }

 private:
  [[nodiscard]] ImageFrame read(Utime now, int which) {
    const vehicle::StereoCameraOptions& options = camera_.options();
    ImageFrame frame{now, which, ImageFrame::Format::kGray8, options.width, options.height, {}};
    frame.pixels.resize(static_cast<std::size_t>(options.width * options.height));
    in_.read(reinterpret_cast<char*>(frame.pixels.data()),
             static_cast<std::streamsize>(frame.pixels.size()));
    if (!in_) throw std::runtime_error(file_ + " is cut off");
    return frame;
  }

  vehicle::StereoCamera camera_;
  std::string file_;
  std::ifstream in_;
  std::ofstream out_;
  std::int64_t last_ = -1;
};

}  // namespace

std::vector<DiveTick> swim(const StudySetup& setup, std::uint64_t seed) {
  std::vector<DiveTick> ticks;
  mission::DiveSettings settings;
  settings.seed = seed;
  settings.conditions.inertial_unit = vehicle::ImuNoise{};
  settings.sensor_observer = [&](const vehicle::SensorSamples& samples,
                                 const vehicle::GroundTruth& truth, const std::optional<Pose>&) {
    ticks.push_back({truth, samples});
  };
  static_cast<void>(
      mission::simulate_dive(setup.mission, setup.world, setup.model, settings, nullptr));
  return ticks;
}

std::vector<DiveTick> stretch_of(const std::vector<DiveTick>& dive, double seconds,
                                 std::uint64_t seed) {
  double deepest = 0.0;
  for (const DiveTick& tick : dive) deepest = std::min(deepest, tick.truth.X_WB.p.z());
  const auto swims = [&](const DiveTick& tick) {
    return tick.truth.X_WB.p.z() < 0.5 * deepest && tick.truth.v_WB_B.norm() > kUnderWay;
  };
  const auto first = std::find_if(dive.begin(), dive.end(), swims);
  const auto last = std::find_if(dive.rbegin(), dive.rend(), swims).base();
  const auto all = last - first;
  const auto wanted =
      std::min(all, static_cast<std::ptrdiff_t>(seconds / vehicle::Simulator::kTick));
  Random random(seed, 0x57e7);
  const auto begin =
      first + static_cast<std::ptrdiff_t>(random.uniform() * static_cast<double>(all - wanted));
  return {begin, begin + wanted};
}

void render(const StudySetup& setup, const std::vector<DiveTick>& stretch,
            const vehicle::StereoCameraOptions& camera, const std::string& water,
            std::uint64_t seed, const std::string& folder,
            const std::function<void(const DiveTick&, const Images*)>& see) {
  if (stretch.empty()) return;
  const Utime begin = stretch.front().truth.utime;
  const double seconds = to_seconds(stretch.back().truth.utime - begin);
  std::string file;
  if (!folder.empty()) {
    std::filesystem::create_directories(folder);
    file = file_of(folder, setup, water, seed, begin, seconds);
  }
  CachedCamera cameras(setup, camera, seed, file);
  for (const DiveTick& tick : stretch) {
    const std::optional<Images> images = cameras.render(tick.truth.utime, tick.truth.X_WB);
    see(tick, images ? &*images : nullptr);
  }
}

}  // namespace dive::bench
