#include "estimation/dataset/recording.h"

#include "estimation/dataset/gray_png.h"

namespace dive::estimation {

tl::expected<ImageFrame, std::string> read_image(const RecordedImage& image, int camera) {
  auto frame = read_gray_png(image.path);
  if (!frame) return frame;
  frame->utime = image.utime;
  frame->camera = camera;
  return frame;
}

}  // namespace dive::estimation
