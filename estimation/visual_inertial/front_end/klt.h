#pragma once
// ViSP's KLT tracker (vpKltOpencv: Lucas and Kanade's on an image pyramid, Bouguet 2000) as a
// function: positions in one image of the points of another. Its own success flag is no test: on
// two images of noise it finds nine of ten points.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <tl/expected.hpp>

namespace dive::estimation {

/// A view of a grey image owned by the caller; row by row from the top, without gaps.
struct GrayView {
  const std::uint8_t* pixels = nullptr;
  int width = 0;
  int height = 0;
};

class Klt {
 public:
  /// A window of `window_px` by `window_px`, a multiple of 8: others take nearly twice the time.
  /// Restricts OpenCV to one thread in this process: the other core belongs to control.
  explicit Klt(int window_px);
  Klt(Klt&&) noexcept;
  Klt& operator=(Klt&&) noexcept;
  ~Klt();

  /// For each of `points` (pixels of `from`) its position in `to`, searched from its guess; empty
  /// if not found. `levels`: of the pyramid above the image itself, 0 to 5. Images of one size, as
  /// many guesses as points. An error is an exception of ViSP or OpenCV.
  [[nodiscard]] tl::expected<std::vector<std::optional<Eigen::Vector2f>>, std::string> follow(
      const GrayView& from, const GrayView& to, const std::vector<Eigen::Vector2f>& points,
      const std::vector<Eigen::Vector2f>& guesses, int levels);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dive::estimation
