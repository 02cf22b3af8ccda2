#include "behaviors/plan_client.h"

#include <utility>

#include <fmt/format.h>

namespace dive::behaviors {

void PlanClient::ask(Utime now) {
  is_pending_ = true;
  asked_at_ = now;
}

PlanClient::Event PlanClient::update(const BehaviorInput& input) {
  if (!is_pending_) return Event::kNone;
  if (const planning::PlanResult* plan = input.plan) {
    if (!plan->accepted || plan->waypoints.size() < 2) return fail(plan->reason);
    is_pending_ = false;
    reason_.clear();
    return Event::kPath;
  }
  if (to_seconds(input.now - asked_at_) <= kPlanTimeout) return Event::kNone;
  return fail(fmt::format("the planner did not answer within {:g} s", kPlanTimeout));
}

PlanClient::Event PlanClient::fail(std::string reason) {
  is_pending_ = false;
  reason_ = std::move(reason);
  return Event::kFailed;
}

}  // namespace dive::behaviors
