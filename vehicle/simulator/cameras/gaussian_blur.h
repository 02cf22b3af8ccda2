#pragma once
// Defocus of an image.

#include <vector>

namespace dive::vehicle {

/// Blurs rows of floats by a Gaussian of standard deviation sigma (pixels, at most 8); pixels
/// beyond the border equal those at the border. Reuses its memory.
class GaussianBlur {
 public:
  GaussianBlur(int width, int height, double sigma);
  /// The result is valid until the next call.
  [[nodiscard]] const std::vector<float>& operator()(const std::vector<float>& image);

 private:
  int width_;
  int height_;
  int radius_;
  std::vector<float> weights_;  // from the centre outwards
  std::vector<float> row_;      // one row with its border
  std::vector<float> across_;
  std::vector<float> result_;
};

}  // namespace dive::vehicle
