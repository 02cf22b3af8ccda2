#pragma once
// Output that never delays its producer: blocks of bytes are copied to a bounded queue, and a
// thread of ordinary priority passes them to a sink (a file, a terminal, a service manager), one
// after another and in order.

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string_view>

namespace dive {

/// Behaviour when the queue is full: on a vehicle a block is dropped, because nothing may delay the
/// control loop; a simulation waits, so that it loses nothing.
enum class WhenFull { kDrop, kWait };

/// One producer thread.
class BackgroundOutput {
 public:
  /// Called on the thread. Must not throw, and must own what it uses: it lives until its last call
  /// has returned, which may be after close().
  using Sink = std::function<void(std::span<const std::uint8_t> block)>;

  /// Allocates the queue, `capacity` bytes.
  BackgroundOutput(std::size_t capacity, WhenFull when_full, Sink sink);
  /// close() with its default timeout.
  ~BackgroundOutput();
  BackgroundOutput(const BackgroundOutput&) = delete;
  BackgroundOutput& operator=(const BackgroundOutput&) = delete;

  /// Queues a copy. With kDrop it neither waits nor locks nor allocates, and returns false if the
  /// block does not fit. With kWait it waits for room, and passes a block larger than the queue to
  /// the sink itself. False after close().
  bool push(std::span<const std::uint8_t> block);
  bool push(std::string_view text);

  /// Numbers of blocks queued and passed to the sink so far: the sink has returned from block
  /// number n once done() >= n.
  [[nodiscard]] std::uint64_t pushed() const;
  [[nodiscard]] std::uint64_t done() const;

  /// Waits until the sink has returned from all blocks queued; false if that took longer.
  [[nodiscard]] bool drain(std::chrono::milliseconds timeout);
  /// Drains, and ends the thread. After a timeout (false) the rest of the queue is dropped and the
  /// thread ends by itself when the sink returns.
  bool close(std::chrono::milliseconds timeout = std::chrono::seconds(10));

 private:
  struct State;
  std::shared_ptr<State> state_;  // Shared with the thread, which may outlive this object.
};

}  // namespace dive
