#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <glm/glm.hpp>

#include "compute/volume/field.h"
#include "compute/volume/volume.h"

namespace palpate::charts {

/// A PNG that was read. Empty if there is no such file or it is not a picture.
struct ReadPicture {
  int width = 0;
  int height = 0;
  std::vector<uint32_t> pixels;  ///< 0xXXRRGGBB

  glm::ivec3 rgb(int x, int y) const;
  /// A strong colour, as of arrows; frames and text have none.
  bool colored(int x, int y) const;
};

ReadPicture read_png(const std::string& path);

/// The centre (pixels) of the strong colours of `one` that `other` does not have; their number in
/// *count.
glm::dvec2 centre_of_new_colors(const ReadPicture& one, const ReadPicture& other, int* count);

/// A file of this test that is removed at its end.
class ScratchFile {
 public:
  explicit ScratchFile(const std::string& name);
  ~ScratchFile();
  ScratchFile(const ScratchFile&) = delete;
  ScratchFile& operator=(const ScratchFile&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

/// A grid centred on the LPS origin.
Grid centred_grid(glm::ivec3 size, glm::dvec3 spacing_mm, glm::dmat3 direction = glm::dmat3(1.0));

Volume filled_volume(const Grid& grid, const std::function<float(glm::dvec3 lps_mm)>& value_at);
Field filled_field(const Grid& grid, const std::function<glm::dvec3(glm::dvec3 lps_mm)>& u_at);

}  // namespace palpate::charts
