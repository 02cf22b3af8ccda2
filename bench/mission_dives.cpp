// Runs a mission with a series of seeds; collisions and clearances are those of ground truth:
//     mission_dives missions/window.xml --dives 100 --jobs 2
//     mission_dives missions/wreck.xml --set map_shift_sigma_m=0.3     with other errors
//     mission_dives missions/wreck.xml --world missions/maps/maze.sdf   with a map of another place
//     mission_dives missions/wreck_unknown.xml --diver          a diver swims into the path
//     mission_dives missions/wreck.xml --fault range_silent     at a drawn time, for good
//     mission_dives missions/wreck_unknown.xml --trace 7        one dive, second by second
//     mission_dives bench/manoeuvres/hold.xml --until ascend    errors at the end of a manoeuvre
//     mission_dives --real ../shared/data --dives 8             a hull, a cave and a dock of others

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <iostream>
#include <limits>
#include <optional>
#include <ranges>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/wait.h>
#include <unistd.h>

#include "bench/dive_measures.h"
#include "bench/dive_summary.h"
#include "bench/drawn_dives.h"
#include "bench/real_waters.h"
#include "bench/run_study.h"
#include "planning/planner.h"
#include "planning/world/primitives.h"

namespace dive::bench {
namespace {

// In the simulated world, in which the objects stand.
void observe_with(Distances& distances, ObjectsInView& in_view, mission::DiveSettings& settings) {
  settings.sensor_observer = [&](const auto&, const vehicle::GroundTruth& truth,
                                 const std::optional<Pose>& X_WD) {
    distances.observe(truth, X_WD);
    in_view.observe(truth.X_WB);
  };
}
// The mission may skip an unreachable goal and still end well.
bool reached_all(const mission::DiveResult& result) {
  return result.outcome == "success" &&
         std::ranges::none_of(result.transitions, [](const mission::TimedTransition& transition) {
           const std::string& event = transition.record.event;
           return event.starts_with("plan.failed") || event.starts_with("timeout");
         });
}

nlohmann::json dive(const RoutedSetup& setup, const Draw& draw, std::uint64_t seed) {
  mission::DiveSettings settings = settings_for(setup, draw, seed);
  Distances distances(setup, settings);
  PositionErrors errors(settings);
  NearestPasses passes(setup);
  ObjectsInView in_view(settings);
  observe_with(distances, in_view, settings);
  std::optional<double> wrong_map_s;
  double off_path_m = 0.0;
  double margin = std::numeric_limits<double>::infinity();
  std::size_t with_hidden = 0;
  bool is_over = false;
  const mission::DiveResult result = mission::simulate_dive(
      setup.mission, setup.world, setup.model, settings,
      [&](const auto&, const mission::StepOutputs& out, const vehicle::GroundTruth& truth,
          const mission::TickContacts& contacts) {
        for (const mission::Collision& collision : contacts.begun) {
          with_hidden += in_view.was_hidden(collision.obstacle) ? 1 : 0;
        }
        is_over = is_over || (!draw.until.empty() && out.status.state == draw.until);
        if (!is_over) errors.observe(out.estimate, truth);
        passes.observe(out, truth, distances.min_to_world_m());
        margin = std::min(margin, out.status.margin_sigma);
        off_path_m = std::max(off_path_m, out.status.cross_track_m);
        for (const mission::FailsafeRecord& failsafe : out.failsafes) {
          if (failsafe.cause == "wrong_map" && !wrong_map_s) wrong_map_s = to_seconds(truth.utime);
        }
      });
  const NearestPass& pass = passes.nearest();
  return {{"seed", seed},
          {"outcome", result.outcome},
          {"reached", reached_all(result)},
          {"state", result.final_state},
          {"cause", result.cause},
          {"clearance", distances.min_to_world_m()},
          {"as_stands", pass.as_stands},
          {"as_drawn", pass.as_drawn},
          {"as_estimated", pass.as_estimated},
          {"planned", pass.planned},
          {"off_path_there", pass.off_path},
          {"at", pass.at_s},
          {"from_diver", distances.min_to_diver_m()},
          {"collisions", result.collisions.size()},
          {"hidden", with_hidden},
          {"duration", result.duration_s},
          {"depth", result.final_depth_m},
          {"error", result.final_error_m},
          {"error_p95", errors.p95_m()},
          {"nees", errors.nees()},
          {"nees_in_map", errors.nees_in_map()},
          {"error_end", errors.last_m()},
          {"off_path", off_path_m},
          {"margin", std::min(margin, 99.0)},
          {"wrong_map", wrong_map_s.value_or(-1.0)},
          {"replans", result.replans},
          {"pieces", result.observed_map.pieces()}};
}
void trace_plan(const planning::PlanResult& plan) {
  std::cout << fmt::format("  plan: {} {}, clearance {:.2f} m\n", planning::to_string(plan.status),
                           plan.reason, plan.clearance_m);
  for (const Pose& pose : plan.waypoints) {
    const Eigen::Vector3d rpy = to_rpy(pose.q);
    std::cout << fmt::format("    {:6.2f} {:6.2f} {:6.2f} rpy {:4.0f} {:4.0f} {:4.0f}\n",
                             pose.p.x(), pose.p.y(), pose.p.z(), rad_to_deg(rpy.x()),
                             rad_to_deg(rpy.y()), rad_to_deg(rpy.z()));
  }
}

void print_drawn(const mission::DiveSettings& settings) {
  if (settings.diver) {
    const vehicle::DiverTrack& track = *settings.diver;
    std::cout << fmt::format("a diver, from {:.1f} s at {:.2f} m/s:", track.start_s, track.speed);
    for (const auto& [p_W, pause_s] : track.waypoints) {
      std::cout << fmt::format(" ({:.2f} {:.2f} {:.2f}), {:.0f} s", p_W.x(), p_W.y(), p_W.z(),
                               pause_s);
    }
    std::cout << '\n';
  }
  for (const planning::Obstacle& object : settings.unmapped) {
    const Eigen::AlignedBox3d box = planning::bounding_box(object);
    std::cout << fmt::format("{}: {:.2f} x {:.2f} x {:.2f} m at ({:.2f} {:.2f} {:.2f})\n",
                             object.name, box.sizes().x(), box.sizes().y(), box.sizes().z(),
                             box.center().x(), box.center().y(), box.center().z());
  }
}

void trace(const RoutedSetup& setup, const Draw& draw, std::uint64_t seed) {
  mission::DiveSettings settings = settings_for(setup, draw, seed);
  Distances distances(setup, settings);
  ObjectsInView in_view(settings);
  observe_with(distances, in_view, settings);
  print_drawn(settings);
  Utime next = 0;
  std::size_t updated = 0;
  MapFix fix;
  const mission::DiveResult result = mission::simulate_dive(
      setup.mission, setup.world, setup.model, settings,
      [&](const mission::StepInputs& in, const mission::StepOutputs& out,
          const vehicle::GroundTruth& truth, const auto&) {
        if (in.map_fix) fix = *in.map_fix;
        for (const planning::ObstacleUpdate& update : in.obstacles) updated += update.cells.size();
        for (const auto& t : out.transitions) std::cout << "  " << t.to << ": " << t.cause << '\n';
        for (const auto& f : out.failsafes) std::cout << "  " << f.rung << ": " << f.why << '\n';
        for (const auto& a : out.actions) std::cout << fmt::format("  note: {}\n", a.text);
        if (out.plan_query) std::cout << fmt::format("  asks: {}\n", out.plan_query->cause);
        if (in.plan) trace_plan(in.plan->plan);
        if (in.now < next) return;
        next = in.now + 500'000;
        planning::World near;
        in.observed_map.append_within({out.estimate.X_WB.p - Eigen::Vector3d::Constant(2.5),
                                       out.estimate.X_WB.p + Eigen::Vector3d::Constant(2.5)},
                                      near.obstacles);
        const vehicle::ClearanceMeter by_map(near, setup.model.hull);
        const Eigen::Vector3d off = out.estimate.X_WB.p - truth.X_WB.p;
        std::cout << fmt::format(
            "{:6.1f} s  {:<12} at {:6.2f} {:6.2f} {:6.2f} rpy {:4.0f} {:4.0f} {:4.0f} of "
            "{:4.0f} {:4.0f} {:4.0f} rates {:5.2f} {:5.2f} {:5.2f} {:5.2f} {:5.2f} off {:5.2f} "
            "{:5.2f} {:5.2f} sigma {:.2f} v {:.2f} {:.2f} est "
            "{:.2f} {:.2f} of {:.2f}  clear "
            "{:5.2f} diver "
            "{:5.2f} map {:5.2f} path {:5.2f} cross {:.2f} margin {:.1f} {}  pieces {} (+{}) fix "
            "{}/{} {} places "
            "{}/{}/{}\n",
            to_seconds(in.now), out.status.state, truth.X_WB.p.x(), truth.X_WB.p.y(),
            truth.X_WB.p.z(), rad_to_deg(to_rpy(truth.X_WB.q).x()),
            rad_to_deg(to_rpy(truth.X_WB.q).y()), rad_to_deg(to_rpy(truth.X_WB.q).z()),
            rad_to_deg(to_rpy(out.command.o).x()), rad_to_deg(to_rpy(out.command.o).y()),
            rad_to_deg(to_rpy(out.command.o).z()), out.rates.surge, out.rates.heave, out.rates.roll,
            out.rates.pitch, out.rates.yaw, off.x(), off.y(), off.z(),
            estimation::horizontal_sigma(out.estimate), truth.v_WB_B.x(), truth.v_WB_B.y(),
            out.estimate.v_WB_B.x(), out.estimate.v_WB_B.y(), out.command.v,
            distances.to_world_now_m(), distances.to_diver_now_m(),
            near.obstacles.empty() ? 9.99 : by_map.clearance(out.estimate.X_WB),
            out.status.clearance_m, out.status.cross_track_m, out.status.margin_sigma,
            out.status.rung, in.observed_map.pieces(), updated, fix.used, fix.gated,
            static_cast<int>(fix.problem), fix.agreement.confirmed, fix.agreement.missing,
            fix.agreement.unmapped);
        updated = 0;
      });
  std::cout << fmt::format(
      "{} in {} ({}), clearance {:.3f}, to the diver {:.3f}, {} collision(s)\n", result.outcome,
      result.final_state, result.cause, distances.min_to_world_m(), distances.min_to_diver_m(),
      result.collisions.size());
}
// Each job is a process of its own and takes every n-th seed.
std::vector<nlohmann::json> dive_all(const RoutedSetup& setup, const Draw& draw, int first,
                                     int dives, int jobs) {
  const std::string folder = fmt::format("/tmp/mission_dives.{}", ::getpid());
  std::vector<pid_t> children;
  for (int job = 0; job < jobs; ++job) {
    const pid_t child = ::fork();
    if (child == 0) {
      std::ofstream out(fmt::format("{}.{}", folder, job));
      for (int i = job; i < dives; i += jobs) {
        out << dive(setup, draw, static_cast<std::uint64_t>(first + i)) << std::endl;
      }
      ::_exit(0);
    }
    children.push_back(child);
  }
  std::vector<nlohmann::json> results;
  for (int job = 0; job < jobs; ++job) {
    int status = 0;
    ::waitpid(children[static_cast<std::size_t>(job)], &status, 0);
    const std::string file = fmt::format("{}.{}", folder, job);
    std::ifstream in(file);
    for (std::string line; std::getline(in, line);) results.push_back(nlohmann::json::parse(line));
    ::unlink(file.c_str());
    if (status != 0) std::cerr << fmt::format("job {} ended with {}\n", job, status);
  }
  return results;
}

}  // namespace
}  // namespace dive::bench

int main(int argc, char** argv) {
  CLI::App app("Dives missions seed after seed; collisions and clearances from ground truth");
  std::vector<std::string> missions;
  int dives = 100;
  int first = 1;
  int jobs = 2;
  int traced = 0;
  dive::bench::Draw draw;
  std::string data;
  std::string fault;
  app.add_option("missions", missions);
  app.add_option("--real", data, "Folder of the shared data: dives the waters made of it");
  app.add_option("--dives", dives);
  app.add_option("--first", first, "Seed of the first dive");
  app.add_option("--jobs", jobs);
  app.add_option("--trace", traced, "This seed alone, every half second");
  app.add_option("--unmapped", draw.unmapped, "Objects on the route that the map lacks");
  app.add_option("--world", draw.world, "World (SDF) to dive in, other than the mission's map");
  app.add_flag("--diver", draw.with_diver, "A diver swims into the path");
  app.add_option("--until", draw.until, "State in which errors of the position no longer count");
  app.add_option("--fault", fault, "A fault of dive run, at a drawn time, for good");
  app.add_option("--set", draw.conditions, "NAME=VALUE of the simulator, as of dive run");
  CLI11_PARSE(app, argc, argv);
  return dive::bench::run_study([&] {
    if (!fault.empty()) {
      draw.fault = dive::mission::find_fault(fault);
      if (!draw.fault) throw std::runtime_error("there is no fault '" + fault + "'");
    }
    if (!data.empty()) {
      for (std::string& path : dive::bench::write_real_waters(data)) {
        missions.push_back(std::move(path));
      }
    }
    if (missions.empty()) throw std::runtime_error("give missions, or --real DATA");
    for (const std::string& path : missions) {
      const dive::bench::RoutedSetup setup = dive::bench::load_routed(path, draw);
      if (traced > 0) {
        dive::bench::trace(setup, draw, static_cast<std::uint64_t>(traced));
      } else {
        dive::bench::print_summary(path, dive::bench::dive_all(setup, draw, first, dives, jobs));
      }
    }
  });
}
