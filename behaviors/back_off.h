#pragma once
// In unknown water: back to where there was room. A plan lets a vehicle out of a tight start with
// no more clearance than the start has, and only so far. One that is planned for again and again
// on the way uses that up each time: it works its way into a narrowing, a little nearer to things
// with every plan, until it cannot turn. So whoever has come too near, or has been near for too
// long, goes back along its trail, which is free, and plans from there with what it has seen since.
//
// Turning about is what there is no room for: it goes back stern first, as long as its nose points
// more away from the way than along it. The course is a line of sight to the point of the way
// `kLookahead` ahead (Fossen 2011, ch. 12.3), with the stern in place of the bow.

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "behaviors/behavior.h"
#include "behaviors/trail.h"

namespace dive::behaviors {

class BackOff {
 public:
  explicit BackOff(double clearance) : clearance_(clearance) {}

  /// One tick, before any other use. True when the vehicle should go back; whether it can is
  /// begin()'s word. Looks when the map has changed.
  [[nodiscard]] bool is_needed(const BehaviorInput& input);
  /// Which places will do.
  struct Asked {
    double least_m = 0.0;  ///< Away from here ...
    double most_m = 8.0;   ///< ... and no farther along the trail.
    bool open = false;     ///< With open water above.
  };
  /// Along BehaviorInput::trail to the nearest place that has room and is asked for, or if there is
  /// none, the one that has most. False when none has more than here, or the way there is blocked.
  [[nodiscard]] bool begin(const BehaviorInput& input, const Asked& asked);
  /// One tick on the way back; nothing once it has come to an end. Speeds below 0 are astern.
  [[nodiscard]] std::optional<vehicle::Command> follow(const BehaviorInput& input);

  [[nodiscard]] bool is_under_way() const { return !way_.empty(); }
  /// m; where the vehicle was when it was last looked.
  [[nodiscard]] double room_m() const { return room_m_; }
  /// How often in a row it went back from about there.
  [[nodiscard]] int count_at(const Eigen::Vector3d& p_W) const;

 private:
  [[nodiscard]] Trail::Way way_back(const BehaviorInput& input, const Asked& asked) const;
  [[nodiscard]] Pose pose_at(const Eigen::Vector3d& p_W, const Eigen::Vector3d& way) const;
  [[nodiscard]] double clearance_of_rest(const BehaviorInput& input) const;
  [[nodiscard]] Eigen::Vector3d point_ahead(const Eigen::Vector3d& p_W);

  double clearance_;
  std::vector<Eigen::Vector3d> way_;  ///< Empty: it is not on its way back.
  std::size_t next_ = 0;              ///< The point of it that is headed for.
  bool astern_ = false;
  double room_m_ = 0.0;
  double tight_m_ = 0.0;  ///< Swum since there was room.
  std::optional<Eigen::Vector3d> last_W_;
  std::optional<Eigen::Vector3d> last_place_W_;  ///< That it went back from.
  std::optional<Utime> tried_at_;
  Utime until_ = 0;
  int count_ = 0;
};

}  // namespace dive::behaviors
