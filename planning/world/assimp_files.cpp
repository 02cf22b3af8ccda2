#include "planning/world/assimp_files.h"

#include <cstdio>
#include <memory>
#include <string_view>
#include <system_error>
#include <utility>

#include <assimp/IOStream.hpp>
#include <sys/stat.h>

#include "common/input_file.h"
#include "common/path_beneath.h"

namespace dive::planning {
namespace {

class AssimpFile final : public Assimp::IOStream {
 public:
  explicit AssimpFile(StdioFile file) : file_(std::move(file)) {}

  std::size_t Read(void* to, std::size_t size, std::size_t count) override {
    return std::fread(to, size, count, file_.get());
  }
  std::size_t Write(const void*, std::size_t, std::size_t) override { return 0; }
  aiReturn Seek(std::size_t offset, aiOrigin origin) override {
    const int from = origin == aiOrigin_CUR   ? SEEK_CUR
                     : origin == aiOrigin_END ? SEEK_END
                                              : SEEK_SET;
    const bool is_done = ::fseeko(file_.get(), static_cast<off_t>(offset), from) == 0;
    return is_done ? aiReturn_SUCCESS : aiReturn_FAILURE;
  }
  [[nodiscard]] std::size_t Tell() const override {
    return static_cast<std::size_t>(::ftello(file_.get()));
  }
  [[nodiscard]] std::size_t FileSize() const override {
    struct stat status {};
    return ::fstat(fileno(file_.get()), &status) == 0 ? static_cast<std::size_t>(status.st_size)
                                                      : 0;
  }
  void Flush() override {}

 private:
  StdioFile file_;
};

}  // namespace

AssimpFiles::AssimpFiles(const std::string& mesh_path)
    : mesh_path_(mesh_path), folder_(canonical_folder_of(mesh_path)) {}

bool AssimpFiles::is_permitted(const char* path) const {
  return path == mesh_path_ || is_beneath(path, folder_);
}

bool AssimpFiles::Exists(const char* path) const {
  std::error_code ignored;
  return is_permitted(path) && std::filesystem::is_regular_file(path, ignored);
}

Assimp::IOStream* AssimpFiles::Open(const char* path, const char* mode) {
  if (std::string_view(mode).find_first_of("wa+") != std::string_view::npos) return nullptr;
  if (!is_permitted(path)) return nullptr;
  tl::expected<StdioFile, std::string> file = open_input_stdio(path);
  return file ? std::make_unique<AssimpFile>(std::move(*file)).release() : nullptr;
}

void AssimpFiles::Close(Assimp::IOStream* file) {
  const std::unique_ptr<Assimp::IOStream> closed(file);
}

}  // namespace dive::planning
