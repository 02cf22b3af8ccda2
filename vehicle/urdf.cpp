#include <array>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "common/suggest.h"
#include "common/xml.h"
#include "vehicle/model.h"
#include "vehicle/motion_element.h"
#include "vehicle/sweep.h"
#include "vehicle/urdf_reader.h"

namespace dive::vehicle {

extern const char kAqua2Urdf[];  // generated from aqua2.urdf by the build

namespace {

// One rigid body in B, all joints at zero.
struct Body {
  double mass = 0.0;
  Eigen::Vector3d centre_B = Eigen::Vector3d::Zero();
  Eigen::Matrix3d inertia_B = Eigen::Matrix3d::Zero();  // inertia about its own centre of mass
};

Body body_of(const urdf::Inertial& inertial, const Pose& X_BL) {
  const Pose X_BC = X_BL * to_pose(inertial.origin);
  Eigen::Matrix3d tensor;
  tensor << inertial.ixx, inertial.ixy, inertial.ixz,  //
      inertial.ixy, inertial.iyy, inertial.iyz,        //
      inertial.ixz, inertial.iyz, inertial.izz;
  const Eigen::Matrix3d R = X_BC.q.toRotationMatrix();
  return {inertial.mass, X_BC.p, R * tensor * R.transpose()};
}

// Combines bodies into one by the parallel axis theorem.
Body combine(const std::vector<Body>& bodies) {
  Body all;
  for (const Body& body : bodies) {
    all.mass += body.mass;
    all.centre_B += body.mass * body.centre_B;
  }
  all.centre_B /= all.mass;
  for (const Body& body : bodies) {
    const Eigen::Matrix3d S = skew(body.centre_B - all.centre_B);
    all.inertia_B += body.inertia_B - body.mass * S * S;
  }
  return all;
}

// The swept volume in B of a solid in a link's frame, over every joint from there up to the root.
Points swept_to_root(const urdf::Link& link, Points points) {
  urdf::JointConstSharedPtr joint = link.parent_joint;
  urdf::LinkConstSharedPtr above = link.getParent();
  while (joint) {
    points = swept(*joint, points);
    joint = above->parent_joint;
    above = above->getParent();
  }
  return points;
}

class Assembler {
 public:
  explicit Assembler(const urdf::ModelInterface& urdf_model) {
    model_.name = urdf_model.getName();
    model_.hips_B.fill(std::numeric_limits<double>::quiet_NaN());
    visit(*urdf_model.getRoot(), Pose{});
  }

  bool check(const XmlDocument& document, Diagnostics& diagnostics) const {
    const Span span = document.root.span;
    if (bodies_.empty()) {
      diagnostics.error("URDF-MASSLESS", document.source, span, "no link has a mass",
                        "give at least one link an <inertial>");
    }
    if (model_.hull.parts.empty()) {
      diagnostics.error("URDF-HULL", document.source, span,
                        "no link has collision geometry: the vehicle would pass through walls",
                        "give the links <collision> boxes, cylinders or spheres");
    }
    const bool hips_ok = check_hips(document, diagnostics);
    return hips_ok && !bodies_.empty() && !model_.hull.parts.empty();
  }

  Model take() {
    const Body all = combine(bodies_);
    model_.mass_kg = all.mass;
    model_.centre_of_mass_B = all.centre_B;
    model_.inertia_B = all.inertia_B;
    return std::move(model_);
  }

 private:
  static constexpr std::array kHips{"left_front",  "left_mid",  "left_rear",
                                    "right_front", "right_mid", "right_rear"};

  void visit(const urdf::Link& link, const Pose& X_BL) {
    if (link.inertial) bodies_.push_back(body_of(*link.inertial, X_BL));
    for (const urdf::CollisionSharedPtr& part : link.collision_array) {
      Points points = circumscribed(*part->geometry);
      const Pose X_LP = to_pose(part->origin);
      for (Eigen::Vector3d& point : points) point = X_LP * point;
      model_.hull.parts.push_back({part->name, swept_to_root(link, std::move(points))});
    }
    for (std::size_t i = 0; i < link.child_links.size(); ++i) {
      const urdf::Joint& joint = *link.child_joints[i];
      const Pose X_BJ = X_BL * to_pose(joint.parent_to_joint_origin_transform);
      joint_names_.push_back(joint.name);
      for (std::size_t hip = 0; hip < kHips.size(); ++hip) {
        if (joint.name == kHips[hip]) model_.hips_B.col(static_cast<int>(hip)) = X_BJ.p;
      }
      visit(*link.child_links[i], X_BJ);
    }
  }

  // A vehicle has all six hips or none: a missing one is misspelt.
  bool check_hips(const XmlDocument& document, Diagnostics& diagnostics) const {
    if (model_.hips_B.array().isNaN().all()) return true;
    bool ok = true;
    for (std::size_t hip = 0; hip < kHips.size(); ++hip) {
      if (model_.hips_B.col(static_cast<int>(hip)).allFinite()) continue;
      const std::optional<std::string> meant = closest_match(kHips[hip], joint_names_);
      diagnostics.error("URDF-HIPS", document.source, document.root.span,
                        fmt::format("there is no joint '{}', but other hips are there", kHips[hip]),
                        meant ? fmt::format("is it the joint '{}'?", *meant) : "");
      ok = false;
    }
    return ok;
  }

  Model model_;
  std::vector<Body> bodies_;
  std::vector<std::string> joint_names_;
};

std::optional<Model> assemble(const XmlDocument& document, Diagnostics& diagnostics) {
  const urdf::ModelInterfaceSharedPtr urdf_model = read_urdf_model(document, diagnostics);
  if (!urdf_model) return std::nullopt;
  Assembler assembler(*urdf_model);
  if (!assembler.check(document, diagnostics)) return std::nullopt;
  const std::optional<MotionModel> motion = read_motion(document, diagnostics);
  if (!motion) return std::nullopt;
  Model model = assembler.take();
  model.motion = *motion;
  return model;
}

}  // namespace

std::optional<Model> parse_urdf(SourceText source, Diagnostics& diagnostics) {
  const std::optional<XmlDocument> document =
      parse_xml(std::move(source), XmlLimits{}, diagnostics);
  return document ? assemble(*document, diagnostics) : std::nullopt;
}

std::optional<Model> load_urdf(const std::string& path, Diagnostics& diagnostics) {
  const std::optional<XmlDocument> document = read_xml(path, XmlLimits{}, diagnostics);
  return document ? assemble(*document, diagnostics) : std::nullopt;
}

SourceText aqua2_urdf() { return {"vehicle/aqua2.urdf", kAqua2Urdf}; }

}  // namespace dive::vehicle
