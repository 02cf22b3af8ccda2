#pragma once
// The topics of an exported dive and the schemas of their JSON messages: those of Foxglove
// (https://docs.foxglove.dev/docs/sdk/schemas) where there is one, so that its panels show them.
// Private to mission/export.

#include <array>

namespace dive::mission {

struct McapTopic {
  const char* topic = "";
  const char* schema_name = "";
  const char* schema = "";  ///< JSON Schema.
};

/// The index of each is its number in kMcapTopics.
enum class Topic { kTransform, kEstimate, kTruth, kPlan, kMap, kStatus, kEvents };

extern const std::array<McapTopic, 7> kMcapTopics;

}  // namespace dive::mission
