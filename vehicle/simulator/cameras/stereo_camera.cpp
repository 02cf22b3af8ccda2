#include "vehicle/simulator/cameras/stereo_camera.h"

#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "common/assert.h"
#include "common/random.h"
#include "common/range_check.h"
#include "vehicle/simulator/cameras/camera_renderer.h"
#include "vehicle/simulator/cameras/gaussian_blur.h"
#include "vehicle/simulator/cameras/visible_scene.h"
#include "vehicle/simulator/water/marine_snow.h"
#include "vehicle/simulator/water/water_light.h"

namespace dive::vehicle {
namespace {

constexpr std::uint64_t kNoiseStream = 24;
constexpr double kFaultBlur = 4.0;  // pixels

// C in B before the tilt: z ahead, x to the right, y down.
Eigen::Quaterniond ahead() {
  Eigen::Matrix3d R;
  R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return Eigen::Quaterniond(R);
}

DIVE_VECTOR_LOOP void add_halo(const float* blurred, const float* distance, float per_m,
                               std::size_t count, float* radiance) {
  for (std::size_t i = 0; i < count; ++i) {
    const float share = 1.0F - fast_exp(-per_m * distance[i]);
    radiance[i] += share * (blurred[i] - radiance[i]);
  }
}

}  // namespace

StereoCameraOptions StereoCameraOptions::scaled(double factor) const {
  StereoCameraOptions result = *this;
  result.width = static_cast<int>(std::lround(factor * width));
  result.height = static_cast<int>(std::lround(factor * height));
  result.fx *= factor;
  result.fy *= factor;
  result.cx = factor * (cx + 0.5) - 0.5;  // pixel (0, 0) is the centre of the first pixel
  result.cy = factor * (cy + 0.5) - 0.5;
  return result;
}

CameraModel StereoCameraOptions::camera(int index) const {
  DIVE_DEMAND(index == 0 || index == 1);
  CameraModel model;
  model.width = width;
  model.height = height;
  model.fx = fx;
  model.fy = fy;
  model.cx = cx;
  model.cy = cy;
  model.lens = lens;
  model.lens_parameters = lens_parameters;
  model.radtan = radtan;
  model.X_BC.p = index == 0 ? left_B : right_B;
  model.X_BC.q = from_rpy(0.0, deg_to_rad(tilt_deg), 0.0) * ahead();
  return model;
}

std::string StereoCameraOptions::validate() const {
  RangeCheck check;
  check("tilt_deg", tilt_deg, -90, 90);
  check("rate_hz", rate_hz, 0.01, 1000);
  if (!check.problem().empty()) return check.problem();
  if (!(left_B.norm() <= 10.0) || !(right_B.norm() <= 10.0)) {
    return "a camera's place in the body is more than 10 m from its origin";
  }
  if (!(spectrum >= 0.0).all() || !(spectrum <= 10.0).all()) {
    return "each weight of the spectrum must be from 0 to 10";
  }
  for (const Tag& tag : tags) {
    const bool is_one = tag.id >= 0 && tag.id < Tag::kCodes && tag.size_m > 0.0;
    if (!is_one || !tag.X_WT.is_finite())
      return fmt::format("there is no tag {} like that", tag.id);
  }
  if (lamps.size() > 16) return fmt::format("{} lamps; at most 16", lamps.size());
  for (const Lamp& lamp : lamps) {
    if (std::string problem = lamp.validate(); !problem.empty()) return problem;
  }
  if (std::string problem = camera(0).validate(); !problem.empty()) return problem;
  if (std::string problem = water.validate(); !problem.empty()) return problem;
  return sensor.validate();
}

struct StereoCamera::Impl {
  Impl(const planning::World& world, StereoCameraOptions options_, std::uint64_t seed)
      : options(std::move(options_)),
        noise(seed, kNoiseStream),
        scene(world, options.tags),
        light(options.water, options.lamps, options.spectrum),
        snow(options.water, seed),
        halo(options.width, options.height, options.water.halo_sigma_px),
        fault_blur(options.width, options.height, kFaultBlur),
        exposure(options.sensor),
        sensor(options.camera(0), options.sensor) {
    for (int k = 0; k < 2; ++k) {
      renderers.emplace_back(options.camera(k), options.lamps, options.water, options.spectrum);
    }
  }

  // Number of pairs that were due after the first.
  [[nodiscard]] std::int64_t sequence(Utime now) const {
    return static_cast<std::int64_t>(std::floor(to_seconds(now) * options.rate_hz + 1e-9));
  }

  [[nodiscard]] bool has_image(std::size_t k) const {
    return faults[k] == CameraFault::kNone || faults[k] == CameraFault::kBlur;
  }

  [[nodiscard]] StereoFrames take(Utime now, const Pose& X_WB, const std::optional<Pose>& X_WD) {
    last_sequence = sequence(now);
    snow.advance(now);
    std::optional<Pose> X_DW;
    if (X_WD) X_DW = X_WD->inverse();
    for (std::size_t k = 0; k < 2; ++k) {
      if (has_image(k)) render(k, now, X_WB, X_DW);
    }
    if (!exposure.is_settled() && (has_image(0) || has_image(1))) settle();
    last_exposure = exposure.now();
    StereoFrames frames;
    double grey = 0.0;
    double count = 0.0;
    for (std::size_t k = 0; k < 2; ++k) {
      const std::uint64_t key = noise.bits();
      if (has_image(k)) {
        grey += sensor.develop(renderers[k].radiance(), last_exposure, key, pixels[k]);
        count += 1.0;
      } else if (faults[k] == CameraFault::kBlackout) {
        pixels[k].assign(pixels[k].size(), 0);
      }
      if (faults[k] != CameraFault::kMissing) frames[k] = frame(k, now);
    }
    if (count > 0.0) exposure.observe(now, grey / count);
    return frames;
  }

  void render(std::size_t k, Utime now, const Pose& X_WB, const std::optional<Pose>& X_DW) {
    CameraRenderer& renderer = renderers[k];
    renderer.render(scene, light, X_WB, to_seconds(now), X_DW);
    std::vector<float>& radiance = renderer.radiance();
    if (options.water.halo_per_m > 0.0 && options.water.halo_sigma_px > 0.0) {
      add_halo(halo(radiance).data(), renderer.distance().data(),
               static_cast<float>(options.water.halo_per_m), radiance.size(), radiance.data());
    }
    const Pose X_WC = X_WB * renderer.camera().X_BC;
    snow.draw(renderer.camera(), X_WC, light, scene.sky().at(X_WC.p), renderer.distance(),
              radiance);
    if (faults[k] == CameraFault::kBlur) radiance = fault_blur(radiance);
  }

  void settle() {
    double mean = 0.0;
    double count = 0.0;
    for (std::size_t k = 0; k < 2; ++k) {
      if (!has_image(k)) continue;
      mean += sensor.mean(renderers[k].radiance());
      count += 1.0;
    }
    exposure.settle(mean / count);
  }

  [[nodiscard]] ImageFrame frame(std::size_t k, Utime now) const {
    return {now,           static_cast<int>(k), ImageFrame::Format::kGray8,
            options.width, options.height,      pixels[k]};
  }

  StereoCameraOptions options;
  Random noise;
  VisibleScene scene;
  WaterLight light;
  MarineSnow snow;
  GaussianBlur halo;
  GaussianBlur fault_blur;
  AutoExposure exposure;
  ImageSensor sensor;
  std::vector<CameraRenderer> renderers;
  std::array<CameraFault, 2> faults{};
  std::array<std::vector<std::uint8_t>, 2> pixels;  // the last images
  Exposure last_exposure;
  std::int64_t last_sequence = -1;
};

StereoCamera::StereoCamera(const planning::World& world, StereoCameraOptions options,
                           std::uint64_t seed) {
  DIVE_DEMAND(options.validate().empty());
  impl_ = std::make_unique<Impl>(world, std::move(options), seed);
  for (auto& pixels : impl_->pixels) {
    pixels.assign(static_cast<std::size_t>(impl_->options.width * impl_->options.height), 0);
  }
}
StereoCamera::StereoCamera(StereoCamera&&) noexcept = default;
StereoCamera& StereoCamera::operator=(StereoCamera&&) noexcept = default;
StereoCamera::~StereoCamera() = default;

bool StereoCamera::due(Utime now) const { return impl_->sequence(now) > impl_->last_sequence; }

StereoFrames StereoCamera::take(Utime now, const Pose& X_WB, const std::optional<Pose>& X_WD) {
  DIVE_DEMAND(X_WB.is_finite() && (!X_WD || X_WD->is_finite()));
  return impl_->take(now, X_WB, X_WD);
}

void StereoCamera::set_fault(int index, CameraFault fault) {
  DIVE_DEMAND(index == 0 || index == 1);
  impl_->faults[static_cast<std::size_t>(index)] = fault;
}

void StereoCamera::set_current(const Eigen::Vector3d& current_W) {
  DIVE_DEMAND(current_W.allFinite());
  impl_->snow.set_current(current_W);
}

const StereoCameraOptions& StereoCamera::options() const { return impl_->options; }
Exposure StereoCamera::exposure() const { return impl_->last_exposure; }

}  // namespace dive::vehicle
