#pragma once
// The elements of a URDF file. Internal to the URDF reader.

#include <optional>
#include <span>
#include <string>

#include <urdf_model/joint.h>
#include <urdf_model/link.h>

#include "common/diagnostic.h"
#include "common/xml.h"

namespace dive::vehicle {

/// Reads elements and reports errors. An unreadable value is reported and replaced by a harmless
/// one: one pass finds all mistakes.
class UrdfElements {
 public:
  UrdfElements(const SourceText& source, Diagnostics& diagnostics)
      : source_(source), diagnostics_(diagnostics) {}

  [[nodiscard]] urdf::LinkSharedPtr link(const XmlElement& element);
  [[nodiscard]] urdf::JointSharedPtr joint(const XmlElement& element);

  /// Reports child elements that are not in `known`: as an error if one was probably meant, as a
  /// warning otherwise. Elements of a foreign namespace are ignored.
  void check_children(const XmlElement& element, std::span<const std::string> known);
  /// The value of a mandatory attribute; empty after an error.
  [[nodiscard]] std::string text(const XmlElement& element, const std::string& name);

  void error(const char* code, Span span, std::string message, std::string hint = {}) {
    diagnostics_.error(code, source_, span, std::move(message), std::move(hint));
  }

  /// The value of an attribute: `otherwise` if it is absent, 0 after an error.
  double number(const XmlElement& element, const std::string& name,
                std::optional<double> otherwise = std::nullopt);

 private:
  double length(const XmlElement& element, const std::string& name);
  urdf::Vector3 vector(const XmlElement& element, const std::string& name,
                       const urdf::Vector3& otherwise);
  urdf::Pose origin(const XmlElement& parent);
  urdf::InertialSharedPtr inertial(const XmlElement& element);
  void check_inertia(const XmlElement& element, const urdf::Inertial& inertial);
  urdf::CollisionSharedPtr collision(const XmlElement& element);
  urdf::GeometrySharedPtr geometry(const XmlElement& element);
  void joint_type(const XmlElement& element, urdf::Joint& joint);
  void joint_axis(const XmlElement& element, urdf::Joint& joint);
  void joint_limits(const XmlElement& element, urdf::Joint& joint);
  [[nodiscard]] std::string link_name(const XmlElement& joint, const std::string& end);

  const SourceText& source_;
  Diagnostics& diagnostics_;
};

}  // namespace dive::vehicle
