#include "vehicle/simulator/cameras/tag_boards.h"

#include <cmath>
#include <memory>

#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>

#include "common/assert.h"

namespace dive::vehicle {
namespace {

constexpr double kOnTheWall = 0.02;  // m: a board this close to a wall is in front of it

// White outside, black inside, and in that the bits, the highest first; their coordinates count
// from the corner of the black square.
std::vector<std::uint8_t> modules_of(const apriltag_family_t& family, int id) {
  const int width = family.total_width;
  const int margin = (width - family.width_at_border) / 2;
  std::vector<std::uint8_t> whites(static_cast<std::size_t>(width * width), 1);
  const auto at = [&](int x, int y) -> std::uint8_t& {
    return whites[static_cast<std::size_t>((y + margin) * width + x + margin)];
  };
  for (int y = 0; y < family.width_at_border; ++y) {
    for (int x = 0; x < family.width_at_border; ++x) at(x, y) = 0;
  }
  for (std::uint32_t i = 0; i < family.nbits; ++i) {
    const bool is_white = (family.codes[id] >> (family.nbits - 1 - i) & 1U) != 0;
    if (is_white) at(static_cast<int>(family.bit_x[i]), static_cast<int>(family.bit_y[i])) = 1;
  }
  return whites;
}

}  // namespace

TagBoards::TagBoards(std::span<const Tag> tags) {
  if (tags.empty()) return;
  const std::unique_ptr<apriltag_family_t, void (*)(apriltag_family_t*)> family(tag36h11_create(),
                                                                                tag36h11_destroy);
  for (const Tag& tag : tags) {
    DIVE_DEMAND(tag.id >= 0 && tag.id < Tag::kCodes && tag.size_m > 0.0 && tag.X_WT.is_finite());
    Board board;
    board.X_TW = tag.X_WT.inverse();
    board.normal_W = tag.X_WT.q * -Eigen::Vector3d::UnitZ();
    board.modules = family->total_width;
    board.module_m = tag.size_m / family->width_at_border;
    board.whites = modules_of(*family, tag.id);
    boards_.push_back(std::move(board));
  }
}

std::optional<TagBoards::Met> TagBoards::meet(const Eigen::Vector3d& o, const Eigen::Vector3d& d,
                                              double reach) const {
  std::optional<Met> first;
  for (const Board& board : boards_) {
    const double along = board.normal_W.dot(d);
    if (along == 0.0) continue;
    const Eigen::Vector3d o_T = board.X_TW * o;
    const double distance = o_T.z() / along;  // z points into the print, the normal out of it
    if (!(distance > 0.0 && distance < reach + kOnTheWall)) continue;
    if (first && distance >= first->distance) continue;
    const Eigen::Vector3d p_T = o_T + distance * (board.X_TW.q * d);
    const double half = 0.5 * board.modules;
    const int x = static_cast<int>(std::floor(p_T.x() / board.module_m + half));
    const int y = static_cast<int>(std::floor(p_T.y() / board.module_m + half));
    if (x < 0 || y < 0 || x >= board.modules || y >= board.modules) continue;
    const bool is_front = along < 0.0;
    const bool is_white =
        !is_front || board.whites[static_cast<std::size_t>(y * board.modules + x)] != 0;
    first = Met{distance, is_front ? board.normal_W : Eigen::Vector3d(-board.normal_W), is_white};
  }
  return first;
}

}  // namespace dive::vehicle
