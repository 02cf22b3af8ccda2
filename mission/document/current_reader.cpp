#include "mission/document/current_reader.h"

#include <utility>
#include <vector>

#include <fmt/format.h>

#include "mission/document/current_table.h"

namespace dive::mission {
namespace {

constexpr const char* kCode = "MIS-CURRENT";
constexpr double kSecondsPerMinute = 60.0;

class CurrentReader {
 public:
  CurrentReader(const XmlElement& element, const AttributeReader& attributes,
                Diagnostics& diagnostics)
      : element_(element), attributes_(attributes), diagnostics_(diagnostics) {}

  DeclaredCurrent read() {
    const XmlAttribute* speed = element_.attribute("speed");
    const XmlAttribute* towards = element_.attribute("towards_deg");
    const XmlAttribute* start = element_.attribute("start");
    const bool has_samples = !element_.children.empty();
    if (const XmlAttribute* constant = speed != nullptr ? speed : towards) {
      if (has_samples || start != nullptr) {
        return error(
            constant->name_span,
            fmt::format("'{}' is for a constant current, but this one has a table", constant->name),
            "leave out either speed and towards_deg, or the table and its start");
      }
      if (speed == nullptr || towards == nullptr) {
        return error(constant->name_span, "a constant current has a speed and a direction",
                     "write both speed=\"...\" (m/s) and towards_deg=\"...\" (the compass heading "
                     "towards which the water flows)");
      }
      return DeclaredCurrent(velocity_of(element_));
    }
    if (!has_samples && start == nullptr) return {};
    if (start == nullptr) {
      return error(element_.span,
                   "the times of the current's table are times of day, but the "
                   "mission's start is not given",
                   "write start=\"HH:MM\", the time of day at which the mission starts");
    }
    return table(minutes_of_day(attributes_.name(element_, "start").value), start->name_span);
  }

 private:
  [[nodiscard]] Eigen::Vector2d velocity_of(const XmlElement& element) const {
    return flow_towards(attributes_.number(element, "speed").value,
                        attributes_.number(element, "towards_deg").value);
  }

  DeclaredCurrent table(int start, const Span& start_span) {
    if (element_.children.size() < 2) {
      return error(start_span, "'start' is for a current with a table of two samples or more",
                   "write table=\"FILE.csv\", or leave 'start' out");
    }
    std::vector<DeclaredCurrent::Sample> samples;
    for (const XmlElement& sample : element_.children) {
      const Located<std::string> time = attributes_.name(sample, "time");
      const double elapsed_s = kSecondsPerMinute * (minutes_of_day(time.value) - start);
      if (!samples.empty() && elapsed_s <= samples.back().elapsed_s) {
        return error(time.span,
                     fmt::format("the sample of {} is not later than the one before", time.value),
                     "sort the samples by time; past midnight write 24:00, 24:30, ...");
      }
      samples.push_back({elapsed_s, velocity_of(sample)});
    }
    return DeclaredCurrent(std::move(samples));
  }

  DeclaredCurrent error(const Span& span, std::string message, std::string hint) {
    diagnostics_.error(kCode, attributes_.source(), span, std::move(message), std::move(hint));
    return {};
  }

  const XmlElement& element_;
  const AttributeReader& attributes_;
  Diagnostics& diagnostics_;
};

}  // namespace

Located<DeclaredCurrent> read_current(const XmlElement& element, const AttributeReader& attributes,
                                      Diagnostics& diagnostics) {
  return {CurrentReader(element, attributes, diagnostics).read(), element.span};
}

}  // namespace dive::mission
