#include "estimation/dataset/gray_jpeg.h"

#include <csetjmp>
#include <cstddef>
#include <cstdio>
#include <cstring>

#include <jerror.h>  // after jpeglib.h, on whose version it depends
#include <jpeglib.h>

#include "estimation/dataset/image_side.h"

namespace dive::estimation {
namespace {

// What libjpeg's calls and its error handler share. It may be left by longjmp, so that nothing in
// it may need a destructor.
struct Decoder {
  jpeg_error_mgr errors;
  jpeg_decompress_struct jpeg;
  std::jmp_buf on_error;
  char message[JMSG_LENGTH_MAX];
};

void stop(j_common_ptr jpeg) {
  auto* const decoder = static_cast<Decoder*>(jpeg->client_data);
  jpeg->err->format_message(jpeg, decoder->message);
  std::longjmp(decoder->on_error, 1);
}

// A warning means that pixels are missing, which libjpeg would fill with grey; except of bytes
// before a marker, which are skipped: cameras with MJPEG pad there.
void stop_at_warning(j_common_ptr jpeg, int level) {
  if (level < 0 && jpeg->err->msg_code != JWRN_EXTRANEOUS_DATA) stop(jpeg);
}

// False on an error.
bool begin(Decoder& decoder, std::span<const std::uint8_t> data) {
  if (setjmp(decoder.on_error) != 0) return false;
  jpeg_create_decompress(&decoder.jpeg);
  jpeg_mem_src(&decoder.jpeg, data.data(), data.size());
  jpeg_read_header(&decoder.jpeg, TRUE);
  decoder.jpeg.out_color_space = JCS_GRAYSCALE;
  jpeg_calc_output_dimensions(&decoder.jpeg);
  return true;
}

bool finish(Decoder& decoder, std::uint8_t* pixels) {
  if (setjmp(decoder.on_error) != 0) return false;
  jpeg_start_decompress(&decoder.jpeg);
  while (decoder.jpeg.output_scanline < decoder.jpeg.output_height) {
    JSAMPROW row =
        pixels + static_cast<std::size_t>(decoder.jpeg.output_scanline) * decoder.jpeg.output_width;
    jpeg_read_scanlines(&decoder.jpeg, &row, 1);
  }
  jpeg_finish_decompress(&decoder.jpeg);
  return true;
}

}  // namespace

tl::expected<ImageFrame, std::string> decode_gray_jpeg(std::span<const std::uint8_t> data) {
  Decoder decoder;
  std::memset(&decoder, 0, sizeof decoder);
  decoder.jpeg.err = jpeg_std_error(&decoder.errors);
  decoder.errors.error_exit = stop;
  decoder.errors.emit_message = stop_at_warning;
  decoder.jpeg.client_data = &decoder;
  const auto fail = [&](const std::string& what) {
    jpeg_destroy_decompress(&decoder.jpeg);
    return tl::make_unexpected("damaged JPEG data: " + what);
  };
  if (!begin(decoder, data)) return fail(decoder.message);
  const auto& jpeg = decoder.jpeg;
  if (jpeg.output_width > kMaxSide_px || jpeg.output_height > kMaxSide_px) {
    return fail("the image is too large");
  }
  ImageFrame frame;
  frame.width = static_cast<int>(jpeg.output_width);
  frame.height = static_cast<int>(jpeg.output_height);
  frame.pixels.resize(static_cast<std::size_t>(jpeg.output_width) * jpeg.output_height);
  if (!finish(decoder, frame.pixels.data())) return fail(decoder.message);
  jpeg_destroy_decompress(&decoder.jpeg);
  return frame;
}

}  // namespace dive::estimation
