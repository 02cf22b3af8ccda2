#pragma once
// A recording from a bag: ROS 1 bags, MCAP files, and bags of ROS 2 in sqlite3.

#include <map>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "estimation/dataset/recording.h"

namespace dive::estimation {

struct BagOptions {
  std::vector<std::string> calibration;  ///< Files and folders: calibration_file.h.
  std::string preset;                    ///< Name of a data set: bag_preset.h; may be empty.
  /// Topics by what they are: imu, cam0, cam1, depth, velocity, truth. They override all others.
  std::map<std::string, std::string> topics;
};

/// Reads everything but the images. A topic is the one that the options name, else the preset's,
/// else that of the sensor's calibration, else the only one of its type; velocity and truth only by
/// the options or the preset. If that is not enough, the error lists the file's topics. Pressure
/// becomes depth below the surface at 101325 Pa. True poses are taken as poses of B. Topics that
/// are not used are listed in a note. An error names the file, and the topic and message if it is
/// in one.
[[nodiscard]] tl::expected<Recording, std::string> read_bag(const std::string& path,
                                                            const BagOptions& options);

}  // namespace dive::estimation
