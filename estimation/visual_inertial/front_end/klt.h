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

/// An image as Klt needs it, with its pyramid and gradients: made once, not in every call. They are
/// a quarter of the tracker's time.
class KltImage {
 public:
  /// For windows of `window_px` and up to `levels` of the pyramid above the image itself, 0 to 5.
  KltImage(int window_px, int levels);
  KltImage(KltImage&&) noexcept;
  KltImage& operator=(KltImage&&) noexcept;
  ~KltImage();

  /// Replaces the image; returns a library's exception as text, else empty.
  [[nodiscard]] std::string set(const GrayView& image);

 private:
  friend class Klt;
  struct Impl;
  std::unique_ptr<Impl> impl_;
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
  /// if not found. `levels`: of the pyramids, as many as the images have or fewer. Images of one
  /// size and of this window, as many guesses as points. An error is an exception of ViSP or
  /// OpenCV.
  [[nodiscard]] tl::expected<std::vector<std::optional<Eigen::Vector2f>>, std::string> follow(
      const KltImage& from, const KltImage& to, const std::vector<Eigen::Vector2f>& points,
      const std::vector<Eigen::Vector2f>& guesses, int levels);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dive::estimation
