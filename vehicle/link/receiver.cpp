#include "vehicle/link/receiver.h"

#include <algorithm>
#include <cerrno>
#include <memory>
#include <system_error>
#include <utility>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <ifaddrs.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

namespace dive::link {
namespace {

constexpr int kReceiveBytes = 4 << 20;  // requested unless the URL says otherwise
constexpr int kMaxRead = 256;           // datagrams between two presences that may be due
constexpr Utime kMinRefresh = kMicrosecondsPerSecond;

Utime steady_now() { return SteadyClock().now(); }

// IPv4 addresses of this machine, in network order.
std::vector<std::uint32_t> own_addresses() {
  std::vector<std::uint32_t> addresses;
  ifaddrs* first = nullptr;
  if (::getifaddrs(&first) != 0) return addresses;
  for (const ifaddrs* one = first; one != nullptr; one = one->ifa_next) {
    if (one->ifa_addr == nullptr || one->ifa_addr->sa_family != AF_INET) continue;
    addresses.push_back(reinterpret_cast<const sockaddr_in*>(one->ifa_addr)->sin_addr.s_addr);
  }
  ::freeifaddrs(first);
  return addresses;
}

sockaddr_in group_of(const UdpmUrl& url) {
  sockaddr_in group{};
  group.sin_family = AF_INET;
  group.sin_port = htons(url.port);
  ::inet_pton(AF_INET, url.address.c_str(), &group.sin_addr);
  return group;
}

// Bound to the group's address: packets to an address of the machine itself do not arrive. As LCM
// does, it lets the system choose the interface, and shares the port.
bool join(int socket, const UdpmUrl& url) {
  const sockaddr_in group = group_of(url);
  const int yes = 1;
  const int bytes = url.receive_bytes > 0 ? url.receive_bytes : kReceiveBytes;
  ip_mreq request{};
  request.imr_multiaddr = group.sin_addr;
  request.imr_interface.s_addr = htonl(INADDR_ANY);
  // The system may grant fewer bytes.
  return ::setsockopt(socket, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof bytes) == 0 &&
         ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes) == 0 &&
         ::bind(socket, reinterpret_cast<const sockaddr*>(&group), sizeof group) == 0 &&
         ::setsockopt(socket, IPPROTO_IP, IP_ADD_MEMBERSHIP, &request, sizeof request) == 0;
}

}  // namespace

tl::expected<std::unique_ptr<Receiver>, std::string> Receiver::open(const UdpmUrl& url,
                                                                    Intake& intake,
                                                                    SendPresence send) {
  const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const int wake = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (socket >= 0 && wake >= 0 && join(socket, url)) {
    return std::unique_ptr<Receiver>(
        new Receiver(socket, wake, url.ttl == 0, intake, std::move(send)));
  }
  const bool has_no_route = errno == ENODEV || errno == ENETUNREACH;
  const std::string reason =
      has_no_route ? multicast_hint(url) : std::generic_category().message(errno);
  if (socket >= 0) ::close(socket);
  if (wake >= 0) ::close(wake);
  return tl::unexpected(
      fmt::format("cannot open the link over {}:{}: {}", url.address, url.port, reason));
}

Receiver::Receiver(int socket, int wake, bool local_only, Intake& intake, SendPresence send)
    : socket_(socket),
      wake_(wake),
      local_only_(local_only),
      intake_(intake),
      send_(std::move(send)),
      buffer_(kMaxDatagram),
      own_addresses_(own_addresses()),
      addresses_at_(steady_now()),
      thread_([this] { run(); }) {}

Receiver::~Receiver() {
  wanted_ = false;
  const std::uint64_t one = 1;
  const bool is_woken = ::write(wake_, &one, sizeof one) == sizeof one;
  static_cast<void>(is_woken);  // a counter that is full wakes too
  thread_.join();
  ::close(socket_);
  ::close(wake_);
}

void Receiver::run() {
  while (wanted_) {
    send_presence();
    pollfd readable[2] = {{socket_, POLLIN, 0}, {wake_, POLLIN, 0}};
    ::poll(readable, 2, static_cast<int>(time_to_presence()));
    read_datagrams();
  }
}

void Receiver::read_datagrams() {
  for (int i = 0; i < kMaxRead && wanted_; ++i) {
    sockaddr_in from{};
    socklen_t length = sizeof from;
    const ssize_t size = ::recvfrom(socket_, buffer_.data(), buffer_.size(), 0,
                                    reinterpret_cast<sockaddr*>(&from), &length);
    if (size < 0) return;
    if (local_only_ && !is_local(from.sin_addr.s_addr)) continue;
    const std::uint64_t address =
        std::uint64_t{ntohl(from.sin_addr.s_addr)} << 16U | ntohs(from.sin_port);
    intake_.take({buffer_.data(), static_cast<std::size_t>(size)}, address, steady_now());
  }
}

void Receiver::send_presence() {
  if (const std::optional<Presence> presence = intake_.take_presence(steady_now())) {
    send_(*presence);
  }
}

std::int64_t Receiver::time_to_presence() const {
  if (!intake_.has_key()) return -1;
  const Utime left = intake_.next_presence() - steady_now();
  return std::max<Utime>(0, (left + 999) / 1000);
}

// An address may be assigned while we run.
bool Receiver::is_local(std::uint32_t address) {
  const auto knows = [&] {
    return std::ranges::find(own_addresses_, address) != own_addresses_.end();
  };
  if (knows()) return true;
  const Utime now = steady_now();
  if (now - addresses_at_ < kMinRefresh) return false;
  addresses_at_ = now;
  own_addresses_ = own_addresses();
  return knows();
}

}  // namespace dive::link
