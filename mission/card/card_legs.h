#pragma once
// The legs of a checked mission as rows of a dive card.

#include <string>
#include <vector>

#include "mission/check/check.h"

namespace dive::mission {

/// Rows of a card that are legs.
inline constexpr std::size_t kMaxLegRows = 10;

/// One leg, or consecutive ones with the values of the worst of them.
struct CardLeg {
  int first = 1;  ///< Numbers of the legs in the route, from 1.
  int last = 1;
  std::string state;  ///< State of the first leg.
  std::string from;   ///< Goals of the first and of the last leg.
  std::string to;
  double length_m = 0.0;
  double max_depth_m = 0.0;
  double arrives_s = 0.0;
  double clearance_m = 0.0;   ///< Certified, m.
  double margin_sigma = 0.0;  ///< Infinite: nothing is near, or it cannot be predicted.
  LegExit exit;
  TurningPoint turn;
};

/// The legs in their order, as at most kMaxLegRows rows. If there are more legs, consecutive ones
/// of one state are one row; if these are still too many, equally many neighbours are one row.
[[nodiscard]] std::vector<CardLeg> card_legs(const CheckReport& report);

}  // namespace dive::mission
