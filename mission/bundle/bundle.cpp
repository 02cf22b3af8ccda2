#include "mission/bundle/bundle.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "common/input_file.h"
#include "mission/bundle/bundle_codec.h"
#include "mission/bundle/seal.h"
#include "mission/record/log_frame.h"

namespace dive::mission {
namespace {

constexpr std::string_view kTextsChannel = "DIVE_BUNDLE";
constexpr std::string_view kMeshChannel = "DIVE_BUNDLE_MESH";

using Bytes = std::span<const std::uint8_t>;

class RecordWriter {
 public:
  template <typename... Value>
  [[nodiscard]] bool add(std::string_view channel, const Value&... value) {
    if (!encode(value..., packet_)) return false;
    append_record({number_++, 0, 0, 0}, channel, packet_, records_);
    return true;
  }
  [[nodiscard]] std::vector<std::uint8_t> finish(const std::optional<link::Key>& key) {
    append_seal(number_, key, records_);
    return std::move(records_);
  }

 private:
  std::vector<std::uint8_t> records_;
  Packet packet_;
  std::int64_t number_ = 0;
};

// Reads records in turn. A record is accepted only as append_record() makes it.
class RecordReader {
 public:
  explicit RecordReader(Bytes records) : rest_(records) {}

  /// Decodes the next record if it has this channel; else leaves it.
  template <typename Value>
  [[nodiscard]] bool take(std::string_view channel, Value& value) {
    const std::optional<std::size_t> size = size_of_next(channel);
    if (!size) return false;
    const std::size_t before = kFrameSize + channel.size();
    if (!decode(rest_.subspan(before, *size - before - kChecksumSize), value)) return false;
    rest_ = rest_.subspan(*size);
    ++number_;
    return true;
  }
  [[nodiscard]] bool at_end() const { return rest_.empty(); }

 private:
  [[nodiscard]] std::optional<std::size_t> size_of_next(std::string_view channel) const {
    if (rest_.size() < kFrameSize) return std::nullopt;
    FrameBytes frame;
    std::ranges::copy(rest_.first(kFrameSize), frame.begin());
    const std::optional<LogFrame> read = read_frame(frame);
    const std::size_t before = kFrameSize + channel.size();
    if (!read || read->number != number_ || read->timestamp != 0 ||
        read->channel_size != channel.size() || read->data_size < kChecksumSize ||
        rest_.size() < before + read->data_size ||
        !std::ranges::equal(rest_.subspan(kFrameSize, channel.size()), channel)) {
      return std::nullopt;
    }
    const Bytes message = rest_.subspan(before, read->data_size - kChecksumSize);
    const auto checksum = checksum_bytes(record_checksum(frame, channel, message));
    const Bytes given = rest_.subspan(before + message.size(), kChecksumSize);
    if (!std::ranges::equal(checksum, given)) return std::nullopt;
    return before + read->data_size;
  }

  Bytes rest_;
  std::int64_t number_ = 0;
};

tl::expected<Bundle, std::string> read_records(Bytes records) {
  const auto refuse = [](const char* what) {
    return tl::unexpected(
        fmt::format("it was not made by this version of dive: {} is not valid", what));
  };
  RecordReader reader(records);
  Bundle bundle;
  BundleTexts texts;
  if (!reader.take(kTextsChannel, texts)) return refuse("its first record");
  bundle.simulation_name = std::move(texts.simulation_name);
  bundle.simulation_xml = std::move(texts.simulation_xml);
  bundle.simulation_meshes = std::move(texts.simulation_meshes);
  bundle.verdict = std::move(texts.verdict);
  if (!reader.take(to_string(Channel::kHeader), bundle.header)) return refuse("its header");
  for (BundledMesh mesh; reader.take(kMeshChannel, mesh);) {
    if (bundle.meshes.size() == kMaxBundledMeshes) return refuse("the number of meshes");
    bundle.meshes.push_back(std::move(mesh));
  }
  for (PlanQuery query; reader.take(to_string(Channel::kPlanQuery), query);) {
    PlanReply reply;
    if (!reader.take(to_string(Channel::kPlan), reply)) return refuse("a plan");
    if (bundle.legs.size() == kMaxBundledLegs) return refuse("the number of plans");
    bundle.legs.push_back({std::move(query.state), std::move(query.cause), std::move(query.request),
                           std::move(reply.plan)});
  }
  if (!reader.at_end()) return refuse("one of its records");
  return bundle;
}

tl::expected<std::vector<std::uint8_t>, std::string> read_bytes(const std::string& path) {
  tl::expected<StdioFile, std::string> file = open_input_stdio(path);
  if (!file) return tl::unexpected(file.error());
  std::vector<std::uint8_t> bytes;
  constexpr std::size_t kChunk = 1U << 20U;
  for (std::size_t size = 0;;) {
    bytes.resize(size + kChunk);
    const std::size_t got = std::fread(bytes.data() + size, 1, kChunk, file->get());
    size += got;
    bytes.resize(size);
    if (size > kMaxBundleBytes) {
      return tl::unexpected(fmt::format("it is larger than {} MiB", kMaxBundleBytes >> 20U));
    }
    if (got < kChunk) return bytes;
  }
}

}  // namespace

tl::expected<std::vector<std::uint8_t>, std::string> pack_bundle(
    const Bundle& bundle, const std::optional<link::Key>& key) {
  const auto refuse = [](const std::string& what) {
    return tl::unexpected(fmt::format("{} is larger than a bundle may hold", what));
  };
  RecordWriter writer;
  if (!writer.add(kTextsChannel, BundleTexts{bundle.simulation_name, bundle.simulation_xml,
                                             bundle.simulation_meshes, bundle.verdict})) {
    return refuse("the simulated world or the result of the check");
  }
  if (!writer.add(to_string(Channel::kHeader), bundle.header)) {
    return refuse("the mission, the map or the vehicle");
  }
  for (const BundledMesh& mesh : bundle.meshes) {
    if (!writer.add(kMeshChannel, mesh)) return refuse(fmt::format("the mesh '{}'", mesh.uri));
  }
  for (std::size_t i = 0; i < bundle.legs.size(); ++i) {
    const auto& [state, goal, request, plan] = bundle.legs[i];
    const auto id = static_cast<std::int64_t>(i);
    if (!writer.add(to_string(Channel::kPlanQuery), 0, PlanQuery{id, state, goal, request}) ||
        !writer.add(to_string(Channel::kPlan), 0, PlanReply{id, plan})) {
      return refuse(fmt::format("the plan to '{}'", goal));
    }
  }
  if (bundle.meshes.size() > kMaxBundledMeshes || bundle.legs.size() > kMaxBundledLegs) {
    return refuse("the number of meshes or plans");
  }
  std::vector<std::uint8_t> bytes = writer.finish(key);
  if (bytes.size() > kMaxBundleBytes) return refuse("all of it together");
  return bytes;
}

tl::expected<OpenedBundle, std::string> parse_bundle(Bytes bytes,
                                                     const std::optional<link::Key>& key) {
  const tl::expected<Seal, std::string> seal = check_seal(bytes, key);
  if (!seal) return tl::unexpected(seal.error());
  tl::expected<Bundle, std::string> bundle = read_records(bytes.first(bytes.size() - seal->size));
  if (!bundle) return tl::unexpected(bundle.error());
  return OpenedBundle{std::move(*bundle), fmt::format("{:02x}", fmt::join(seal->hash, "")),
                      seal->has_code, seal->is_authentic};
}

tl::expected<OpenedBundle, std::string> read_bundle(const std::string& path,
                                                    const std::optional<link::Key>& key) {
  const tl::expected<std::vector<std::uint8_t>, std::string> bytes = read_bytes(path);
  if (!bytes) return tl::unexpected(bytes.error());
  return parse_bundle(*bytes, key);
}

bool begins_like_bundle(std::string_view head) {
  return head.size() >= kFrameSize + kTextsChannel.size() && begins_like_log(head) &&
         head.substr(kFrameSize, kTextsChannel.size()) == kTextsChannel;
}

}  // namespace dive::mission
