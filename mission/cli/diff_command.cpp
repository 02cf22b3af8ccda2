#include <optional>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "common/input_file.h"
#include "mission/bundle/bundle.h"
#include "mission/bundle/bundled_dive.h"
#include "mission/bundle/vehicle_difference.h"
#include "mission/check/check.h"
#include "mission/cli/commands.h"
#include "mission/cli/diff_output.h"
#include "mission/cli/file_kind.h"
#include "mission/cli/json.h"
#include "mission/cli/loading.h"
#include "mission/cli/terminal.h"
#include "mission/cli/work_progress.h"
#include "mission/diff/document_difference.h"
#include "mission/diff/log_difference.h"
#include "mission/diff/plan_difference.h"
#include "mission/document/language.h"
#include "mission/simulation/simulated_conditions.h"

namespace dive::mission {
namespace {

using Json = nlohmann::ordered_json;

/// A mission or a bundle, ready to be compared.
struct Side {
  LogHeader files;
  std::string simulation_xml;
  vehicle::Model model;
  Json verdict;
};

/// How two missions differ.
struct MissionComparison {
  std::vector<Difference> mission;
  std::vector<Difference> map;
  std::string vehicle;  ///< Empty: the same.
  PlanComparison plans;

  [[nodiscard]] bool differs() const {
    return !mission.empty() || !map.empty() || !vehicle.empty() || plans.differs();
  }
};

// All of these print an error and return nothing if a file cannot be read.

std::optional<Side> read_mission_side(const std::string& path, const DiffArguments& arguments) {
  Diagnostics diagnostics;
  std::optional<LoadedMission> loaded = load(path, resources(arguments.allow_outside), diagnostics);
  if (!loaded) {
    print_diagnostics(diagnostics);
    return std::nullopt;
  }
  CheckOptions options;
  options.simulate = false;
  options.dive.seed = arguments.seed;
  options.dive.conditions = simulated_conditions(loaded->mission);
  CheckObserver observer;
  SteadyClock clock;
  const CheckReport report = check_mission(loaded->mission, loaded->world, loaded->model, options,
                                           diagnostics, observer, clock);
  return Side{header_of(*loaded, arguments.seed), loaded->simulation_map.content(),
              std::move(loaded->model), to_json(report, diagnostics)};
}

std::optional<Side> read_bundle_side(const std::string& path) {
  const auto refuse = [&path](const std::string& why) {
    complain(fmt::format("{}: {}", path, why));
    return std::nullopt;
  };
  tl::expected<OpenedBundle, std::string> opened = read_bundle(path, std::nullopt);
  if (!opened) return refuse(opened.error());
  tl::expected<BundledDive, std::string> dive = bundled_dive(opened->bundle);
  if (!dive) return refuse(dive.error());
  tl::expected<Json, std::string> verdict = parse_plan(opened->bundle.verdict);
  if (!verdict) return refuse("the result of its check: " + verdict.error());
  return Side{std::move(opened->bundle.header), std::move(opened->bundle.simulation_xml),
              std::move(dive->model), std::move(*verdict)};
}

std::optional<Side> read_side(const std::string& path, FileKind kind,
                              const DiffArguments& arguments) {
  return kind == FileKind::kBundle ? read_bundle_side(path) : read_mission_side(path, arguments);
}

// The elements of both texts; text that is no XML counts as one value.
std::vector<Difference> compare_texts(const std::string& what, const std::string& a,
                                      const std::string& b, const Language* language) {
  if (a == b) return {};
  Diagnostics unused;
  constexpr XmlLimits kLimits{.max_bytes = 64U << 20U, .max_elements = 2'000'000};
  std::optional<XmlDocument> one = parse_xml(SourceText(what, a), kLimits, unused);
  std::optional<XmlDocument> other = parse_xml(SourceText(what, b), kLimits, unused);
  if (!one || !other) return {{what, "there", "another"}};
  if (language != nullptr) {
    language->add_defaults(one->root);
    language->add_defaults(other->root);
  }
  return document_differences(one->root, other->root);
}

MissionComparison compare(const Side& a, const Side& b) {
  const Language language(mission_schema());
  MissionComparison result;
  result.mission = compare_texts("mission", a.files.mission_xml, b.files.mission_xml, &language);
  result.map = compare_texts("map", a.files.map_xml, b.files.map_xml, nullptr);
  if (a.files.map_meshes != b.files.map_meshes) {
    result.map.push_back({"meshes", "these", "others"});
  }
  for (Difference& each :
       compare_texts("simulated world", a.simulation_xml, b.simulation_xml, nullptr)) {
    each.what = "simulated world: " + each.what;
    result.map.push_back(std::move(each));
  }
  result.vehicle = vehicle_difference(a.model, b.model);
  result.plans = compare_plans(a.verdict, b.verdict);
  return result;
}

int diff_missions(const DiffArguments& arguments, FileKind kind_a, FileKind kind_b) {
  const std::optional<Side> a = read_side(arguments.a, kind_a, arguments);
  const std::optional<Side> b = a ? read_side(arguments.b, kind_b, arguments) : std::nullopt;
  if (!a || !b) return kExitUsage;
  const MissionComparison result = compare(*a, *b);
  if (arguments.json) {
    Json json = {{"kind", "missions"},
                 {"equal", !result.differs()},
                 {"mission", to_json(result.mission)},
                 {"map", to_json(result.map)},
                 {"vehicle", result.vehicle.empty() ? Json(nullptr) : Json(result.vehicle)}};
    json.update(to_json(result.plans));
    print_json(json);
  } else if (!result.differs()) {
    print("equal: mission, map, vehicle and plans");
  } else {
    print_differences("mission, A | B", result.mission);
    print_differences("map, A | B", result.map);
    if (!result.vehicle.empty()) print("vehicle\n  * A is for " + result.vehicle);
    print_comparison(result.plans);
  }
  return result.differs() ? kExitFailed : kExitSuccess;
}

int diff_plans(const DiffArguments& arguments) {
  const std::optional<Json> a = read_plan(arguments.a);
  const std::optional<Json> b = a ? read_plan(arguments.b) : std::nullopt;
  if (!a || !b) return kExitUsage;
  const PlanComparison result = compare_plans(*a, *b);
  if (arguments.json) {
    Json json = {{"kind", "plans"}, {"equal", !result.differs()}};
    json.update(to_json(result));
    print_json(json);
  } else if (!result.differs()) {
    print("equal: the plans");
  } else {
    print_comparison(result);
  }
  return result.differs() ? kExitFailed : kExitSuccess;
}

int diff_logs(const DiffArguments& arguments) {
  std::optional<LogReader> a = open_log(arguments.a);
  std::optional<LogReader> b = a ? open_log(arguments.b) : std::nullopt;
  if (!a || !b) return kExitUsage;
  SteadyClock clock;
  WorkProgress progress(clock, "comparing", arguments.json);
  a->observe([&](double share) { progress.show(share); });
  const LogComparison result = compare_logs(*a, *b);
  progress.clear();
  if (arguments.json) {
    print_json(to_json(result));
  } else if (result.is_equal) {
    print("equal: all inputs, decisions and commands");
  } else {
    print_comparison(result);
  }
  return result.is_equal ? kExitSuccess : kExitFailed;
}

bool is_mission(FileKind kind) { return kind == FileKind::kMission || kind == FileKind::kBundle; }

}  // namespace

int run_diff(const DiffArguments& arguments) {
  const FileKind a = kind_of_file(arguments.a);
  const FileKind b = kind_of_file(arguments.b);
  if (is_mission(a) && is_mission(b)) return diff_missions(arguments, a, b);
  if (a == b && a == FileKind::kJson) return diff_plans(arguments);
  if (a == b && a == FileKind::kLog) return diff_logs(arguments);
  for (const auto& [path, kind] : {std::pair(&arguments.a, a), std::pair(&arguments.b, b)}) {
    if (is_mission(kind) || kind == FileKind::kJson || kind == FileKind::kLog) continue;
    if (const auto readable = open_input(*path); !readable) {
      complain(fmt::format("{}: {}", *path, readable.error()));
      return kExitUsage;
    }
    complain(fmt::format("{}: this is {}: diff compares missions, bundles, plans (JSON) and logs",
                         *path, in_words(kind)));
    return kExitUsage;
  }
  complain(fmt::format("{} is {}, and {} is {}: diff compares two files of one kind", arguments.a,
                       in_words(a), arguments.b, in_words(b)));
  return kExitUsage;
}

}  // namespace dive::mission
