// Loaded into a process by LD_PRELOAD: its pwrite() and fdatasync() wait as long as the file that
// DIVE_STALLED_DISK names exists, as they do on a disk that does not answer.

#include <cstdlib>

#include <dlfcn.h>
#include <unistd.h>

namespace {

void wait_while_stalled() {
  static const char* const file = std::getenv("DIVE_STALLED_DISK");
  while (file != nullptr && ::access(file, F_OK) == 0) ::usleep(10'000);
}

template <typename Function>
Function next(const char* name) {
  return reinterpret_cast<Function>(::dlsym(RTLD_NEXT, name));
}

}  // namespace

extern "C" {

ssize_t pwrite64(int descriptor, const void* bytes, size_t size, off64_t offset) {
  static const auto real = next<decltype(&pwrite64)>("pwrite64");
  wait_while_stalled();
  return real(descriptor, bytes, size, offset);
}

ssize_t pwrite(int descriptor, const void* bytes, size_t size, off_t offset) {
  return pwrite64(descriptor, bytes, size, offset);
}

int fdatasync(int descriptor) {
  static const auto real = next<decltype(&fdatasync)>("fdatasync");
  wait_while_stalled();
  return real(descriptor);
}
}
