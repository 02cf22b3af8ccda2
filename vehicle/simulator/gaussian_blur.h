#pragma once
// A picture out of focus.

#include <vector>

namespace dive::vehicle {

/// Blurs rows of floats by a Gaussian of standard deviation sigma (pixels, at most 8); beyond its
/// border the picture goes on as at the border. Keeps its memory.
class GaussianBlur {
 public:
  GaussianBlur(int width, int height, double sigma);
  /// The result stays until the next call.
  [[nodiscard]] const std::vector<float>& operator()(const std::vector<float>& picture);

 private:
  int width_;
  int height_;
  int radius_;
  std::vector<float> weights_;  // from the middle outwards
  std::vector<float> row_;      // with its border
  std::vector<float> across_;
  std::vector<float> result_;
};

}  // namespace dive::vehicle
