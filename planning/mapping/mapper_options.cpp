#include "planning/mapping/mapper_options.h"

#include "common/range_check.h"

namespace dive::planning {

std::string MapperOptions::validate() const {
  RangeCheck check;
  check("voxel_m", voxel_m, 0.02, 2.0);
  check("min_range_m", min_range_m, 0.0, 5.0);
  check("max_range_m", max_range_m, 0.1, 1000.0);
  check("min_neighbours", min_neighbours, 0, 100);
  check("snow_range_m", snow_range_m, 0.0, 20.0);
  check("min_snow_neighbours", min_snow_neighbours, 0, 100);
  check("confirm", confirm, 1, 6);
  check("noise.constant_m", noise.constant_m, 0.0, 1.0);
  check("noise.share", noise.share, 0.0, 0.2);
  check("noise.square", noise.square, 0.0, 0.2);
  check("on_piece_m", on_piece_m, 0.0, 1.0);
  check("flat_m", flat_m, 0.001, 1.0);
  check("skin_m", skin_m, 0.0, 1.0);
  check("ball_m", ball_m, 0.0, 1.0);
  check("longest_edge_m", longest_edge_m, 0.05, 5.0);
  check("points_per_update", points_per_update, 1, 1e8);
  check("known_tolerance_m", known_tolerance_m, 0.0, 5.0);
  check("memory_s", memory_s, 1.0, 1e6);
  check("max_voxels", max_voxels, 1000, 2e7);
  return check.problem();
}

}  // namespace dive::planning
