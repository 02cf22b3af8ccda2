#pragma once
// ViSP's KLT tracker (vpKltOpencv: Lucas and Kanade's on an image pyramid, Bouguet 2000) as a
// function: where the points of one picture are in another. Its own word on a point is no test: on
// two pictures of noise it finds nine out of ten.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <tl/expected.hpp>

namespace dive::estimation {

/// A grey picture that somebody else keeps; row by row from the top, without gaps.
struct GrayView {
  const std::uint8_t* pixels = nullptr;
  int width = 0;
  int height = 0;
};

class Klt {
 public:
  /// A window of `window_px` by `window_px`, a multiple of 8: others take nearly twice the time.
  /// OpenCV is told to use one thread in this process: the other core is the control's.
  explicit Klt(int window_px);
  Klt(Klt&&) noexcept;
  Klt& operator=(Klt&&) noexcept;
  ~Klt();

  /// For each of `points` (pixels of `from`) its place in `to`, sought from its guess on; nothing
  /// where it was not found. `levels`: of the pyramid above the picture itself, 0 to 5. Pictures of
  /// one size, as many guesses as points. An error is what ViSP or OpenCV threw.
  [[nodiscard]] tl::expected<std::vector<std::optional<Eigen::Vector2f>>, std::string> follow(
      const GrayView& from, const GrayView& to, const std::vector<Eigen::Vector2f>& points,
      const std::vector<Eigen::Vector2f>& guesses, int levels);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dive::estimation
