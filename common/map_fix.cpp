#include "common/map_fix.h"

#include <cmath>

namespace dive {

bool is_well_formed(const MapFix& fix) {
  const bool is_listed = fix.problem >= MapFixProblem::kNone && fix.problem <= kLastMapFixProblem;
  return is_listed && fix.position_W.allFinite() && std::isfinite(fix.heading_correction) &&
         fix.information.allFinite() && fix.gradient.allFinite() && std::isfinite(fix.height_W) &&
         fix.height_sigma_m >= 0.0 && std::isfinite(fix.height_sigma_m) &&
         fix.information.diagonal().minCoeff() >= 0.0 &&
         (fix.information - fix.information.transpose()).isZero(1e-9) && fix.used >= 0 &&
         fix.gated >= 0 && std::isfinite(fix.ambiguity) && fix.agreement.confirmed >= 0 &&
         fix.agreement.missing >= 0 && fix.agreement.unmapped >= 0 &&
         fix.agreement.missing_object >= -1;
}

}  // namespace dive
