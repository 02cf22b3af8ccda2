#include "common/planar_transform.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "common/random.h"

namespace dive {
namespace {

TEST(PlanarTransform, TurnsAboutTheVerticalAndThenShifts) {
  const PlanarTransform north{deg_to_rad(90.0), {10.0, 0.0}};
  const Pose pose{{2.0, 0.0, -3.0}, from_rpy(0.1, 0.2, 0.0)};
  const Pose turned = north * pose;
  EXPECT_NEAR((turned.p - Eigen::Vector3d(10.0, 2.0, -3.0)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((to_rpy(turned.q) - Eigen::Vector3d(0.1, 0.2, deg_to_rad(90.0))).norm(), 0.0, 1e-12);
}

RC_GTEST_PROP(PlanarTransform, IsUndoneByItsInverse, (std::uint32_t seed)) {
  Random random(seed, 1);
  const PlanarTransform transform{random.uniform(-4.0, 4.0),
                                  {random.uniform(-50.0, 50.0), random.uniform(-50.0, 50.0)}};
  const Pose pose{{random.uniform(-50.0, 50.0), random.uniform(-50.0, 50.0), -7.0},
                  from_rpy(random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), 2.0)};
  const Pose back = transform.inverse() * (transform * pose);
  RC_ASSERT((back.p - pose.p).norm() < 1e-12 * 1e2);
  RC_ASSERT(angle_between(back.q, pose.q) < 1e-7);
}

RC_GTEST_PROP(PlanarTransform, AProductIsOneAfterTheOther, (std::uint32_t seed)) {
  Random random(seed, 2);
  const auto draw = [&] {
    return PlanarTransform{random.uniform(-3.0, 3.0),
                           {random.uniform(-50.0, 50.0), random.uniform(-50.0, 50.0)}};
  };
  const PlanarTransform a = draw();
  const PlanarTransform b = draw();
  const Pose pose{{random.uniform(-50.0, 50.0), 1.0, -7.0}, from_rpy(0.1, -0.2, 2.0)};
  const Pose product = (a * b) * pose;
  const Pose steps = a * (b * pose);
  RC_ASSERT((product.p - steps.p).norm() < 1e-12 * 1e3);
  RC_ASSERT(angle_between(product.q, steps.q) < 1e-7);
  RC_ASSERT(((a * pose.p) - (a * pose).p).norm() < 1e-12 * 1e3);
}

}  // namespace
}  // namespace dive
