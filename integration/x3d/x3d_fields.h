#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace palpate::x3d {

/// The text of X3D's fields and what it stands for. Numbers are separated by white space or commas.

/// All numbers of a field; nothing if something in it can not be read, or is not finite.
std::optional<std::vector<double>> numbers_of(std::string_view text);

/// true and false, in any case: H3D's scenes write TRUE.
std::optional<bool> boolean_of(std::string_view text);

/// The strings of an MFString, "a" 'b c'; a text without quotation marks is one string.
std::vector<std::string> strings_of(std::string_view text);

/// x y z angle (rad). Nothing for an axis without a length, unless the angle is 0.
std::optional<glm::dquat> rotation_of(const double* axis_and_angle);

/// An SFImage: the texels row by row, the lowest first, each a number with a byte per component.
struct PixelImage {
  int width = 0, height = 0, components = 0;
  std::vector<uint32_t> texels;
};
/// Nothing if it has not as many texels as it says, not 1 to 4 components, no texel, or more than
/// 65,536.
std::optional<PixelImage> image_of(std::string_view text);

/// Shortest texts that give the same doubles again.
std::string text_of(double number);
std::string text_of(const glm::dvec3& v);
std::string text_of(const glm::dquat& rotation);
/// "a" "b"; a quotation mark or backslash in them gets a backslash.
std::string text_of(const std::vector<std::string>& strings);

/// For an attribute between single quotation marks.
std::string escaped(std::string_view text);

}  // namespace palpate::x3d
