#pragma once
// AprilTags as cameras see them: square boards with a white margin one module wide, printed in
// front and bare behind. Thin: they stop no vehicle and no range ray.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/tag.h"

namespace dive::vehicle {

class TagBoards {
 public:
  struct Met {
    double distance = 0.0;  ///< m, along the ray.
    Eigen::Vector3d normal_W = Eigen::Vector3d::UnitZ();
    bool is_white = true;
  };

  /// Demands ids of the family and sizes that are positive.
  explicit TagBoards(std::span<const Tag> tags);

  [[nodiscard]] bool empty() const { return boards_.empty(); }
  /// The first board along the unit vector d from o, nearer than `reach` or on the very surface
  /// that lies there.
  [[nodiscard]] std::optional<Met> meet(const Eigen::Vector3d& o, const Eigen::Vector3d& d,
                                        double reach) const;

 private:
  struct Board {
    Pose X_TW;
    Eigen::Vector3d normal_W;  ///< Out of the print.
    double module_m = 0.0;
    int modules = 0;                   ///< Along an edge, the margin included.
    std::vector<std::uint8_t> whites;  ///< Row by row from the top left one.
  };

  std::vector<Board> boards_;
};

}  // namespace dive::vehicle
