#pragma once
// AprilTags as rendered: square boards with a white margin one module wide, printed in front and
// blank behind. Thin: they obstruct neither the vehicle nor range rays.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/tag.h"

namespace dive::vehicle {

class TagBoards {
 public:
  struct Met {
    double distance = 0.0;  ///< Distance along the ray, m.
    Eigen::Vector3d normal_W = Eigen::Vector3d::UnitZ();
    bool is_white = true;
  };

  /// Demands ids of the family and positive sizes.
  explicit TagBoards(std::span<const Tag> tags);

  [[nodiscard]] bool empty() const { return boards_.empty(); }
  /// The first board along the unit vector d from o, nearer than `reach` or mounted on the surface
  /// at that distance.
  [[nodiscard]] std::optional<Met> meet(const Eigen::Vector3d& o, const Eigen::Vector3d& d,
                                        double reach) const;

 private:
  struct Board {
    Pose X_TW;
    Eigen::Vector3d normal_W;  ///< Normal out of the print.
    double module_m = 0.0;
    int modules = 0;                   ///< Modules along an edge, including the margin.
    std::vector<std::uint8_t> whites;  ///< White modules, row by row from the top left one.
  };

  std::vector<Board> boards_;
};

}  // namespace dive::vehicle
