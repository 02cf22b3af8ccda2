#include "mission/card/card_legs.h"

#include <algorithm>

#include "common/assert.h"

namespace dive::mission {
namespace {

CardLeg row_of(const CheckReport& report, std::size_t i) {
  const PlannedRouteLeg& leg = report.legs[i];
  CardLeg row;
  row.first = row.last = static_cast<int>(i) + 1;
  row.state = leg.state;
  row.from = row.to = leg.goal;
  row.length_m = leg.plan.length_m;
  for (const Pose& pose : leg.plan.waypoints) {
    row.max_depth_m = std::max(row.max_depth_m, -pose.p.z());
  }
  row.arrives_s = report.times.legs[i].arrives_s;
  row.clearance_m = leg.plan.clearance_m;
  row.margin_sigma = leg.margin.margin_sigma;
  row.exit = report.exit_path.legs[i];
  row.turn = report.budget.turning_points[i];
  return row;
}

void append(CardLeg& row, const CardLeg& next) {
  row.last = next.last;
  row.to = next.to;
  row.length_m += next.length_m;
  row.max_depth_m = std::max(row.max_depth_m, next.max_depth_m);
  row.arrives_s = next.arrives_s;
  row.clearance_m = std::min(row.clearance_m, next.clearance_m);
  row.margin_sigma = std::min(row.margin_sigma, next.margin_sigma);
  if (next.exit.longest_s > row.exit.longest_s) {
    row.exit.longest_s = next.exit.longest_s;
    row.exit.longest_m = next.exit.longest_m;
  }
  row.exit.has_open_water |= next.exit.has_open_water;
  row.exit.has_overhead |= next.exit.has_overhead;
  row.turn.latest_s = std::min(row.turn.latest_s, next.turn.latest_s);
  row.turn.least_charge = std::max(row.turn.least_charge, next.turn.least_charge);
}

// Joins each row with the one before where `belongs` says so, given the index of the row.
template <class Belongs>
std::vector<CardLeg> joined(const std::vector<CardLeg>& rows, const Belongs& belongs) {
  std::vector<CardLeg> result;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (i > 0 && belongs(i)) {
      append(result.back(), rows[i]);
    } else {
      result.push_back(rows[i]);
    }
  }
  return result;
}

}  // namespace

std::vector<CardLeg> card_legs(const CheckReport& report) {
  DIVE_DEMAND(report.exit_path.legs.size() == report.legs.size());
  std::vector<CardLeg> rows;
  for (std::size_t i = 0; i < report.legs.size(); ++i) rows.push_back(row_of(report, i));
  if (rows.size() <= kMaxLegRows) return rows;
  rows = joined(rows, [&](std::size_t i) { return rows[i].state == rows[i - 1].state; });
  const std::size_t each = (rows.size() + kMaxLegRows - 1) / kMaxLegRows;
  return joined(rows, [&](std::size_t i) { return i % each != 0; });
}

}  // namespace dive::mission
