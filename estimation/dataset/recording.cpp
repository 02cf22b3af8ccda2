#include "estimation/dataset/recording.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "estimation/dataset/gray_png.h"

namespace dive::estimation {

Diagnostic SampleOrigin::at(std::size_t index, Severity severity, std::string code,
                            std::string message, std::string hint) const {
  Diagnostic diagnostic = of_all(severity, std::move(code), std::move(message), std::move(hint));
  if (index < lines.size()) diagnostic.span.line = static_cast<int>(lines[index]);
  return diagnostic;
}

Diagnostic SampleOrigin::of_all(Severity severity, std::string code, std::string message,
                                std::string hint) const {
  Diagnostic diagnostic;
  diagnostic.code = std::move(code);
  diagnostic.severity = severity;
  diagnostic.file = file;
  diagnostic.message = std::move(message);
  diagnostic.hint = std::move(hint);
  return diagnostic;
}

tl::expected<ImageFrame, std::string> read_image(const RecordedImage& image, int camera) {
  auto frame = image.read ? image.read() : read_gray_png(image.path);
  if (!frame && image.read) {
    return tl::make_unexpected(fmt::format("{}: {}", image.path, frame.error()));
  }
  if (!frame) return frame;
  frame->utime = image.utime;
  frame->camera = camera;
  return frame;
}

const RecordedImage* image_at(const std::vector<RecordedImage>& images, Utime utime) {
  constexpr Utime kTogether = 1000;  // us
  const auto it =
      std::lower_bound(images.begin(), images.end(), utime - kTogether,
                       [](const RecordedImage& image, Utime t) { return image.utime < t; });
  if (it == images.end() || it->utime > utime + kTogether) return nullptr;
  return &*it;
}

}  // namespace dive::estimation
