#pragma once
// The files that Assimp may open while it reads a mesh. Formats name further files (materials,
// textures, buffers), and Assimp would open whatever they name.

#include <filesystem>
#include <string>

#include <assimp/IOSystem.hpp>

namespace dive::planning {

/// Read-only, and only regular files in the folder of the mesh or beneath it, with symbolic links
/// resolved; all others do not exist.
class AssimpFiles final : public Assimp::IOSystem {
 public:
  explicit AssimpFiles(const std::string& mesh_path);

  [[nodiscard]] bool Exists(const char* path) const override;
  [[nodiscard]] char getOsSeparator() const override { return '/'; }
  /// Null if the file cannot be opened.
  [[nodiscard]] Assimp::IOStream* Open(const char* path, const char* mode) override;
  void Close(Assimp::IOStream* file) override;

 private:
  [[nodiscard]] bool is_permitted(const char* path) const;

  std::string mesh_path_;
  std::filesystem::path folder_;
};

}  // namespace dive::planning
