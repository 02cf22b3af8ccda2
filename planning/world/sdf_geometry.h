#pragma once
// The innermost elements of an SDF file: poses and shapes, each value checked where it is read.

#include <optional>
#include <string>

#include "common/diagnostic.h"
#include "common/se3.h"
#include "common/source_text.h"
#include "common/xml.h"
#include "planning/world/world.h"

namespace dive::planning {

inline constexpr XmlLimits kSdfLimits{
    .max_bytes = 16U << 20U, .max_depth = 48, .max_elements = 300'000};

struct SdfMesh {
  std::string uri;
  Eigen::Vector3d scale;
  Span uri_span;
};

class SdfValues {
 public:
  SdfValues(const SourceText& source, Diagnostics& diagnostics)
      : source_(source), diagnostics_(diagnostics) {}

  /// The <pose> child of `parent` (x y z roll pitch yaw); identity if there is none.
  [[nodiscard]] Pose pose_of(const XmlElement& parent) const;

  /// The shape of one child of <geometry> except <mesh>. Absent after a diagnostic, and for
  /// <empty/>.
  [[nodiscard]] std::optional<Shape> shape_of(const XmlElement& element) const;
  [[nodiscard]] std::optional<SdfMesh> mesh_of(const XmlElement& element) const;

  void error(const char* code, Span span, std::string message, std::string hint = {}) const;
  void warning(const char* code, Span span, std::string message, std::string hint = {}) const;

 private:
  [[nodiscard]] std::optional<Eigen::VectorXd> numbers(const XmlElement& parent, const char* name,
                                                       std::size_t count) const;
  [[nodiscard]] std::optional<Eigen::VectorXd> sizes(const XmlElement& parent, const char* name,
                                                     std::size_t count) const;
  [[nodiscard]] std::optional<bool> flag(const XmlElement& element, const char* name) const;
  [[nodiscard]] std::optional<Shape> round_shape(const XmlElement& element) const;
  [[nodiscard]] std::optional<Shape> plane(const XmlElement& element) const;
  void unknown_shape(const XmlElement& element) const;

  const SourceText& source_;
  Diagnostics& diagnostics_;
};

}  // namespace dive::planning
