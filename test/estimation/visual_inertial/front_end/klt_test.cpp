#include "estimation/visual_inertial/front_end/klt.h"

#include <cmath>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include "test/common/sanitizers.h"

namespace dive::estimation {
namespace {

/// During its lifetime the process can allocate only `bytes` more.
class LittleMemory {
 public:
  explicit LittleMemory(rlim_t more) {
    getrlimit(RLIMIT_AS, &before_);
    rlim_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    rlimit less = before_;
    less.rlim_cur = pages * static_cast<rlim_t>(sysconf(_SC_PAGESIZE)) + more;
    setrlimit(RLIMIT_AS, &less);
  }
  ~LittleMemory() { setrlimit(RLIMIT_AS, &before_); }
  LittleMemory(const LittleMemory&) = delete;
  LittleMemory& operator=(const LittleMemory&) = delete;

 private:
  rlimit before_{};
};

TEST(Klt, GivesNothingForNothing) {
  const std::vector<std::uint8_t> pixels(64 * 64, 100);
  Klt klt(16);
  KltImage image(16, 2);
  ASSERT_EQ(image.set({pixels.data(), 64, 64}), "");
  const auto found = klt.follow(image, image, {}, {}, 2);
  ASSERT_TRUE(found) << found.error();
  EXPECT_TRUE(found->empty());
}

// The memory for a large image's gradients is missing.
TEST(Klt, TurnsWhatTheLibraryThrowsIntoAnError) {
  DIVE_SKIP_UNDER_SANITIZERS("their allocator ends the process instead");
  constexpr int kSize = 8000;
  std::vector<std::uint8_t> pixels(kSize * kSize);
  for (std::size_t i = 0; i < 64 * 64; ++i) {
    const double x = static_cast<double>(i % 64);
    const double y = static_cast<double>(i / 64);
    pixels[i] = static_cast<std::uint8_t>(120.0 + 50.0 * (std::sin(0.4 * x) + std::cos(0.3 * y)));
  }
  const GrayView large{pixels.data(), kSize, kSize};
  const std::vector<Eigen::Vector2f> points{{40.0F, 40.0F}};
  KltImage image(16, 1);
  {
    const LittleMemory little(100 << 20);
    EXPECT_THAT(image.set(large), ::testing::HasSubstr("memory"));
  }
  ASSERT_EQ(image.set({pixels.data(), 64, 64}), "") << "works afterwards";
  Klt klt(16);
  const auto again = klt.follow(image, image, points, {{40.5F, 39.5F}}, 1);
  ASSERT_TRUE(again) << again.error();
  ASSERT_TRUE(again->front());
  EXPECT_LT((*again->front() - points.front()).norm(), 0.1F);
}

}  // namespace
}  // namespace dive::estimation
