#include "mission/export/mcap_schemas.h"

namespace dive::mission {
namespace {

// Pieces of schemas, joined by the preprocessor.
#define DIVE_NUMBER "{\"type\":\"number\"}"
#define DIVE_TEXT "{\"type\":\"string\"}"
#define DIVE_TIME                                                                                  \
  "{\"type\":\"object\",\"title\":\"time\",\"properties\":{\"sec\":{\"type\":"                     \
  "\"integer\",\"minimum\":0},\"nsec\":{\"type\":\"integer\",\"minimum\":0,\"maximum\":999999999}" \
  "}}"
#define DIVE_VECTOR                                                               \
  "{\"type\":\"object\",\"properties\":{\"x\":" DIVE_NUMBER ",\"y\":" DIVE_NUMBER \
  ",\"z\":" DIVE_NUMBER "}}"
#define DIVE_QUATERNION                                                           \
  "{\"type\":\"object\",\"properties\":{\"x\":" DIVE_NUMBER ",\"y\":" DIVE_NUMBER \
  ",\"z\":" DIVE_NUMBER ",\"w\":" DIVE_NUMBER "}}"
#define DIVE_POSE                                                  \
  "{\"type\":\"object\",\"properties\":{\"position\":" DIVE_VECTOR \
  ",\"orientation\":" DIVE_QUATERNION "}}"
#define DIVE_COLOUR                                                               \
  "{\"type\":\"object\",\"properties\":{\"r\":" DIVE_NUMBER ",\"g\":" DIVE_NUMBER \
  ",\"b\":" DIVE_NUMBER ",\"a\":" DIVE_NUMBER "}}"
#define DIVE_LIST(item) "{\"type\":\"array\",\"items\":" item "}"

constexpr const char* kTransform =
    "{\"title\":\"foxglove.FrameTransform\",\"type\":\"object\",\"properties\":{"
    "\"timestamp\":" DIVE_TIME ",\"parent_frame_id\":" DIVE_TEXT ",\"child_frame_id\":" DIVE_TEXT
    ",\"translation\":" DIVE_VECTOR ",\"rotation\":" DIVE_QUATERNION "}}";
constexpr const char* kPose =
    "{\"title\":\"foxglove.PoseInFrame\",\"type\":\"object\",\"properties\":{"
    "\"timestamp\":" DIVE_TIME ",\"frame_id\":" DIVE_TEXT ",\"pose\":" DIVE_POSE "}}";
constexpr const char* kPoses =
    "{\"title\":\"foxglove.PosesInFrame\",\"type\":\"object\",\"properties\":{"
    "\"timestamp\":" DIVE_TIME ",\"frame_id\":" DIVE_TEXT ",\"poses\":" DIVE_LIST(DIVE_POSE) "}}";
constexpr const char* kScene =
    "{\"title\":\"foxglove.SceneUpdate\",\"type\":\"object\",\"properties\":{\"deletions\":{\"type\":"
    "\"array\",\"items\":{\"type\":\"object\",\"properties\":{}}},\"entities\":{\"type\":\"array\","
    "\"items\":{\"title\":\"foxglove.SceneEntity\",\"type\":\"object\",\"properties\":{\"timestamp\":" DIVE_TIME
    ",\"frame_id\":" DIVE_TEXT ",\"id\":" DIVE_TEXT
    ",\"lifetime\":{\"type\":\"object\",\"title\":\"duration\",\"properties\":{\"sec\":{\"type\":"
    "\"integer\"},\"nsec\":{\"type\":\"integer\"}}},\"frame_locked\":{\"type\":\"boolean\"},"
    "\"triangles\":{\"type\":\"array\",\"items\":{\"type\":\"object\",\"properties\":{\"pose\":" DIVE_POSE
    ",\"points\":" DIVE_LIST(DIVE_VECTOR) ",\"color\":" DIVE_COLOUR ",\"colors\":" DIVE_LIST(DIVE_COLOUR)
    ",\"indices\":{\"type\":\"array\",\"items\":{\"type\":\"integer\",\"minimum\":0}}}}}}}}}}";
constexpr const char* kStatus =
    "{\"title\":\"dive.Status\",\"type\":\"object\",\"properties\":{\"depth_m\":" DIVE_NUMBER
    ",\"heading_deg\":" DIVE_NUMBER ",\"speed_mps\":" DIVE_NUMBER ",\"sigma_m\":" DIVE_NUMBER
    ",\"error_m\":" DIVE_NUMBER ",\"command_mps\":" DIVE_NUMBER ",\"command_depth_m\":" DIVE_NUMBER
    ",\"battery_fraction\":" DIVE_NUMBER ",\"clearance_m\":" DIVE_NUMBER
    ",\"cross_track_m\":" DIVE_NUMBER ",\"state\":" DIVE_TEXT ",\"goal\":" DIVE_TEXT
    ",\"rung\":" DIVE_TEXT "}}";
constexpr const char* kLog =
    "{\"title\":\"foxglove.Log\",\"type\":\"object\",\"properties\":{\"timestamp\":" DIVE_TIME
    ",\"level\":{\"type\":\"integer\",\"minimum\":0},\"message\":" DIVE_TEXT ",\"name\":" DIVE_TEXT
    ",\"file\":" DIVE_TEXT ",\"line\":{\"type\":\"integer\",\"minimum\":0}}}";

}  // namespace

const std::array<McapTopic, 7> kMcapTopics{{{"/tf", "foxglove.FrameTransform", kTransform},
                                            {"/estimate", "foxglove.PoseInFrame", kPose},
                                            {"/truth", "foxglove.PoseInFrame", kPose},
                                            {"/plan", "foxglove.PosesInFrame", kPoses},
                                            {"/map", "foxglove.SceneUpdate", kScene},
                                            {"/status", "dive.Status", kStatus},
                                            {"/events", "foxglove.Log", kLog}}};

}  // namespace dive::mission
