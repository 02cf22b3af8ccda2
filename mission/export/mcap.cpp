#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "mission/export/export_format.h"
#include "mission/export/mcap_schemas.h"
#include "mission/export/mcap_writer.h"
#include "mission/export/mesh_lines.h"

namespace dive::mission {
namespace {

constexpr const char* kFrame = "map";
constexpr const char* kVehicle = "vehicle";
// Levels of foxglove.Log.
constexpr int kInfo = 2;
constexpr int kWarning = 3;

std::string json_text(const std::string& text) {
  return nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::string vector(const Eigen::Vector3d& v) {
  return fmt::format("{{\"x\":{:.4f},\"y\":{:.4f},\"z\":{:.4f}}}", v.x(), v.y(), v.z());
}

std::string quaternion(const Eigen::Quaterniond& q) {
  return fmt::format("{{\"x\":{:.7f},\"y\":{:.7f},\"z\":{:.7f},\"w\":{:.7f}}}", q.x(), q.y(), q.z(),
                     q.w());
}

std::string pose(const Pose& X) {
  return fmt::format("{{\"position\":{},\"orientation\":{}}}", vector(X.p), quaternion(X.q));
}

class DiveWriter {
 public:
  explicit DiveWriter(const Exported& exported) : exported_(exported), file_("dive") {
    std::array<std::uint16_t, kMcapTopics.size()> schemas{};
    for (std::size_t i = 0; i < kMcapTopics.size(); ++i) {
      schemas[i] = file_.add_schema(kMcapTopics[i].schema_name, kMcapTopics[i].schema);
    }
    for (std::size_t i = 0; i < kMcapTopics.size(); ++i) {
      channels_[i] = file_.add_channel(kMcapTopics[i].topic, schemas[i]);
    }
  }

  // In the order of time, so that a reader from the front need not sort.
  std::string write() {
    map();
    std::size_t plan = 0;
    std::size_t event = 0;
    const auto write_until = [&](double t_s) {
      for (; plan < exported_.paths.size() && exported_.paths[plan].t_s <= t_s; ++plan) {
        path(exported_.paths[plan]);
      }
      for (; event < exported_.events.size() && exported_.events[event].t_s <= t_s; ++event) {
        log(exported_.events[event]);
      }
    };
    for (const ExportedSample& each : exported_.track) {
      write_until(each.t_s);
      sample(each);
    }
    write_until(INFINITY);
    return file_.finish();
  }

 private:
  void put(Topic topic, double t_s, const std::string& json) {
    file_.write(channels_[static_cast<std::size_t>(topic)], time_ns(t_s), json);
  }

  [[nodiscard]] std::uint64_t time_ns(double t_s) const {
    const Utime utime = exported_.begin + static_cast<Utime>(std::llround(t_s * 1e6));
    return static_cast<std::uint64_t>(std::max<Utime>(utime, 0)) * 1000U;
  }

  [[nodiscard]] std::string stamp(double t_s) const {
    const std::uint64_t ns = time_ns(t_s);
    return fmt::format("\"timestamp\":{{\"sec\":{},\"nsec\":{}}}", ns / 1'000'000'000U,
                       ns % 1'000'000'000U);
  }

  void sample(const ExportedSample& sample) {
    const std::string time = stamp(sample.t_s);
    const auto in_frame = [&](Topic topic, const Pose& X_WB) {
      put(topic, sample.t_s,
          fmt::format("{{{},\"frame_id\":\"{}\",\"pose\":{}}}", time, kFrame, pose(X_WB)));
    };
    if (sample.truth) in_frame(Topic::kTruth, *sample.truth);
    if (sample.estimate) {
      in_frame(Topic::kEstimate, *sample.estimate);
      put(Topic::kTransform, sample.t_s,
          fmt::format(
              "{{{},\"parent_frame_id\":\"{}\",\"child_frame_id\":\"{}\",\"translation\":{},"
              "\"rotation\":{}}}",
              time, kFrame, kVehicle, vector(sample.estimate->p), quaternion(sample.estimate->q)));
    }
    status(sample);
  }

  void status(const ExportedSample& sample) {
    std::string json = "{";
    const auto add = [&](const char* name, double value) {
      if (std::isfinite(value)) json += fmt::format("\"{}\":{:.6g},", name, value);
    };
    add("depth_m", sample.depth_m);
    if (sample.estimate) add("heading_deg", heading_deg(*sample.estimate));
    add("speed_mps", sample.speed_mps);
    add("sigma_m", sample.sigma_m);
    if (sample.truth && sample.estimate) {
      add("error_m", (sample.truth->p - sample.estimate->p).head<2>().norm());
    }
    add("command_mps", sample.command_mps);
    add("command_depth_m", sample.command_depth_m);
    add("battery_fraction", sample.battery);
    add("clearance_m", sample.clearance_m);
    add("cross_track_m", sample.cross_track_m);
    put(Topic::kStatus, sample.t_s,
        json + fmt::format("\"state\":{},\"goal\":{},\"rung\":{}}}", json_text(sample.state),
                           json_text(sample.goal), json_text(sample.rung)));
  }

  void path(const ExportedPath& path) {
    std::string poses;
    for (const Pose& waypoint : path.waypoints) {
      if (!poses.empty()) poses += ',';
      poses += pose(waypoint);
    }
    put(Topic::kPlan, path.t_s,
        fmt::format("{{{},\"frame_id\":\"{}\",\"poses\":[{}]}}", stamp(path.t_s), kFrame, poses));
  }

  void log(const ExportedEvent& event) {
    put(Topic::kEvents, event.t_s,
        fmt::format(
            "{{{},\"level\":{},\"message\":{},\"name\":\"executive\",\"file\":\"\",\"line\":0}}",
            stamp(event.t_s), event.is_failsafe ? kWarning : kInfo, json_text(event.text)));
  }

  // Once: an entity whose lifetime is 0 stays.
  void map() {
    if (exported_.map.triangles.empty()) return;
    std::string points;
    for (const Eigen::Vector3f& p : exported_.map.vertices) {
      if (!points.empty()) points += ',';
      points += vector(p.cast<double>());
    }
    std::string indices;
    for (const auto& [a, b, c] : exported_.map.triangles) {
      if (!indices.empty()) indices += ',';
      indices += fmt::format("{},{},{}", a, b, c);
    }
    put(Topic::kMap, 0.0,
        fmt::format("{{\"deletions\":[],\"entities\":[{{{},\"frame_id\":\"{}\",\"id\":\"map\","
                    "\"lifetime\":{{"
                    "\"sec\":0,\"nsec\":0}},\"frame_locked\":true,\"metadata\":[],\"arrows\":[],"
                    "\"cubes\":[],"
                    "\"spheres\":[],\"cylinders\":[],\"lines\":[],\"triangles\":[{{\"pose\":{},"
                    "\"points\":[{}],"
                    "\"color\":{{\"r\":0.6,\"g\":0.6,\"b\":0.6,\"a\":0.5}},\"colors\":[],"
                    "\"indices\":[{}]}}],"
                    "\"texts\":[],\"models\":[]}}]}}",
                    stamp(0.0), kFrame, pose(Pose()), points, indices));
  }

  const Exported& exported_;
  McapWriter file_;
  std::array<std::uint16_t, kMcapTopics.size()> channels_{};
};

}  // namespace

std::string to_mcap(const Exported& exported) { return DiveWriter(exported).write(); }

}  // namespace dive::mission
