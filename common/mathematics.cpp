#include "common/mathematics.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

#include <Eigen/Dense>
#include <fmt/format.h>
#include <sleef.h>

#include "common/fnv.h"

namespace dive {
namespace {

// Debian's libraries for aarch64, FCL's among them, are compiled with fused multiply-add.
#if defined(__x86_64__)
constexpr const char* kArchitecture = "x86_64";
#elif defined(__aarch64__)
constexpr const char* kArchitecture = "aarch64";
#else
#error "Enter the architecture here: libraries compute differently on others"
#endif

class ResultHash {
 public:
  void add(double result) {
    const auto bits = std::bit_cast<std::array<std::uint8_t, sizeof(double)>>(result);
    hash_.add(std::span<const std::uint8_t>(bits));
  }
  void add(float result) { add(static_cast<double>(result)); }
  template <typename Derived>
  void add(const Eigen::MatrixBase<Derived>& results) {
    for (Eigen::Index i = 0; i < results.size(); ++i) add(results(i));
  }
  [[nodiscard]] std::uint64_t value() const { return hash_.value(); }

 private:
  Fnv1a64 hash_;
};

/// The `i`-th of a fixed series in (0, 1). Volatile: compilers compute functions of constants with
/// other mathematics.
template <typename Real>
Real sample(int i) {
  const volatile Real value = static_cast<Real>((i * 7919) % 4093 + 1) / Real{4099};
  return value;
}

// `Real` is double or float.
template <typename Real>
void add_functions(ResultHash& hash) {
  constexpr int kSamples = 32;
  for (int i = 0; i < kSamples; ++i) {
    const Real x = sample<Real>(i);
    const Real y = sample<Real>(i + kSamples) - Real{0.5};
    const Real angle = Real{9} * y;
    for (const Real result : {std::sin(angle),
                              std::cos(angle),
                              std::tan(angle),
                              std::asin(y),
                              std::acos(y),
                              std::atan(angle),
                              std::atan2(y, x - Real{0.5}),
                              std::sinh(y),
                              std::cosh(y),
                              std::tanh(y),
                              std::exp(angle),
                              std::exp2(angle),
                              std::expm1(y),
                              std::log(x),
                              std::log2(x),
                              std::log10(x),
                              std::log1p(y),
                              std::pow(x, angle),
                              std::hypot(x, y),
                              std::cbrt(x),
                              std::erf(y),
                              std::erfc(angle),
                              std::tgamma(x)}) {
      hash.add(result);
    }
  }
}

// Sums of products, which a fused multiply-add or another order of addition would change, of small
// matrices, of a product by blocks and of the solution of an equation. Of double only: Eigen's sums
// of float are in another order on aarch64, and the executive computes with double.
void add_arithmetic(ResultHash& hash) {
  constexpr int kRows = 24;
  const Eigen::MatrixXd A =
      Eigen::MatrixXd::NullaryExpr(kRows, kRows, [](Eigen::Index row, Eigen::Index column) {
        return sample<double>(static_cast<int>(kRows * row + column)) - 0.5;
      });
  const Eigen::Matrix3d B = A.topLeftCorner<3, 3>();
  const Eigen::Vector3d b = A.block<3, 1>(0, 3);
  const Eigen::Quaterniond q(A(0, 0), A(1, 1), A(2, 2), A(3, 3));
  hash.add(A(0, 1) * A(0, 2) + A(0, 3));
  hash.add(A.row(0).dot(A.row(1)));
  hash.add(A.sum());
  hash.add((B * b).eval());
  hash.add((B * B.transpose()).eval());
  hash.add((q.normalized() * b).eval());
  hash.add((q * q).coeffs());
  hash.add((A * A.transpose()).eval());
  hash.add((A * A.col(0)).eval());
  hash.add(Eigen::VectorXd(
      (A * A.transpose() + Eigen::MatrixXd::Identity(kRows, kRows)).ldlt().solve(A.col(1))));
}

std::string identify() {
  ResultHash hash;
  add_functions<double>(hash);
  add_functions<float>(hash);
  add_arithmetic(hash);
  return fmt::format("sleef-{}.{}.{}/{:016x}/{}", SLEEF_VERSION_MAJOR, SLEEF_VERSION_MINOR,
                     SLEEF_VERSION_PATCHLEVEL, hash.value(), kArchitecture);
}

}  // namespace

const std::string& mathematics() {
  static const std::string identifier = identify();
  return identifier;
}

}  // namespace dive
