#pragma once
// What a vehicle that goes by sight says over the link, put in order: inertial samples in a row,
// pictures in pairs. Bounded, whatever comes.
//
// Cameras and inertial unit go by one clock, for the filter between them is only as good as what
// they agree on: the inertial unit says when it has been set.

#include <array>
#include <cstdint>
#include <deque>
#include <limits>
#include <optional>
#include <vector>

#include "common/clock.h"
#include "common/measurements.h"
#include "vehicle/link/codec.h"
#include "vehicle/link/sample_clock.h"

namespace dive::mission {

/// What has become of it.
struct SightStats {
  std::int64_t pairs = 0;             ///< Of pictures, handed on.
  std::int64_t alone = 0;             ///< Left pictures, handed on without a right one.
  std::int64_t pictures_dropped = 0;  ///< Late, twice, without a left one, or too many.
  std::int64_t inertial = 0;          ///< Samples, handed on.
  std::int64_t inertial_dropped = 0;  ///< Late, twice, or too many.
};

struct StereoPair {
  std::optional<ImageFrame> left;
  std::optional<ImageFrame> right;
};

class SightInbox {
 public:
  static constexpr Utime kTogether = 1000;         ///< us between the stamps of a pair, at most.
  static constexpr Utime kPatience = 60'000;       ///< us that a left picture waits for its right.
  static constexpr std::size_t kMostPictures = 2;  ///< Of a camera, that wait.
  static constexpr std::size_t kMostInertial = 256;  ///< Likewise.

  /// `arrived`: on our clock, which the stamps are put on; absent in lock-step, where they are
  /// ours.
  void hear(ImuSample sample, std::optional<Utime> arrived);
  /// Nobody looks through cameras other than the front ones.
  void hear(ImageFrame frame, std::optional<Utime> arrived);

  /// Oldest first, and each once.
  [[nodiscard]] std::vector<ImuSample> take_inertial();
  /// The oldest left picture with the right one of its moment, or alone when that will not come.
  [[nodiscard]] StereoPair take_pair(Utime now);

  /// In lock-step: has all come that belongs to that tick?
  [[nodiscard]] bool has(const link::SimTick& tick) const;
  /// Its pictures.
  [[nodiscard]] StereoPair take_pair(const link::SimTick& tick);

  [[nodiscard]] const SightStats& stats() const { return stats_; }
  /// Of the clock.
  [[nodiscard]] int clock_jumps() const { return clock_.jumps(); }

 private:
  struct Picture {
    Utime utime = 0;
    Utime arrived = 0;
    ImageFrame frame;
  };

  void drop_pictures(std::deque<Picture>& row, Utime until);

  link::SampleClock clock_;
  std::deque<ImuSample> inertial_;                           ///< By their stamps ...
  std::array<std::deque<Picture>, 2> pictures_;              ///< ... and so are these, by camera.
  Utime last_inertial_ = std::numeric_limits<Utime>::min();  ///< That was taken ...
  Utime last_left_ = std::numeric_limits<Utime>::min();      ///< ... and so was this.
  SightStats stats_;
};

}  // namespace dive::mission
