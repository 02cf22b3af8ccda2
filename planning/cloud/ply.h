#pragma once
// PLY 1.0, the Stanford polygon format; vertices only.

#include <cstddef>

#include <tl/expected.hpp>

#include "planning/cloud/rows.h"

namespace dive::planning {

[[nodiscard]] bool looks_like_ply(std::string_view head);

/// Reads from the first byte of the file; at most `max_points`.
[[nodiscard]] tl::expected<RawCloud, std::string> read_ply(Input& input, std::size_t max_points);

}  // namespace dive::planning
