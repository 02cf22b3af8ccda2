#include "test/estimation/visual_inertial/filter/made_features.h"

#include <cmath>
#include <utility>

namespace dive::testing {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// The ray beyond a plane between two media across z: the part along the plane grows with the index
// (Snell). Not a number beyond total reflection.
Vector3d refracted(const Vector3d& ray, double index) {
  const Vector2d along = index * ray.normalized().head<2>();
  return {along.x(), along.y(), std::sqrt(1.0 - along.squaredNorm())};
}

Vector2d pixel_of(const CameraModel& model, Vector3d p_C) {
  if (model.refractive_index != 1.0) p_C = refracted(p_C, model.refractive_index);
  Vector2d m = p_C.head<2>() / p_C.z();
  if (model.lens == LensModel::kEquidistant && m.norm() > 0.0) {
    m = std::atan2(p_C.head<2>().norm(), p_C.z()) * p_C.head<2>().normalized();
  }
  return {model.fx * m.x() + model.cx, model.fy * m.y() + model.cy};
}

// [x/z, y/z] of a pixel.
Vector2d image_of(const CameraModel& model, double u, double v) {
  Vector2d m((u - model.cx) / model.fx, (v - model.cy) / model.fy);
  if (model.lens == LensModel::kEquidistant && m.norm() > 0.0) {
    m = std::tan(m.norm()) * m.normalized();
  }
  if (model.refractive_index == 1.0) return m;
  return refracted(m.homogeneous(), 1.0 / model.refractive_index).hnormalized();
}

}  // namespace

MadeFeatures::MadeFeatures(const MadeFeatureOptions& options, std::vector<CameraModel> nominal,
                           std::vector<CameraModel> truth, Random& random)
    : options_(options), nominal_(std::move(nominal)), true_(std::move(truth)), random_(random) {}

void MadeFeatures::add_point_before(const Pose& X_WB) {
  points_.push_back(random_point_before(X_WB, options_.near_m, options_.far_m));
  is_followed_.push_back(false);
}

bool MadeFeatures::sees(const Pose& X_WB, const Vector3d& p_W, std::size_t which,
                        Vector2d& pixel) const {
  const CameraModel& model = true_[which];
  const Vector3d p_C = (X_WB * model.X_BC).inverse() * p_W;
  if (p_C.z() < 0.3 || p_C.z() > 8.0) return false;
  pixel = pixel_of(model, p_C);
  return pixel.x() >= 0.0 && pixel.y() >= 0.0 && pixel.x() <= model.width - 1 &&
         pixel.y() <= model.height - 1;
}

Vector3d MadeFeatures::random_point_before(const Pose& X_WB, double near, double far) {
  const CameraModel& model = true_.front();
  const double u = random_.uniform(0.0, model.width);
  const double v = random_.uniform(0.0, model.height);
  const double range = random_.uniform(near, far);
  return X_WB * (model.X_BC * (range * image_of(model, u, v).homogeneous()));
}

void MadeFeatures::follow_points(const Pose& X_WB, std::size_t wanted) {
  Vector2d pixel;
  for (auto i = followed_.begin(); i != followed_.end();) {
    const bool is_lost =
        random_.uniform() < options_.loss_share || !sees(X_WB, points_[i->second], 0, pixel);
    if (is_lost) is_followed_[i->second] = false;
    i = is_lost ? followed_.erase(i) : std::next(i);
  }
  // Starts at a random point, so that the points are spread over the image.
  const std::size_t begin = random_.bits() % points_.size();
  for (std::size_t k = 0; k < points_.size() && followed_.size() < wanted; ++k) {
    const std::size_t i = (begin + k * 7919) % points_.size();
    if (is_followed_[i] || !sees(X_WB, points_[i], 0, pixel)) continue;
    is_followed_[i] = true;
    points_of_[next_id_] = i;
    followed_[next_id_++] = i;
  }
}

void MadeFeatures::follow_snow(const Pose& X_WB, Utime utime, std::size_t wanted) {
  Vector2d pixel;
  for (auto& [id, flake] : flakes_) {
    flake.p_W += to_seconds(utime - flake.utime) * flake.v_W;
    flake.utime = utime;
  }
  std::erase_if(flakes_, [&](const auto& entry) {
    const Flake& flake = entry.second;
    return random_.uniform() < options_.loss_share || !sees(X_WB, flake.p_W, 0, pixel);
  });
  while (flakes_.size() < wanted) {
    const Vector3d p_W = random_point_before(X_WB, 0.5, 3.0);
    const double x = random_.normal();
    const double y = random_.normal();
    const Vector3d direction = Vector3d(x, y, random_.normal()).normalized();
    flakes_[kSnow + next_id_++] = {p_W, random_.uniform(0.05, 0.3) * direction, utime};
  }
}

estimation::FeatureObservation MadeFeatures::feature(const Motion& X_WB_after, std::int64_t id,
                                                     const Vector3d& p_W) {
  estimation::FeatureObservation feature;
  feature.id = id;
  for (std::size_t i = 0; i < true_.size(); ++i) {
    Vector2d pixel;
    if (!sees(X_WB_after(0.0), p_W, i, pixel)) continue;
    const CameraModel& truth = true_[i];
    for (int step = 0; step < 3 && truth.line_time_s > 0.0; ++step) {
      const double later_s = truth.line_time_s * (pixel.y() - 0.5 * (truth.height - 1));
      const Pose X_WC = X_WB_after(later_s) * truth.X_BC;
      pixel = pixel_of(truth, X_WC.inverse() * p_W);
    }
    const double x = pixel.x() + options_.pixel_sigma * random_.normal();
    const double y = pixel.y() + options_.pixel_sigma * random_.normal();
    const CameraModel& model = nominal_[i];
    const Vector2d image = image_of(model, x, y);
    if (i == 0) {
      feature.left = image;
    } else {
      feature.right = image;
    }
  }
  return feature;
}

std::vector<estimation::FeatureObservation> MadeFeatures::observe(const Motion& X_WB_after,
                                                                  Utime utime) {
  const Pose X_WB = X_WB_after(0.0);
  const auto snow = static_cast<std::size_t>(options_.snow_share * options_.features);
  follow_points(X_WB, static_cast<std::size_t>(options_.features) - snow);
  follow_snow(X_WB, utime, snow);
  std::vector<estimation::FeatureObservation> seen;
  for (const auto& [id, point] : followed_) seen.push_back(feature(X_WB_after, id, points_[point]));
  for (const auto& [id, flake] : flakes_) seen.push_back(feature(X_WB_after, id, flake.p_W));
  return seen;
}

}  // namespace dive::testing
