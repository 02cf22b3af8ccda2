#pragma once
// The layouts of the log's packets; those of samples, command, rates and truth are the link's. Only
// for the codec's .cpp files.

#include <cstddef>

#include "mission/record/log_codec.h"
#include "vehicle/link/packet_detail.h"

namespace dive::mission::layout {

using link::array;
using link::bytes;
using link::Run;
using link::text;
using link::detail::kPoseSize;

inline constexpr Run kHeader[] = {
    bytes(8 + sizeof(double)), text(kMaxText),     text(kMaxText),     text(kMaxText),
    text(kMaxFileText),        text(kMaxText),     text(kMaxFileText), text(kMaxMeshText),
    text(kMaxFileText),        text(kMaxFileText), text(kMaxText)};
inline constexpr Run kPlanReply[] = {bytes(8 + 8 + 2 + 4 + 2 * sizeof(double)), text(kMaxText),
                                     bytes(1 + 4 * sizeof(double)), text(kMaxText),
                                     array(kPoseSize, kMaxWaypoints)};
inline constexpr Run kOperator[] = {bytes(8 + 1)};
// LCM writes two arrays of the same length in sequence.
inline constexpr Run kObstacles[] = {
    bytes(8 + 8 + 1), array(8 + 4, planning::kMaxUpdateCells),
    array(sizeof(double) + 4, planning::kMaxUpdatePieces),
    array(sizeof(double), 3 * kMaxUpdateVertices),
    array(4 + 4 + 1 + 4 + sizeof(double), planning::kMaxUpdateObjects)};
inline constexpr Run kFreeAhead[] = {bytes(8 + 8 + sizeof(double))};
inline constexpr Run kObstacleAhead[] = {bytes(8 + 8 + 4 * sizeof(double))};
inline constexpr Run kPoseCorrection[] = {bytes(8 + 8 + 2 * sizeof(double))};
inline constexpr Run kMapCorrection[] = {bytes(8),
                                         array(8 + 3 * sizeof(double), kMaxMapCorrectionNodes)};
inline constexpr Run kMapFix[] = {
    bytes(8 + 8 + 1 + (2 + 1 + 9 + 3 + 2) * sizeof(double) + 4 + 4 + sizeof(double) + 4 * 4)};
inline constexpr Run kLoss[] = {bytes(4 * 8)};
inline constexpr Run kTick[] = {bytes(8 + 4)};

inline constexpr std::size_t kEstimateSize = 8 + 2 + kPoseSize + (3 + 3 + 36 + 3) * sizeof(double);
inline constexpr Run kEstimate[] = {bytes(kEstimateSize)};
inline constexpr Run kVision[] = {
    bytes(5 * 8 + 4 * sizeof(double) + 2 * 1 + 5 * 4 + kEstimateSize)};

inline constexpr Run kStatus[] = {bytes(8), text(kMaxText), text(kMaxText), text(kMaxText),
                                  bytes(6 * sizeof(double) + 4 + 1)};
inline constexpr Run kPlanQuery[] = {
    bytes(3 * 8 + 2 * kPoseSize + 2 + 6 * sizeof(double)), text(kMaxText), text(kMaxText),
    array(kPoseSize, kMaxWaypoints), array(kPoseSize, kMaxWaypoints)};
inline constexpr Run kTransition[] = {bytes(8),       text(kMaxText), text(kMaxText),
                                      text(kMaxText), text(kMaxText), text(kMaxText)};
inline constexpr Run kFailsafe[] = {bytes(8), text(kMaxText), text(kMaxText), text(kMaxText),
                                    text(kMaxText)};
inline constexpr Run kAction[] = {bytes(8 + 1), text(kMaxText), bytes(1)};

}  // namespace dive::mission::layout
