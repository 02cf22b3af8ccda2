#include "mission/record/journal_bank.h"

#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "common/fnv.h"

namespace dive::mission {
namespace {

using behaviors::Trail;
using nlohmann::json;

constexpr std::size_t kChecksumSize = 16;
constexpr int kVersion = 3;

std::string checksum(std::int64_t generation, std::int64_t line, std::string_view text) {
  Fnv1a64 digest;
  digest.add(std::string_view(fmt::format("{} {} ", generation, line)));
  digest.add(text);
  return fmt::format("{:016x}", digest.value());
}

std::string dumped(const json& value) {
  return value.dump(-1, ' ', false, json::error_handler_t::replace);
}

Eigen::Vector3d vector_from(const json& j) {
  return {j.at(0).get<double>(), j.at(1).get<double>(), j.at(2).get<double>()};
}

json to_json(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

estimation::ImuBias bias_from(const json& j) {
  return {j.at("utime").get<Utime>(), vector_from(j.at("gyro")), vector_from(j.at("accel")),
          j.at("gyro_sigma").get<double>(), j.at("accel_sigma").get<double>()};
}

/// Throws nlohmann's exceptions if a value is missing or has another type.
Checkpoint checkpoint_from(const json& j) {
  Checkpoint c;
  j.at("utime").get_to(c.utime);
  j.at("elapsed").get_to(c.elapsed_s);
  j.at("active").get_to(c.active);
  j.at("active_for").get_to(c.active_s);
  j.at("history").get_to(c.history);
  j.at("once").get_to(c.done_once);
  const json& q = j.at("q");
  c.X_WB.p = vector_from(j.at("p"));
  c.X_WB.q = {q.at(3).get<double>(), q.at(0).get<double>(), q.at(1).get<double>(),
              q.at(2).get<double>()};
  c.v_W = vector_from(j.at("v"));
  j.at("sigma").get_to(c.sigma_m);
  j.at("open_water_battery").get_to(c.open_water_battery);
  j.at("goals_done").get_to(c.goals_done);
  const std::string rung = j.at("rung").get<std::string>();
  c.rung = behaviors::find_rung(rung).value_or(behaviors::Rung::kNone);
  c.rung_cause = behaviors::find_failsafe(j.at("rung_cause").get<std::string>())
                     .value_or(behaviors::FailsafeKind::kInternalError);
  j.at("abort_cause").get_to(c.abort_cause);
  j.at("paused").get_to(c.paused);
  j.at("queries").get_to(c.queries);
  if (j.contains("open_water_elapsed"))
    c.open_water_elapsed_s = j.at("open_water_elapsed").get<double>();
  if (j.contains("imu_bias")) c.imu_bias = bias_from(j.at("imu_bias"));
  return c;
}

Trail::Breadcrumb breadcrumb_from(const json& c) {
  return {{c.at(0).get<double>(), c.at(1).get<double>(), c.at(2).get<double>()},
          c.at(3).get<bool>()};
}

/// Reads the lines of a bank one by one.
class BankReader {
 public:
  explicit BankReader(std::string_view text) : text_(text) {}

  /// The JSON of the next line; empty if that is torn, damaged or from another text.
  std::optional<json> next() {
    const std::size_t end = text_.find('\n', at_);
    if (end == std::string_view::npos || end < at_ + kChecksumSize + 2) return std::nullopt;
    const std::string_view whole = text_.substr(at_, end - at_);
    if (whole[kChecksumSize] != ' ') return std::nullopt;
    const std::string_view content = whole.substr(kChecksumSize + 1);
    json value = json::parse(content, nullptr, false);
    if (value.is_discarded() || !value.is_object()) return std::nullopt;
    if (lines_ == 0) generation_ = value.value("generation", std::int64_t{0});
    if (checksum(generation_, lines_, content) != whole.substr(0, kChecksumSize)) {
      return std::nullopt;
    }
    ++lines_;
    at_ = end + 1;
    return value;
  }
  [[nodiscard]] std::int64_t generation() const { return generation_; }

 private:
  std::string_view text_;
  std::size_t at_ = 0;
  std::int64_t lines_ = 0;
  std::int64_t generation_ = 0;
};

/// Throws nlohmann's exceptions if a value is missing or has another type. False: not whole.
bool read_snapshot(BankReader& reader, Journal& journal, Trail& trail) {
  const std::optional<json> first = reader.next();
  if (!first || first->at("dive_journal").get<int>() != kVersion) return false;
  first->at("digest").get_to(journal.header.digest);
  first->at("seed").get_to(journal.header.seed);
  first->at("commits").get_to(journal.commits);
  std::vector<Trail::Breadcrumb> breadcrumbs;
  for (auto left = first->at("breadcrumbs").get<std::int64_t>(); left > 0; --left) {
    const std::optional<json> value = reader.next();
    if (!value || !value->contains("breadcrumb")) return false;
    breadcrumbs.push_back(breadcrumb_from(value->at("breadcrumb")));
  }
  const double spacing = first->at("spacing").get<double>();
  if (spacing <= 0.0 || breadcrumbs.size() > behaviors::kTrailCapacity) return false;
  trail.restore(breadcrumbs, spacing);
  if (!first->at("checkpoint").get<bool>()) return true;
  const std::optional<json> value = reader.next();
  if (!value) return false;
  journal.checkpoint = checkpoint_from(*value);
  return true;
}

}  // namespace

std::string to_json_text(const Checkpoint& c) {
  json history = json::object();
  for (const auto& [id, states] : c.history) history[id] = states;
  json result = {{"utime", c.utime},
                 {"elapsed", c.elapsed_s},
                 {"active", c.active},
                 {"active_for", c.active_s},
                 {"history", std::move(history)},
                 {"once", c.done_once},
                 {"p", to_json(c.X_WB.p)},
                 {"q", {c.X_WB.q.x(), c.X_WB.q.y(), c.X_WB.q.z(), c.X_WB.q.w()}},
                 {"v", to_json(c.v_W)},
                 {"sigma", c.sigma_m},
                 {"open_water_battery", c.open_water_battery},
                 {"goals_done", c.goals_done},
                 {"rung", behaviors::to_string(c.rung)},
                 {"rung_cause", std::string(behaviors::to_string(c.rung_cause))},
                 {"abort_cause", c.abort_cause},
                 {"paused", c.paused},
                 {"queries", c.queries}};
  if (c.open_water_elapsed_s) result["open_water_elapsed"] = *c.open_water_elapsed_s;
  if (c.imu_bias) {
    result["imu_bias"] = {{"utime", c.imu_bias->utime},
                          {"gyro", to_json(c.imu_bias->gyro_B)},
                          {"accel", to_json(c.imu_bias->accel_B)},
                          {"gyro_sigma", c.imu_bias->gyro_sigma},
                          {"accel_sigma", c.imu_bias->accel_sigma}};
  }
  return dumped(result);
}

std::string BankText::line(std::string_view json) {
  return fmt::format("{} {}\n", checksum(generation_, lines_++, json), json);
}

std::string BankText::breadcrumb(const Trail::Breadcrumb& breadcrumb) {
  const auto& [p_W, open_above, utime] = breadcrumb;
  static_cast<void>(utime);  // of no use after a restart: nothing moves what was before it
  return line(dumped({{"breadcrumb", {p_W.x(), p_W.y(), p_W.z(), open_above}}}));
}

std::string BankText::snapshot(const JournalState& state) {
  std::string text = line(dumped({{"dive_journal", kVersion},
                                  {"generation", generation_},
                                  {"digest", state.header.digest},
                                  {"seed", state.header.seed},
                                  {"commits", state.commits},
                                  {"spacing", state.trail.spacing()},
                                  {"breadcrumbs", state.trail.size()},
                                  {"checkpoint", !state.checkpoint.empty()}}));
  for (const Trail::Breadcrumb& each : state.trail.breadcrumbs()) text += breadcrumb(each);
  if (!state.checkpoint.empty()) text += commit(state.checkpoint);
  return text;
}

std::optional<Journal> parse_bank(std::string_view text) {
  BankReader reader(text);
  Journal journal;
  Trail trail;
  try {
    if (!read_snapshot(reader, journal, trail)) return std::nullopt;
  } catch (const json::exception&) {
    return std::nullopt;  // from another version or program
  }
  while (const std::optional<json> value = reader.next()) {
    try {
      if (value->contains("breadcrumb")) {
        const Trail::Breadcrumb breadcrumb = breadcrumb_from(value->at("breadcrumb"));
        trail.add(breadcrumb.p_W, breadcrumb.open_above);
      } else {
        journal.checkpoint = checkpoint_from(*value);
        ++journal.commits;
      }
    } catch (const json::exception&) {
      break;
    }
  }
  journal.generation = reader.generation();
  journal.trail = trail.breadcrumbs();
  journal.trail_spacing_m = trail.spacing();
  return journal;
}

}  // namespace dive::mission
