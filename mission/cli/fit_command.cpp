#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "mission/cli/commands.h"
#include "mission/cli/json.h"
#include "mission/cli/output.h"
#include "mission/cli/terminal.h"
#include "mission/fit/fit_dives.h"
#include "mission/fit/recorded_motion.h"
#include "vehicle/model.h"
#include "vehicle/motion_element.h"

namespace dive::mission {
namespace {

using estimation::FittedCoefficient;
using estimation::MotionRecord;
using Json = nlohmann::ordered_json;

/// The dives of one vehicle.
struct Dives {
  std::vector<MotionRecord> fitted;
  std::vector<MotionRecord> held_out;
  std::vector<std::string> left_out;  ///< Logs whose dives lack something, and what.
  SourceText vehicle;                 ///< Its description, that of the first log.
};

// A dive that lacks something is left out: a folder holds dives of all kinds. Both print an error
// and return nothing if a log cannot be read or is another vehicle's.
bool read_into(std::vector<MotionRecord>& records, const std::vector<std::string>& logs,
               std::optional<SourceText>& vehicle, std::vector<std::string>& left_out,
               ProgressLine& line) {
  for (const std::string& log : logs) {
    line.show("reading " + log);
    tl::expected<RecordedMotion, NoMotion> read = read_motion(log);
    if (!read && read.error().is_read) {
      note("left out: " + read.error().message);
      left_out.push_back(std::move(read.error().message));
      continue;
    }
    if (!read) {
      complain(read.error().message);
      return false;
    }
    if (!vehicle) vehicle = read->vehicle;
    if (vehicle::without_motion(read->vehicle) != vehicle::without_motion(*vehicle)) {
      complain(
          fmt::format("{}: the dive of another vehicle than the first log's (their "
                      "descriptions differ): fit the dives of one vehicle at a time",
                      log));
      return false;
    }
    records.push_back(std::move(read->motion));
  }
  return true;
}

/// Prints an error if not.
bool can_be_checked(std::size_t fitted, std::size_t held_out) {
  if (fitted >= 2 || (fitted == 1 && held_out > 0)) return true;
  complain(fitted == 0
               ? "there is no dive to fit to: give logs of dives with fixes"
               : "a fit to one dive cannot be checked: give more logs, or others with --validate");
  return false;
}

std::optional<Dives> read_dives(const FitArguments& arguments) {
  ProgressLine line;
  Dives dives;
  std::optional<SourceText> vehicle;
  std::vector<std::string>& left_out = dives.left_out;
  if (!read_into(dives.fitted, arguments.logs, vehicle, left_out, line)) return std::nullopt;
  if (!read_into(dives.held_out, arguments.validate, vehicle, left_out, line)) return std::nullopt;
  if (!can_be_checked(dives.fitted.size(), dives.held_out.size())) return std::nullopt;
  dives.vehicle = std::move(*vehicle);
  return dives;
}

std::optional<MotionModel> model_before(const SourceText& urdf) {
  Diagnostics diagnostics;
  const std::optional<vehicle::Model> model = vehicle::parse_urdf(urdf, diagnostics);
  if (model) return model->motion;
  print_diagnostics(diagnostics);
  return std::nullopt;
}

tl::expected<FitReport, std::string> fit(const Dives& dives, const MotionModel& before) {
  ProgressLine line;
  SteadyClock clock;
  const Utime began = clock.now();
  return fit_dives(dives.fitted, dives.held_out, before, {},
                   [&](const std::string& step, double share) {
                     line.show(step + time_left(share, to_seconds(clock.now() - began)));
                   });
}

std::string in_unit(const char* unit) { return *unit == '\0' ? "" : fmt::format(" {}", unit); }

void print_coefficients(const FitReport& report) {
  const auto table = motion_coefficients();
  print(fmt::format("  {:<19} {:>9} {:>9}   {}", "", "before", "fitted", "one sigma"));
  for (std::size_t i = 0; i < report.fit.coefficients.size(); ++i) {
    const FittedCoefficient& c = report.fit.coefficients[i];
    const std::string value = fmt::format("{:<19} {:>9.4g}", table[i].name, c.before);
    print(c.is_constrained ? fmt::format("  {} {:>9.4g} {:>8.1g}{}  {}", value, c.value, c.sigma,
                                         in_unit(table[i].unit), table[i].meaning)
                           : fmt::format("  {}      kept: these dives do not constrain it; {}",
                                         value, table[i].meaning));
  }
}

void print_slip(const FitReport& report) {
  const char* const names[] = {"surge", "sway", "heave"};
  std::string line = "  slip (one sigma)";
  for (std::size_t axis = 0; axis < report.slip.size(); ++axis) {
    line += report.slip[axis] ? fmt::format("  {} {:.3f} m/s", names[axis], *report.slip[axis])
                              : fmt::format("  {} not measured", names[axis]);
  }
  print(line);
}

void print_errors(const FitReport& report) {
  print(report.leaves_one_out ? "  open-loop error on each dive, fitted to the others:"
                              : "  open-loop error on the dives held out:");
  for (const HorizonErrors& errors : report.errors) {
    print(fmt::format(
        "    after {:>2.0f} s  median {:.3f} -> {:.3f} m, p95 {:.3f} -> {:.3f} m "
        "({} motions between fixes)",
        errors.before.horizon_s, errors.before.quantile(0.5), errors.after.quantile(0.5),
        errors.before.quantile(0.95), errors.after.quantile(0.95), errors.after.errors_m.size()));
  }
}

void print_report(const FitReport& report, std::size_t dives) {
  print(
      fmt::format("{} dives, {} windows, {} iterations{}; residuals {:.2f} times the sigmas of "
                  "the fixes",
                  dives, report.fit.windows, report.fit.iterations,
                  report.fit.converged ? "" : " (NOT CONVERGED)", report.fit.residual));
  print_coefficients(report);
  print_slip(report);
  print_errors(report);
}

Json quantiles(const estimation::OpenLoopError& error) {
  if (error.errors_m.empty()) return {{"median_m", nullptr}, {"p95_m", nullptr}};
  return {{"median_m", error.quantile(0.5)}, {"p95_m", error.quantile(0.95)}};
}

Json to_json(const FitReport& report, std::size_t dives) {
  Json coefficients = Json::array();
  for (std::size_t i = 0; i < report.fit.coefficients.size(); ++i) {
    const FittedCoefficient& c = report.fit.coefficients[i];
    coefficients.push_back({{"name", motion_coefficients()[i].name},
                            {"unit", motion_coefficients()[i].unit},
                            {"before", c.before},
                            {"value", c.value},
                            {"sigma", c.is_constrained ? Json(c.sigma) : Json(nullptr)},
                            {"constrained", c.is_constrained}});
  }
  Json slip = Json::array();
  for (const std::optional<double>& axis : report.slip) slip.push_back(axis ? Json(*axis) : Json());
  Json errors = Json::array();
  for (const HorizonErrors& e : report.errors) {
    errors.push_back({{"horizon_s", e.before.horizon_s},
                      {"motions", e.after.errors_m.size()},
                      {"before", quantiles(e.before)},
                      {"after", quantiles(e.after)}});
  }
  return {{"dives", dives},
          {"windows", report.fit.windows},
          {"converged", report.fit.converged},
          {"better", report.is_better()},
          {"coefficients", std::move(coefficients)},
          {"slip", std::move(slip)},
          {"validation", report.leaves_one_out ? "leave_one_out" : "held_out"},
          {"errors", std::move(errors)}};
}

// Writes the description with the fitted model; returns the exit status.
int write_vehicle(Result& result, const SourceText& urdf, const FitReport& report) {
  std::vector<double> sigmas;
  for (const FittedCoefficient& c : report.fit.coefficients) sigmas.push_back(c.sigma);
  const std::optional<std::string> text = vehicle::with_motion(urdf, report.fit.model, sigmas);
  if (text) return write_result(result, *text);
  complain("the description in the first log ends without </robot>: nothing is written");
  return kExitUsage;
}

}  // namespace

int run_fit(const FitArguments& arguments) {
  if (!can_be_checked(arguments.logs.size(), arguments.validate.size())) return kExitUsage;
  const std::optional<Dives> dives = read_dives(arguments);
  if (!dives) return kExitUsage;
  const std::optional<MotionModel> before = model_before(dives->vehicle);
  if (!before) return kExitUsage;
  tl::expected<Result, int> file = open_result(arguments.output, arguments.force);
  if (!file) return file.error();
  const tl::expected<FitReport, std::string> report = fit(*dives, *before);
  if (!report) {
    complain(report.error());
    return kExitUsage;
  }
  const bool is_written = report->is_better() && *file;
  if (is_written) {
    const int status = write_vehicle(*file, dives->vehicle, *report);
    if (status != kExitSuccess) return status;
  }
  if (arguments.json) {
    Json json = to_json(*report, dives->fitted.size());
    json["left_out"] = dives->left_out;
    json["vehicle"] = is_written ? Json(arguments.output) : Json(nullptr);
    print_json(json);
  } else {
    print_report(*report, dives->fitted.size());
    if (is_written) print("  vehicle " + arguments.output);
  }
  if (report->is_better()) return kExitSuccess;
  complain(
      "the fitted model is no better on dives that it was not fitted to; the one before stays");
  return kExitFailed;
}

}  // namespace dive::mission
