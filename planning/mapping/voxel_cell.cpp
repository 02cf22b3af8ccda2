#include "planning/mapping/voxel_cell.h"

#include <algorithm>
#include <cmath>

namespace dive::planning {

Facet::Facet(const Polytope& piece) : radius_(static_cast<float>(piece.radius)) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& v : piece.vertices) middle += v;
  middle /= static_cast<double>(piece.vertices.size());
  middle_ = middle.cast<float>();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < piece.vertices.size(); ++i) {
    const Eigen::Vector3d a = piece.vertices[i] - middle;
    const Eigen::Vector3d b = piece.vertices[(i + 1) % piece.vertices.size()] - middle;
    around_ = std::max(around_, static_cast<float>(a.norm()));
    normal += a.cross(b);
  }
  if (normal.norm() > 0.0) normal_ = normal.normalized().cast<float>();
  edges_.reserve(piece.vertices.size());
  for (std::size_t i = 0; i < piece.vertices.size(); ++i) {
    const Eigen::Vector3f a = piece.vertices[i].cast<float>();
    const Eigen::Vector3f b = piece.vertices[(i + 1) % piece.vertices.size()].cast<float>();
    const Eigen::Vector3f outward = (b - a).cross(normal_);
    const float length = outward.norm();
    if (length <= 0.0F) continue;
    edges_.push_back({outward / length, outward.dot(a) / length});
  }
}

bool Facet::contains(const Eigen::Vector3f& p_W, float tolerance) const {
  const float reach = radius_ + tolerance;
  const Eigen::Vector3f from = p_W - middle_;
  if (std::abs(normal_.dot(from)) > reach) return false;
  if (from.squaredNorm() > (around_ + reach) * (around_ + reach)) return false;
  return std::all_of(edges_.begin(), edges_.end(), [&](const Edge& edge) {
    return edge.outward.dot(p_W) <= edge.offset + tolerance;
  });
}

std::optional<float> Facet::height(const Eigen::Vector3f& p_W, float reach) const {
  const Eigen::Vector3f from = p_W - middle_;
  const float height = normal_.dot(from);
  if (std::abs(height) > reach || from.squaredNorm() > (around_ + reach) * (around_ + reach)) {
    return std::nullopt;
  }
  const bool is_inside = std::all_of(edges_.begin(), edges_.end(), [&](const Edge& edge) {
    return edge.outward.dot(p_W) <= edge.offset;
  });
  return is_inside ? std::optional(height) : std::nullopt;
}

Voxel& Cell::insert(int place) {
  at_[static_cast<std::size_t>(place)] = static_cast<std::int16_t>(voxels.size());
  Voxel& voxel = voxels.emplace_back();
  voxel.place = static_cast<std::int16_t>(place);
  return voxel;
}

void Cell::erase(std::size_t index) {
  at_[static_cast<std::size_t>(voxels[index].place)] = -1;
  if (index + 1 < voxels.size()) {
    voxels[index] = voxels.back();
    at_[static_cast<std::size_t>(voxels[index].place)] = static_cast<std::int16_t>(index);
  }
  voxels.pop_back();
}

bool Cell::is_on_surface(const Eigen::Vector3f& p_W, float tolerance) const {
  return std::any_of(facets.begin(), facets.end(),
                     [&](const Facet& facet) { return facet.contains(p_W, tolerance); });
}

const Facet* Cell::nearest(const Eigen::Vector3f& p_W, float reach, float& height) const {
  const Facet* best = nullptr;
  for (const Facet& facet : facets) {
    const std::optional<float> above = facet.height(p_W, reach);
    if (!above || (best != nullptr && std::abs(*above) >= std::abs(height))) continue;
    best = &facet;
    height = *above;
  }
  return best;
}

std::vector<Polytope> Cell::pieces(double ball_m) const {
  std::vector<Polytope> result = surface;
  for (const Voxel& voxel : voxels) {
    if (voxel.confirmed && !voxel.meshed) result.push_back({{voxel.p_W.cast<double>()}, ball_m});
  }
  if (result.size() > kMaxCellPieces) return {everything()};
  return result;
}

// Replacement for a cell with too many pieces: the whole cell is an obstacle.
Polytope Cell::everything() const {
  Eigen::AlignedBox3f box;
  for (const Voxel& voxel : voxels) box.extend(voxel.p_W);
  Polytope all;
  for (int corner = 0; corner < 8; ++corner) {
    all.vertices.push_back(
        box.corner(static_cast<Eigen::AlignedBox3f::CornerType>(corner)).cast<double>());
  }
  for (const Polytope& piece : surface) all.radius = std::max(all.radius, piece.radius);
  return all;
}

}  // namespace dive::planning
