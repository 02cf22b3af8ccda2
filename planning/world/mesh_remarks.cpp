#include "planning/world/mesh_remarks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include <fmt/format.h>

namespace dive::planning {
namespace {

using Eigen::Vector3d;

constexpr double kSame = 0.01;       // relative difference of lengths that count as the same unit
constexpr double kUpright = 0.7071;  // cosine of 45 degrees
constexpr double kMinHeightOnEdge = 20.0;  // m
constexpr double kThin = 0.05;             // share of its height and length
constexpr double kMostlyAbove = 0.9;       // share of its area
constexpr double kMinEmerging = 0.5;       // m
constexpr double kEmergingShare = 0.1;     // share of its height
constexpr double kFlat = 0.25;             // height of flat ground as a share of its width
constexpr double kMaxHeight = 300.0;       // m
constexpr double kMaxLength = 5000.0;      // m
constexpr double kMinSpan = 1.0;           // m

using Remarks = std::vector<MeshRemark>;

bool same(double a, double b) { return std::abs(a - b) <= kSame * b; }

struct Unit {
  double length_m;
  std::string_view name;
};

void check_unit(const PlacedMesh& mesh, Remarks& remarks) {
  static constexpr std::array<Unit, 5> kUnits{{{0.001, "millimetres"},
                                               {0.01, "centimetres"},
                                               {0.0254, "inches"},
                                               {0.3048, "feet"},
                                               {1000.0, "kilometres"}}};
  const Vector3d scale = mesh.scale.cwiseAbs();
  const double factor = scale.x();
  const bool is_uniform = same(scale.y(), factor) && same(scale.z(), factor);
  if (!mesh.file.unit_m || !is_uniform || same(factor, 1.0)) return;
  const double unit = *mesh.file.unit_m;
  const char* code = "MAP-MESH-UNIT";
  if (same(unit, 1.0)) {
    for (const Unit& other : kUnits) {
      if (!same(factor, other.length_m)) continue;
      remarks.push_back({code,
                         fmt::format("states its unit as 1 m, and <scale> {:g} takes its numbers "
                                     "for {}",
                                     factor, other.name),
                         "compare its extents with the real ones, and correct whichever is wrong"});
    }
  } else if (same(factor, unit)) {
    remarks.push_back({code,
                       fmt::format("states its unit as {:g} m, which is applied when it is read; "
                                   "<scale> {:g} applies it again",
                                   unit, factor),
                       "remove <scale>"});
  } else if (same(factor * unit, 1.0)) {
    remarks.push_back({code,
                       fmt::format("states its unit as {:g} m, and <scale> {:g} undoes it: its "
                                   "numbers are taken for metres",
                                   unit, factor),
                       "remove <scale>, unless the file states a wrong unit"});
  }
}

// The file's up axis in the map; z if the file states none.
void check_up_axis(const PlacedMesh& mesh, Remarks& remarks) {
  const char axis = mesh.file.up_axis == '\0' ? 'Z' : mesh.file.up_axis;
  const Vector3d up = Vector3d::Unit(axis - 'X');
  const double upright = (mesh.R_WO * mesh.scale.cwiseProduct(up).normalized()).z();
  if (upright < -kUpright) {
    remarks.push_back({"MAP-MESH-UPSIDE-DOWN",
                       fmt::format("lies upside down: its {} axis points down in the map", axis),
                       "check roll and pitch in <pose> and the sign of <scale>; a wreck that lies "
                       "keel up needs no change"});
  } else if (axis != 'Z' && upright < kUpright) {
    remarks.push_back(
        {"MAP-MESH-UP-AXIS",
         fmt::format("states {}_UP, and that axis is {:.0f} degrees from the vertical in the map: "
                     "up axes of files are not applied",
                     axis, std::acos(std::clamp(upright, -1.0, 1.0)) * 180.0 / M_PI),
         axis == 'Y' ? "turn it by roll 1.5708 in <pose>, or export it with Z_UP"
                     : "turn it by pitch -1.5708 in <pose>, or export it with Z_UP"});
  }
}

void check_edge(const PlacedMesh& mesh, Remarks& remarks) {
  const Vector3d size = mesh.facts.bounds.sizes();
  const double thickness = std::min(size.x(), size.y());
  const double length = std::max(size.x(), size.y());
  if (size.z() < kMinHeightOnEdge || thickness > kThin * std::min(size.z(), length)) return;
  remarks.push_back({"MAP-MESH-ON-EDGE",
                     fmt::format("stands on edge: {:.1f} m long, {:.1f} m high and {:.1f} m thick",
                                 length, size.z(), thickness),
                     "turn it by roll 1.5708 in <pose> if y is up in its file"});
}

void check_surface(const PlacedMesh& mesh, Remarks& remarks) {
  const double top = mesh.facts.bounds.max().z();
  const double bottom = mesh.facts.bounds.min().z();
  if (mesh.facts.area_above_m2 >= kMostlyAbove * mesh.facts.area_m2) {
    remarks.push_back(
        {"MAP-MESH-ABOVE-SURFACE",
         fmt::format("lies above the surface (z = 0), from z = {:.1f} to {:.1f} m", bottom, top),
         "z points up: lower it by the z of <pose>, or mirror a file that counts depth downwards "
         "by <scale>1 1 -1</scale>"});
    return;
  }
  const Vector3d size = mesh.facts.bounds.sizes();
  const bool is_ground = size.z() < kFlat * std::min(size.x(), size.y());
  if (is_ground || top < std::max(kMinEmerging, kEmergingShare * size.z())) return;
  remarks.push_back(
      {"MAP-MESH-EMERGES",
       fmt::format("reaches {:.1f} m above the surface (z = 0), of {:.1f} m in height", top,
                   size.z()),
       "lower it by the z of <pose> if all of it is sunk; a pier or an island needs no change"});
}

void check_size(const PlacedMesh& mesh, Remarks& remarks) {
  const Vector3d size = mesh.facts.bounds.sizes();
  const double length = std::max(size.x(), size.y());
  if (size.z() <= kMaxHeight && length <= kMaxLength) return;
  remarks.push_back({"MAP-MESH-LARGE",
                     fmt::format("is {:.0f} m long and {:.0f} m high; few are longer than {:.0f} m "
                                 "or higher than {:.0f} m",
                                 length, size.z(), kMaxLength, kMaxHeight),
                     "give its unit by <scale> (centimetres: 0.01 0.01 0.01)"});
}

}  // namespace

std::vector<MeshRemark> remarks_on(const PlacedMesh& mesh) {
  Remarks remarks;
  check_unit(mesh, remarks);
  check_up_axis(mesh, remarks);
  check_edge(mesh, remarks);
  check_surface(mesh, remarks);
  check_size(mesh, remarks);
  return remarks;
}

std::vector<MeshRemark> remarks_on_all(const Eigen::AlignedBox3d& bounds_W) {
  if (bounds_W.isEmpty() || bounds_W.sizes().maxCoeff() >= kMinSpan) return {};
  const Vector3d size = bounds_W.sizes();
  return {{"MAP-MESH-SMALL",
           fmt::format("spans, with all others of the map, only {:.3g} x {:.3g} x {:.3g} m",
                       size.x(), size.y(), size.z()),
           "give its unit by <scale> (kilometres: 1000 1000 1000), or correct the one it has"}};
}

}  // namespace dive::planning
