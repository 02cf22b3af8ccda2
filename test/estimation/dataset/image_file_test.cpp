// Images as data sets contain them. PNG files are written by libpng's functions for each chunk.

#include <algorithm>
#include <cstdio>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>

#include "estimation/dataset/gray_jpeg.h"
#include "estimation/dataset/gray_png.h"
#include "test/estimation/dataset/asl_folder.h"
#include "test/estimation/dataset/jpeg_writer.h"

namespace dive::estimation {
namespace {

/// One row of pixels, `depth` bits a channel, with no statement of the brightness's scale.
std::string write_row(int depth, int colour_type, int width, std::string bytes) {
  const std::string path = testing::fresh_folder() + "/row.png";
  std::FILE* const file = std::fopen(path.c_str(), "wb");
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_init_io(png, file);
  png_set_IHDR(png, info, static_cast<png_uint_32>(width), 1, depth, colour_type,
               PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_write_info(png, info);
  png_write_row(png, reinterpret_cast<png_bytep>(bytes.data()));
  png_write_end(png, nullptr);
  png_destroy_write_struct(&png, &info);
  std::fclose(file);
  return path;
}

TEST(ImageFile, KeepsTheUpperEightOf16Bits) {
  std::string wide;
  for (const char upper : {'\x00', '\x01', '\x04', '\x10', '\x20', '\x40', '\x80', '\xFF'}) {
    wide += std::string{upper, '\x00'};
  }
  const auto frame = read_gray_png(write_row(16, PNG_COLOR_TYPE_GRAY, 8, wide));
  ASSERT_TRUE(frame) << frame.error();
  const int expected[] = {0x00, 0x01, 0x04, 0x10, 0x20, 0x40, 0x80, 0xFF};
  for (std::size_t i = 0; i < 8; ++i) EXPECT_NEAR(frame->pixels[i], expected[i], 1) << i;
}

// As from a bag, and as in a JPEG.
TEST(ImageFile, TurnsColoursToTheirLuma) {
  const auto frame = read_gray_png(write_row(8, PNG_COLOR_TYPE_RGB, 2, "\x0A\xC8\x1E\x80\x80\x80"));
  ASSERT_TRUE(frame) << frame.error();
  ASSERT_EQ(frame->pixels.size(), 2U);
  EXPECT_EQ(frame->pixels[0], 124);  // 0.299 * 10 + 0.587 * 200 + 0.114 * 30
  EXPECT_EQ(frame->pixels[1], 128);
}

/// Rows of 64 pixels with a marker after each 8.
std::vector<std::uint8_t> jpeg_with_markers() {
  ImageFrame frame;
  frame.width = 64;
  frame.height = 16;
  for (int i = 0; i < 64 * 16; ++i) frame.pixels.push_back(static_cast<std::uint8_t>(4 * (i % 64)));
  const std::string data = testing::jpeg_of(frame, 1);
  return {data.begin(), data.end()};
}

// Cameras with MJPEG pad before markers; nothing is lost by it.
TEST(ImageFile, ReadsJpegsWithPaddingAndRefusesThoseThatLackPixels) {
  const std::vector<std::uint8_t> intact = jpeg_with_markers();
  const auto expected = decode_gray_jpeg(intact);
  ASSERT_TRUE(expected) << expected.error();
  constexpr std::uint8_t kMarker[] = {0xFF, 0xD0};
  const auto marker = std::search(intact.begin(), intact.end(), kMarker, kMarker + 2);
  ASSERT_NE(marker, intact.end());
  std::vector<std::uint8_t> padded = intact;
  padded.insert(padded.begin() + (marker - intact.begin()), 0x55);
  const auto read = decode_gray_jpeg(padded);
  ASSERT_TRUE(read) << read.error();
  EXPECT_EQ(read->pixels, expected->pixels);

  std::vector<std::uint8_t> torn = intact;
  torn.erase(torn.begin() + (marker - intact.begin()),
             torn.begin() + (marker - intact.begin()) + 2);
  EXPECT_FALSE(decode_gray_jpeg(torn));
}

}  // namespace
}  // namespace dive::estimation
