#include "planning/world/sdf_geometry.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "common/suggest.h"

namespace dive::planning {
namespace {

// Larger numbers in a map are typing errors, and their squares lose centimetres.
constexpr double kMaxValue = 1e6;

const std::array<std::string, 7> kShapes{"box",       "cylinder", "sphere", "capsule",
                                         "ellipsoid", "plane",    "mesh"};
const std::array<std::string, 4> kUnsupported{"heightmap", "polyline", "image", "cone"};

}  // namespace

void SdfValues::error(const char* code, Span span, std::string message, std::string hint) const {
  diagnostics_.error(code, source_, span, std::move(message), std::move(hint));
}

void SdfValues::warning(const char* code, Span span, std::string message, std::string hint) const {
  diagnostics_.warning(code, source_, span, std::move(message), std::move(hint));
}

std::optional<Eigen::VectorXd> SdfValues::numbers(const XmlElement& parent, const char* name,
                                                  std::size_t count) const {
  const XmlElement* element = parent.child(name);
  if (element == nullptr) {
    error("MAP-MISSING", parent.span, fmt::format("<{}> needs a <{}>", parent.name, name));
    return std::nullopt;
  }
  const auto values = parse_numbers(element->text, count);
  if (!values) {
    error("MAP-NUMBER", element->span,
          fmt::format("<{}> must hold {} finite number{}, not \"{}\"", name, count,
                      count == 1 ? "" : "s", element->text.substr(0, 60)));
    return std::nullopt;
  }
  Eigen::VectorXd result = Eigen::VectorXd::Map(values->data(), static_cast<Eigen::Index>(count));
  if (result.cwiseAbs().maxCoeff() > kMaxValue) {
    error("MAP-NUMBER", element->span,
          fmt::format("<{}> holds a number beyond {:.0f}", name, kMaxValue),
          "SDF lengths are metres, angles radians");
    return std::nullopt;
  }
  return result;
}

std::optional<Eigen::VectorXd> SdfValues::sizes(const XmlElement& parent, const char* name,
                                                std::size_t count) const {
  auto values = numbers(parent, name, count);
  if (values && values->minCoeff() <= 0.0) {
    error("MAP-SIZE", parent.child(name)->span,
          fmt::format("<{}> of a <{}> must be greater than zero", name, parent.name));
    return std::nullopt;
  }
  return values;
}

std::optional<bool> SdfValues::flag(const XmlElement& element, const char* name) const {
  const XmlAttribute* attribute = element.attribute(name);
  if (attribute == nullptr || attribute->value == "false" || attribute->value == "0") return false;
  if (attribute->value == "true" || attribute->value == "1") return true;
  error("MAP-FRAME", attribute->value_span,
        fmt::format("{} must be true or false, not \"{}\"", name, attribute->value));
  return std::nullopt;
}

Pose SdfValues::pose_of(const XmlElement& parent) const {
  const XmlElement* element = parent.child("pose");
  if (element == nullptr) return {};
  for (const char* name : {"relative_to", "frame"}) {
    const XmlAttribute* attribute = element->attribute(name);
    if (attribute != nullptr && !attribute->value.empty()) {
      error("MAP-FRAME", attribute->name_span,
            fmt::format("poses with {}=\"{}\" are not supported", name, attribute->value),
            "write the pose relative to the parent element");
      return {};
    }
  }
  const XmlAttribute* format = element->attribute("rotation_format");
  if (format != nullptr && format->value != "euler_rpy") {
    error("MAP-FRAME", format->value_span,
          fmt::format("rotation_format \"{}\" is not supported", format->value),
          "write x y z roll pitch yaw");
    return {};
  }
  if (element->text.empty()) return {};
  const auto values = numbers(parent, "pose", 6);
  if (!values) return {};
  const auto degrees = flag(*element, "degrees");
  if (!degrees) return {};
  const Eigen::Vector3d rpy = values->tail<3>() * (*degrees ? deg_to_rad(1.0) : 1.0);
  return {values->head<3>(), from_rpy(rpy.x(), rpy.y(), rpy.z())};
}

std::optional<SdfMesh> SdfValues::mesh_of(const XmlElement& element) const {
  if (const XmlElement* part = element.child("submesh")) {
    error("MAP-UNSUPPORTED", part->span, "a <submesh> cannot be picked out of its file",
          "export it into a file of its own");
    return std::nullopt;
  }
  const XmlElement* uri = element.child("uri");
  if (uri == nullptr || uri->text.empty()) {
    error("MAP-MISSING", element.span, "<mesh> needs a <uri>");
    return std::nullopt;
  }
  if (std::ranges::any_of(uri->text, [](unsigned char c) { return c < ' '; })) {
    error("MAP-MESH", uri->span, "a <uri> is one line");
    return std::nullopt;
  }
  SdfMesh mesh{uri->text, Eigen::Vector3d::Ones(), uri->span};
  if (element.child("scale") == nullptr) return mesh;
  const auto scale = numbers(element, "scale", 3);
  if (!scale) return std::nullopt;
  if (scale->cwiseAbs().minCoeff() <= 0.0) {
    error("MAP-SIZE", element.child("scale")->span, "<scale> of a <mesh> must not be zero");
    return std::nullopt;
  }
  mesh.scale = *scale;
  return mesh;
}

std::optional<Shape> SdfValues::shape_of(const XmlElement& element) const {
  if (element.name == "empty") return std::nullopt;
  if (element.name == "plane") return plane(element);
  if (element.name == "box") {
    const auto size = sizes(element, "size", 3);
    return size ? std::optional<Shape>(Box{*size}) : std::nullopt;
  }
  if (std::find(kShapes.begin(), kShapes.end(), element.name) != kShapes.end()) {
    return round_shape(element);
  }
  unknown_shape(element);
  return std::nullopt;
}

std::optional<Shape> SdfValues::round_shape(const XmlElement& element) const {
  if (element.name == "ellipsoid") {
    const auto radii = sizes(element, "radii", 3);
    return radii ? std::optional<Shape>(Ellipsoid{*radii}) : std::nullopt;
  }
  const auto radius = sizes(element, "radius", 1);
  if (element.name == "sphere") {
    return radius ? std::optional<Shape>(Sphere{(*radius)[0]}) : std::nullopt;
  }
  const auto length = sizes(element, "length", 1);
  if (!radius || !length) return std::nullopt;
  if (element.name == "capsule") return Capsule{(*radius)[0], (*length)[0]};
  return Cylinder{(*radius)[0], (*length)[0]};
}

std::optional<Shape> SdfValues::plane(const XmlElement& element) const {
  if (element.child("normal") == nullptr) return HalfSpace{Eigen::Vector3d::UnitZ()};
  const auto normal = numbers(element, "normal", 3);
  if (!normal) return std::nullopt;
  if (normal->norm() < 1e-9) {
    error("MAP-SIZE", element.child("normal")->span, "<normal> of a <plane> must not be zero");
    return std::nullopt;
  }
  return HalfSpace{normal->normalized()};
}

void SdfValues::unknown_shape(const XmlElement& element) const {
  if (std::find(kUnsupported.begin(), kUnsupported.end(), element.name) != kUnsupported.end()) {
    error("MAP-UNSUPPORTED", element.span,
          fmt::format("a <{}> cannot be used as a collision shape here", element.name),
          "export it as a mesh, or use simple shapes that contain it");
    return;
  }
  const auto meant = closest_match(element.name, kShapes);
  error("MAP-GEOMETRY", element.span, fmt::format("there is no shape <{}>", element.name),
        meant ? fmt::format("did you mean <{}>?", *meant)
              : "shapes are box, cylinder, sphere, capsule, ellipsoid, plane and mesh");
}

}  // namespace dive::planning
