#include "test/estimation/visual_inertial/filter/covariance_law.h"

#include <cmath>

#include <Eigen/Cholesky>
#include <fmt/format.h>

#include "common/random.h"
#include "estimation/visual_inertial/filter/filter_state.h"

namespace dive::testing {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using estimation::Columns;
using estimation::FilterState;
using estimation::Matrix15d;

class Life {
 public:
  explicit Life(std::uint64_t seed) : random_(seed, 3), state_(options()) {
    Matrix15d P = Matrix15d::Zero();
    for (double& x : P.diagonal()) x = std::pow(10.0, random_.uniform(-6.0, 0.0));
    state_.begin(estimation::ImuState{}, P);
  }

  void update() {
    const double what = random_.uniform();
    if (what < 0.1) propagate();
    if (what > 0.9) swap_clone();
    if (what > 0.4 && what < 0.42) swap_landmark();
    correct();
  }

  [[nodiscard]] std::string problem() const {
    const MatrixXd P = state_.covariance();
    if (P != P.transpose()) return "it is not symmetric";
    if (P.llt().info() != Eigen::Success) return "it is not positive definite";
    return state_.is_finite() ? "" : "the state is not finite";
  }

 private:
  static estimation::VisualInertialOptions options() {
    estimation::VisualInertialOptions result;
    result.cameras.resize(1);
    result.max_clones = 4;
    result.max_landmarks = 2;
    return result;
  }

  [[nodiscard]] MatrixXd matrix(Eigen::Index rows, Eigen::Index columns, double scale) {
    MatrixXd result(rows, columns);
    for (double& x : result.reshaped()) x = scale * random_.normal();
    return result;
  }

  void propagate() {
    const double dt = std::pow(10.0, random_.uniform(-4.0, -1.0));
    const Matrix15d F = Matrix15d::Identity() + dt * matrix(15, 15, 0.3);
    const MatrixXd G = matrix(15, 6, std::sqrt(dt) * 1e-2);
    state_.propagate({state_.imu, F, G * G.transpose() + 1e-10 * dt * Matrix15d::Identity(),
                      matrix(9, 18, 0.3 * dt)});
    // Prior information on all states keeps the covariance bounded, as in any real filter.
    observe(MatrixXd::Identity(33, 33), {0, 33}, 1.0);
  }

  void swap_clone() {
    if (state_.clones().size() >= 4) state_.drop_clone(random_.bits() % state_.clones().size());
    state_.clone(++frame_, 0, matrix(3, 1, 0.5));
  }

  void swap_landmark() {
    if (state_.landmarks().size() >= 2) state_.drop_landmark(random_.bits() % 2);
    const auto columns = state_.view_columns();
    estimation::MapLandmark mark;
    mark.id = frame_;
    state_.add_landmark(mark, matrix(3, columns[0].size + columns[1].size, 0.3),
                        Eigen::Matrix3d(matrix(3, 3, 0.3)) + Eigen::Matrix3d::Identity(),
                        Eigen::Vector3d::Zero(), 1e-5);
  }

  void correct() {
    const auto rows = 1 + static_cast<Eigen::Index>(random_.bits() % 6);
    const double sigma = std::pow(10.0, random_.uniform(-4.0, 0.0));
    observe(matrix(rows, state_.size(), 1.0), {0, state_.size()}, sigma);
  }

  void observe(const MatrixXd& H, Columns columns, double sigma) {
    const std::array<Columns, 1> all{columns};
    state_.correct(all, H, VectorXd::Zero(H.rows()), VectorXd::Constant(H.rows(), sigma * sigma));
  }

  Random random_;
  FilterState state_;
  std::int64_t frame_ = 0;
};

}  // namespace

std::string break_covariance(std::uint64_t seed, std::int64_t updates) {
  constexpr std::int64_t kLife = 1000;
  for (std::int64_t done = 0; done < updates;) {
    Life life(seed + static_cast<std::uint64_t>(done));
    for (std::int64_t i = 0; i < kLife && done < updates; ++i, ++done) {
      life.update();
      if (const std::string problem = life.problem(); !problem.empty()) {
        return fmt::format("after update {} of seed {}: {}", done, seed, problem);
      }
    }
  }
  return {};
}

}  // namespace dive::testing
