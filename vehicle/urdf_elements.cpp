#include "vehicle/urdf_elements.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <set>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <fmt/format.h>

#include "common/se3.h"
#include "common/suggest.h"

namespace dive::vehicle {
namespace {

constexpr double kMinLength = 1e-5;  // m: below the size of any part of a vehicle
constexpr double kMaxLength = 1e3;
constexpr double kThinPlate = 1e-3;  // tolerance for rounded values in the triangle inequality

bool may_repeat(const std::string& name) {
  static const std::set<std::string> kOnlyOnce{"inertial", "origin", "mass",  "inertia", "geometry",
                                               "box",      "mesh",   "axis",  "limit",   "parent",
                                               "cylinder", "sphere", "child", "motion"};
  return kOnlyOnce.count(name) == 0;
}

const char* hint_for_number(const std::string& value) {
  return value.find("${") == std::string::npos
             ? ""
             : "this looks like xacro: expand it with xacro first";
}

}  // namespace

std::string UrdfElements::text(const XmlElement& element, const std::string& name) {
  const XmlAttribute* attribute = element.attribute(name);
  if (attribute == nullptr) {
    error("URDF-ATTRIBUTE", element.span,
          fmt::format("<{}> lacks the attribute '{}'", element.name, name));
    return {};
  }
  if (attribute->value.empty()) {
    error("URDF-ATTRIBUTE", attribute->name_span, fmt::format("'{}' is empty", name));
  }
  return attribute->value;
}

void UrdfElements::check_children(const XmlElement& element, std::span<const std::string> known) {
  std::set<std::string> seen;
  for (const XmlElement& child : element.children) {
    if (!child.namespace_uri.empty()) continue;
    if (std::find(known.begin(), known.end(), child.name) != known.end()) {
      if (!seen.insert(child.name).second && !may_repeat(child.name)) {
        error("URDF-DUPLICATE", child.span,
              fmt::format("<{}> already has a <{}>", element.name, child.name));
      }
      continue;
    }
    const std::string message = fmt::format("<{}> has no element <{}>", element.name, child.name);
    if (const std::optional<std::string> meant = closest_match(child.name, known)) {
      error("URDF-ELEMENT", child.span, message, fmt::format("did you mean <{}>?", *meant));
    } else {
      diagnostics_.warning("URDF-ELEMENT", source_, child.span, message + "; it is ignored");
    }
  }
}

double UrdfElements::number(const XmlElement& element, const std::string& name,
                            std::optional<double> otherwise) {
  const XmlAttribute* attribute = element.attribute(name);
  if (attribute == nullptr) {
    if (otherwise) return *otherwise;
    error("URDF-ATTRIBUTE", element.span,
          fmt::format("<{}> lacks the attribute '{}'", element.name, name));
    return 0.0;
  }
  if (const std::optional<double> value = parse_number(attribute->value)) return *value;
  error("URDF-NUMBER", attribute->value_span,
        fmt::format("'{}' is not a finite number", attribute->value),
        hint_for_number(attribute->value));
  return otherwise.value_or(0.0);
}

double UrdfElements::length(const XmlElement& element, const std::string& name) {
  const std::size_t errors_before = diagnostics_.error_count();
  const double value = number(element, name);
  if (diagnostics_.error_count() == errors_before && (value < kMinLength || value > kMaxLength)) {
    error("URDF-SIZE", element.attribute(name)->value_span,
          fmt::format("a {} of {} m: expected {} to {} m", name, value, kMinLength, kMaxLength));
  }
  return value;
}

urdf::Vector3 UrdfElements::vector(const XmlElement& element, const std::string& name,
                                   const urdf::Vector3& otherwise) {
  const XmlAttribute* attribute = element.attribute(name);
  if (attribute == nullptr) return otherwise;
  if (const auto values = parse_numbers(attribute->value, 3)) {
    return {(*values)[0], (*values)[1], (*values)[2]};
  }
  error("URDF-NUMBER", attribute->value_span,
        fmt::format("'{}' is not three finite numbers", attribute->value),
        hint_for_number(attribute->value));
  return otherwise;
}

urdf::Pose UrdfElements::origin(const XmlElement& parent) {
  urdf::Pose pose;
  const XmlElement* element = parent.child("origin");
  if (element == nullptr) return pose;
  pose.position = vector(*element, "xyz", {});
  const urdf::Vector3 rpy = vector(*element, "rpy", {});
  const Eigen::Quaterniond q = from_rpy(rpy.x, rpy.y, rpy.z);
  pose.rotation.setFromQuaternion(q.x(), q.y(), q.z(), q.w());
  const double distance = std::hypot(pose.position.x, pose.position.y, pose.position.z);
  if (distance > kMaxLength) {
    error("URDF-SIZE", element->attribute("xyz")->value_span,
          fmt::format("an origin {:.3g} m away: expected at most {} m", distance, kMaxLength));
  }
  return pose;
}

urdf::LinkSharedPtr UrdfElements::link(const XmlElement& element) {
  static const std::array<std::string, 3> kKnown{"inertial", "collision", "visual"};
  check_children(element, kKnown);
  auto link = std::make_shared<urdf::Link>();
  link->name = text(element, "name");
  if (const XmlElement* child = element.child("inertial")) link->inertial = inertial(*child);
  for (const XmlElement& child : element.children) {
    if (child.name != "collision" || !child.namespace_uri.empty()) continue;
    if (urdf::CollisionSharedPtr part = collision(child)) {
      if (part->name.empty()) part->name = link->name;
      link->collision_array.push_back(std::move(part));
    }
  }
  if (!link->collision_array.empty()) link->collision = link->collision_array.front();
  return link;
}

urdf::InertialSharedPtr UrdfElements::inertial(const XmlElement& element) {
  static const std::array<std::string, 3> kKnown{"origin", "mass", "inertia"};
  check_children(element, kKnown);
  const XmlElement* mass = element.child("mass");
  const XmlElement* moments = element.child("inertia");
  if (mass == nullptr || moments == nullptr) {
    error("URDF-INERTIAL", element.span,
          fmt::format("<inertial> lacks <{}>", mass == nullptr ? "mass" : "inertia"),
          "a frame without mass has no <inertial>");
    return nullptr;
  }
  const std::size_t errors_before = diagnostics_.error_count();
  auto inertial = std::make_shared<urdf::Inertial>();
  inertial->origin = origin(element);
  inertial->mass = number(*mass, "value");
  inertial->ixx = number(*moments, "ixx");
  inertial->ixy = number(*moments, "ixy");
  inertial->ixz = number(*moments, "ixz");
  inertial->iyy = number(*moments, "iyy");
  inertial->iyz = number(*moments, "iyz");
  inertial->izz = number(*moments, "izz");
  if (diagnostics_.error_count() > errors_before) return nullptr;
  if (inertial->mass <= 0.0) {
    error("URDF-MASS", mass->attribute("value")->value_span,
          fmt::format("a mass of {} kg: expected a positive one", inertial->mass),
          "a frame without mass has no <inertial>");
    return nullptr;
  }
  check_inertia(*moments, *inertial);
  return inertial;
}

void UrdfElements::check_inertia(const XmlElement& element, const urdf::Inertial& inertial) {
  Eigen::Matrix3d tensor;
  tensor << inertial.ixx, inertial.ixy, inertial.ixz,  //
      inertial.ixy, inertial.iyy, inertial.iyz,        //
      inertial.ixz, inertial.iyz, inertial.izz;
  const Eigen::Vector3d principal =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(tensor, Eigen::EigenvaluesOnly).eigenvalues();
  const std::string moments =
      fmt::format("{:.4g}, {:.4g}, {:.4g} kg m^2", principal[0], principal[1], principal[2]);
  if (!(principal[0] > 0.0)) {
    error("URDF-INERTIA", element.span,
          fmt::format("the inertia is not positive definite: principal moments {}", moments));
  } else if (principal[2] > (principal[0] + principal[1]) * (1.0 + kThinPlate)) {
    diagnostics_.warning(
        "URDF-INERTIA-TRIANGLE", source_, element.span,
        fmt::format("no body has these principal moments: {}; the largest exceeds the sum of the "
                    "others",
                    moments));
  }
}

urdf::CollisionSharedPtr UrdfElements::collision(const XmlElement& element) {
  static const std::array<std::string, 2> kKnown{"origin", "geometry"};
  check_children(element, kKnown);
  auto collision = std::make_shared<urdf::Collision>();
  if (const XmlAttribute* name = element.attribute("name")) collision->name = name->value;
  collision->origin = origin(element);
  const XmlElement* shape = element.child("geometry");
  if (shape == nullptr) {
    error("URDF-GEOMETRY", element.span, "<collision> lacks <geometry>");
    return nullptr;
  }
  collision->geometry = geometry(*shape);
  return collision->geometry ? collision : nullptr;
}

urdf::GeometrySharedPtr UrdfElements::geometry(const XmlElement& element) {
  static const std::array<std::string, 4> kKnown{"box", "cylinder", "sphere", "mesh"};
  check_children(element, kKnown);
  if (std::count_if(element.children.begin(), element.children.end(),
                    [](const XmlElement& child) { return child.namespace_uri.empty(); }) > 1) {
    error("URDF-GEOMETRY", element.span, "<geometry> holds more than one shape",
          "write one <collision> for each");
    return nullptr;
  }
  if (const XmlElement* mesh = element.child("mesh")) {
    error("URDF-MESH", mesh->span, "a mesh as collision geometry is not read",
          "use boxes, cylinders or spheres that contain it");
    return nullptr;
  }
  if (const XmlElement* child = element.child("box")) {
    auto box = std::make_shared<urdf::Box>();
    const std::string size = text(*child, "size");
    if (size.empty()) return nullptr;
    box->dim = vector(*child, "size", {1.0, 1.0, 1.0});
    for (const double side : {box->dim.x, box->dim.y, box->dim.z}) {
      if (side >= kMinLength && side <= kMaxLength) continue;
      error("URDF-SIZE", child->attribute("size")->value_span,
            fmt::format("a side of {} m: expected {} to {} m", side, kMinLength, kMaxLength));
      return nullptr;
    }
    return box;
  }
  if (const XmlElement* child = element.child("cylinder")) {
    auto cylinder = std::make_shared<urdf::Cylinder>();
    cylinder->radius = length(*child, "radius");
    cylinder->length = length(*child, "length");
    return cylinder;
  }
  if (const XmlElement* child = element.child("sphere")) {
    auto sphere = std::make_shared<urdf::Sphere>();
    sphere->radius = length(*child, "radius");
    return sphere;
  }
  error("URDF-GEOMETRY", element.span, "<geometry> holds no box, cylinder or sphere");
  return nullptr;
}

std::string UrdfElements::link_name(const XmlElement& joint, const std::string& end) {
  const XmlElement* element = joint.child(end);
  if (element != nullptr) return text(*element, "link");
  error("URDF-JOINT", joint.span, fmt::format("the joint lacks <{}>", end));
  return {};
}

urdf::JointSharedPtr UrdfElements::joint(const XmlElement& element) {
  static const std::array<std::string, 9> kKnown{"origin", "parent",      "child",
                                                 "axis",   "calibration", "dynamics",
                                                 "limit",  "mimic",       "safety_controller"};
  check_children(element, kKnown);
  auto joint = std::make_shared<urdf::Joint>();
  joint->name = text(element, "name");
  joint->parent_to_joint_origin_transform = origin(element);
  joint->parent_link_name = link_name(element, "parent");
  joint->child_link_name = link_name(element, "child");
  joint_type(element, *joint);
  if (joint->type != urdf::Joint::FIXED) joint_axis(element, *joint);
  if (joint->type == urdf::Joint::REVOLUTE || joint->type == urdf::Joint::PRISMATIC) {
    joint_limits(element, *joint);
  }
  return joint;
}

void UrdfElements::joint_type(const XmlElement& element, urdf::Joint& joint) {
  static const std::vector<std::string> kTypes{"fixed",     "revolute", "continuous",
                                               "prismatic", "floating", "planar"};
  const std::string type = text(element, "type");
  joint.type = urdf::Joint::FIXED;
  if (type.empty() || type == "fixed") return;
  const Span span = element.attribute("type")->value_span;
  if (type == "revolute") {
    joint.type = urdf::Joint::REVOLUTE;
  } else if (type == "continuous") {
    joint.type = urdf::Joint::CONTINUOUS;
  } else if (type == "prismatic") {
    joint.type = urdf::Joint::PRISMATIC;
  } else if (type == "floating" || type == "planar") {
    error("URDF-JOINT-TYPE", span,
          fmt::format("a {} joint is not read: what hangs on it has no bounded range", type));
  } else {
    error("URDF-JOINT-TYPE", span,
          fmt::format("'{}' is not a type of joint: expected fixed, revolute, continuous or "
                      "prismatic",
                      type),
          did_you_mean(type, kTypes));
  }
}

void UrdfElements::joint_axis(const XmlElement& element, urdf::Joint& joint) {
  joint.axis = {1.0, 0.0, 0.0};
  const XmlElement* axis = element.child("axis");
  if (axis == nullptr) return;
  joint.axis = vector(*axis, "xyz", joint.axis);
  const double norm = std::hypot(joint.axis.x, joint.axis.y, joint.axis.z);
  if (!(norm > 1e-9)) {
    error("URDF-AXIS", axis->span, "the axis of a joint cannot be zero");
    return;
  }
  joint.axis = {joint.axis.x / norm, joint.axis.y / norm, joint.axis.z / norm};
}

void UrdfElements::joint_limits(const XmlElement& element, urdf::Joint& joint) {
  const XmlElement* limit = element.child("limit");
  if (limit == nullptr) {
    error("URDF-LIMIT", element.span,
          fmt::format("the joint '{}' has no <limit>: its range is not known", joint.name),
          "add <limit lower=\"...\" upper=\"...\"/>");
    return;
  }
  joint.limits = std::make_shared<urdf::JointLimits>();
  joint.limits->lower = number(*limit, "lower", 0.0);
  joint.limits->upper = number(*limit, "upper", 0.0);
  joint.limits->effort = number(*limit, "effort", 0.0);
  joint.limits->velocity = number(*limit, "velocity", 0.0);
  if (joint.limits->lower > joint.limits->upper) {
    error("URDF-LIMIT", limit->span,
          fmt::format("lower limit {} is above upper limit {}", joint.limits->lower,
                      joint.limits->upper));
  }
  if (joint.type == urdf::Joint::PRISMATIC &&
      std::max(std::abs(joint.limits->lower), std::abs(joint.limits->upper)) > kMaxLength) {
    error("URDF-LIMIT", limit->span,
          fmt::format("a travel beyond {} m is not a vehicle's", kMaxLength));
  }
}

}  // namespace dive::vehicle
