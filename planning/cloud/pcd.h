#pragma once
// PCD, the Point Cloud Library's format, versions .5 to .7:
// https://pointclouds.org/documentation/tutorials/pcd_file_format.html

#include <cstddef>

#include <tl/expected.hpp>

#include "planning/cloud/rows.h"

namespace dive::planning {

[[nodiscard]] bool looks_like_pcd(std::string_view head);

/// Reads from the first byte of the file; at most `max_points`.
[[nodiscard]] tl::expected<RawCloud, std::string> read_pcd(Input& input, std::size_t max_points);

}  // namespace dive::planning
