#pragma once
// Reads a dive log for a report.

#include <functional>
#include <string>

#include <tl/expected.hpp>

#include "mission/report/report.h"

namespace dive::mission {

struct ReadDiveOptions {
  /// Samples are kept ten times a second, in longer dives correspondingly less often.
  std::size_t max_samples = 12'000;
  std::size_t max_clearances = 4'000;          ///< Samples for which the clearance is measured.
  std::size_t max_observed = 8'000;            ///< Pieces of the observed map; beyond, every n-th.
  std::function<void(double share)> progress;  ///< Of reading the log; may be empty.
};

/// The error is a sentence with the path: the log cannot be read, its header is damaged, or it
/// contains no tick.
[[nodiscard]] tl::expected<Report, std::string> read_dive(const std::string& log_path,
                                                          const ReadDiveOptions& options = {});

}  // namespace dive::mission
