#include "mission/document/reader.h"

#include <utility>

#include <fmt/format.h>

#include "common/assert.h"
#include "mission/document/attribute_reader.h"
#include "mission/document/current_reader.h"
#include "mission/document/geographic.h"
#include "mission/document/state_reader.h"

namespace dive::mission {
namespace {

using behaviors::FailsafeKind;

class Reader {
 public:
  Reader(const SourceText& source, const Language& language, Diagnostics& diagnostics)
      : attributes_(source), language_(language), diagnostics_(diagnostics) {}

  Mission read(const XmlElement& root) {
    Mission mission;
    mission.id = attributes_.name(root, "id").value;
    if (const XmlElement* description = root.child("description")) {
      mission.description = description->text;
    }
    const XmlElement& vehicle = *root.child("vehicle");
    mission.speed = attributes_.number(vehicle, "speed");
    mission.attitude = attitude_mode(attributes_.name(vehicle, "attitude").value);
    read_map(*root.child("map"), mission);
    mission.simulated_water = attributes_.name(*root.child("map"), "simulated_water").value;
    read_estimator(root, mission);
    const XmlElement& start = *root.child("start");
    mission.start = attributes_.position(start);
    mission.start_heading_deg = attributes_.number(start, "heading_deg").value;
    mission.priors.start_m = attributes_.number(start, "sigma").value;
    const XmlElement* written = root.child("current");
    const XmlElement current = written != nullptr ? *written : absent(root, "Current");
    mission.priors.current = attributes_.number(current, "sigma").value;
    mission.current = read_current(current, attributes_, diagnostics_);
    mission.limits = limits(*root.child("limits"));
    mission.replan = replan(root);
    mission.failsafes = failsafes(root, mission.limits);
    turn_back_without_range(mission);
    read_operator(root, mission);
    read_resume(root, mission);
    const XmlElement& states = *root.child("states");
    mission.initial = attributes_.name(states, "initial");
    StateReader reader(attributes_, diagnostics_);
    for (const XmlElement& element : states.children) {
      mission.states.push_back(reader.read(element));
    }
    return mission;
  }

 private:
  void read_map(const XmlElement& element, Mission& mission) const {
    const XmlAttribute* file = element.attribute("file");
    const XmlAttribute* unknown = element.attribute("unknown");
    mission.map_file = {{}, element.span};
    if (unknown != nullptr) {
      mission.unknown = attributes_.name(element, "unknown").value == "optimistic"
                            ? UnknownPolicy::kOptimistic
                            : UnknownPolicy::kCautious;
    }
    if (file != nullptr && unknown != nullptr) {
      diagnostics_.error("MIS-MAP", attributes_.source(), unknown->name_span,
                         "the map has both a file and a policy for unknown environments",
                         "the simulated world of an unknown environment is 'simulation_map'");
    } else if (file == nullptr && unknown == nullptr) {
      diagnostics_.error("MIS-MAP", attributes_.source(), element.span,
                         "the map has neither a file nor a policy for unknown environments",
                         "write file=\"maps/NAME.sdf\", or unknown=\"cautious\"");
    }
    if (file != nullptr) mission.map_file = attributes_.path(element, "file");
    for (const char* name : {"fixes", "information", "sigma_m", "sigma_deg", "trust_absence"}) {
      const XmlAttribute* of_known = element.attribute(name);
      if (of_known == nullptr || unknown == nullptr) continue;
      diagnostics_.error(
          "MIS-MAP", attributes_.source(), of_known->name_span,
          fmt::format("'{}' is for known maps, but the environment is unknown", name));
    }
    if (element.attribute("fixes") != nullptr) {
      mission.allows_fixes = attributes_.name(element, "fixes").value != "off";
    }
    if (const XmlAttribute* information = element.attribute("information")) {
      if (attributes_.name(element, "information").value == "prefer") {
        mission.prefers_information = information->name_span;
      }
    }
    if (const XmlAttribute* trust = element.attribute("trust_absence")) {
      mission.trusts_absence = attributes_.flag(element, "trust_absence");
      mission.trusts_absence_span = trust->name_span;
    }
    Priors& priors = mission.priors;
    priors.map_m = value_or(element, "sigma_m", priors.map_m);
    priors.map_deg = value_or(element, "sigma_deg", priors.map_deg);
    mission.memory_s = value_or(element, "memory_s", mission.memory_s);
    read_mapping_sensor(element, mission);
    const XmlAttribute* simulation_map = element.attribute("simulation_map");
    if (simulation_map == nullptr) return;
    if (file == nullptr) {
      mission.map_file = attributes_.path(element, "simulation_map");
    } else {
      mission.simulation_map = attributes_.path(element, "simulation_map");
    }
  }

  void read_mapping_sensor(const XmlElement& element, Mission& mission) const {
    if (element.attribute("mapping_sensor") == nullptr) return;
    const Located<std::string> word = attributes_.name(element, "mapping_sensor");
    const MappingSensor sensor = word.value == "stereo" ? MappingSensor::kStereo
                                 : word.value == "none" ? MappingSensor::kNone
                                                        : MappingSensor::kRangeCamera;
    mission.mapping_sensor = {sensor, word.span};
    if (sensor != MappingSensor::kNone || !mission.unknown) return;
    diagnostics_.error("MIS-MAP", attributes_.source(), word.span,
                       "an unknown environment cannot be dived without a mapping sensor",
                       "write range_camera or stereo, or leave 'mapping_sensor' out");
  }

  [[nodiscard]] double value_or(const XmlElement& element, const char* name, double other) const {
    const auto written = attributes_.optional_number(element, name);
    return written ? written->value : other;
  }

  void read_estimator(const XmlElement& root, Mission& mission) const {
    const XmlElement* element = root.child("estimation");
    if (element == nullptr) return;
    const Located<std::string> word = attributes_.name(*element, "estimator");
    mission.estimator = {word.value == "visual_inertial" ? EstimatorName::kVisualInertial
                                                         : EstimatorName::kPrimitive,
                         word.span};
    mission.closes_loops = attributes_.flag(*element, "loop_closure");
    for (const XmlElement& child : element->children) mission.tags.push_back(tag(child));
  }

  TagSpec tag(const XmlElement& element) const {
    const Located<double> id = attributes_.number(element, "id");
    return {{static_cast<int>(id.value), id.span},
            attributes_.number(element, "size").value,
            attributes_.position(element),
            attributes_.number(element, "heading_deg").value,
            attributes_.number(element, "pitch_deg").value,
            attributes_.number(element, "roll_deg").value,
            attributes_.number(element, "sigma").value,
            attributes_.number(element, "sigma_deg").value};
  }

  Limits limits(const XmlElement& element) const {
    return {attributes_.number(element, "max_depth"),
            attributes_.number(element, "min_altitude"),
            attributes_.number(element, "clearance"),
            attributes_.number(element, "mission_timeout"),
            attributes_.number(element, "battery_reserve"),
            attributes_.optional_number(element, "reduced_clearance"),
            attributes_.optional_number(element, "max_depth_change")};
  }

  // The default of an element that is absent.
  XmlElement absent(const XmlElement& root, std::string_view type) const {
    XmlElement element;
    element.span = root.span;
    language_.add_defaults(element, type);
    return element;
  }

  ReplanPolicy replan(const XmlElement& root) const {
    const XmlElement* element = root.child("replan");
    return attributes_.replan(element != nullptr ? *element : absent(root, "Replan"));
  }

  void read_operator(const XmlElement& root, Mission& mission) const {
    const XmlElement* element = root.child("operator");
    const XmlElement written = element != nullptr ? *element : absent(root, "Operator");
    mission.abort_authority = attributes_.name(written, "abort").value == "key"
                                  ? AbortAuthority::kKey
                                  : AbortAuthority::kAnyone;
  }

  void read_resume(const XmlElement& root, Mission& mission) const {
    const XmlElement* element = root.child("resume");
    const XmlElement written = element != nullptr ? *element : absent(root, "Resume");
    const std::string policy = attributes_.name(written, "policy").value;
    mission.resume = policy == "continue" ? ResumePolicy::kContinue
                     : policy == "hold"   ? ResumePolicy::kHold
                                          : ResumePolicy::kSurface;
    mission.max_gap_s = attributes_.number(written, "max_gap");
  }

  Failsafes failsafes(const XmlElement& root, const Limits& limits) const {
    Failsafes failsafes;
    const XmlElement* parent = root.child("failsafes");
    for (std::size_t i = 0; i < behaviors::kFailsafeCount; ++i) {
      const behaviors::FailsafeTraits& traits = behaviors::traits(static_cast<FailsafeKind>(i));
      failsafes.threshold[i] = traits.threshold;
      if (traits.kind == FailsafeKind::kBattery) {
        failsafes.threshold[i] = limits.battery_reserve.value;
      }
      const XmlElement* element = parent == nullptr ? nullptr : parent->child(traits.name);
      if (element == nullptr) continue;
      failsafes.written[i] = element->span;
      read_policy(*element, traits, failsafes.policies[i], failsafes.threshold[i]);
    }
    if (const XmlElement* fence = parent == nullptr ? nullptr : parent->child("geofence")) {
      for (const XmlElement& corner : fence->children) {
        failsafes.fence.push_back(
            {attributes_.number(corner, "x"), attributes_.number(corner, "y")});
      }
    }
    return failsafes;
  }

  // In a known map the vehicle would go on by dead reckoning among obstacles that only the map
  // knows: it turns back while it still knows where it is.
  static void turn_back_without_range(Mission& mission) {
    constexpr auto kRangeLost = static_cast<std::size_t>(FailsafeKind::kRangeLost);
    if (mission.unknown || mission.failsafes.written[kRangeLost]) return;
    mission.failsafes.policies[kRangeLost].rung = behaviors::Rung::kAbortAndSurface;
  }

  void read_policy(const XmlElement& element, const behaviors::FailsafeTraits& traits,
                   behaviors::FailsafePolicy& policy, double& threshold) const {
    const auto rung = behaviors::find_rung(attributes_.name(element, "rung").value);
    DIVE_DEMAND(rung);  // the schema lists them
    policy.rung = *rung;
    const auto take = [&](std::string_view attribute, double& value) {
      if (const auto written = attributes_.optional_number(element, attribute)) {
        value = written->value;
      }
    };
    take("persistence", policy.persistence_s);
    take("clear", policy.clear_s);
    if (!traits.threshold_name.empty()) take(traits.threshold_name, threshold);
  }

  AttributeReader attributes_;
  const Language& language_;
  Diagnostics& diagnostics_;
};

}  // namespace

Mission read_mission(XmlDocument document, const Language& language, Diagnostics& diagnostics) {
  language.add_defaults(document.root);
  std::optional<Origin> origin =
      resolve_positions(document.root, document.source, language, diagnostics);
  Mission mission = Reader(document.source, language, diagnostics).read(document.root);
  mission.origin = std::move(origin);
  mission.source = std::move(document.source);
  return mission;
}

}  // namespace dive::mission
