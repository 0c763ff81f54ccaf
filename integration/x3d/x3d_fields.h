#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace palpate::x3d {

/// Parsing and writing the text of X3D's fields. Numbers are separated by white space or commas.

/// All numbers of a field; empty if something in it can not be parsed or is not finite.
std::optional<std::vector<double>> numbers_of(std::string_view text);

/// true or false, in any case: H3D's scenes write TRUE.
std::optional<bool> boolean_of(std::string_view text);

/// The strings of an MFString, "a" 'b c'; a text without quotation marks is one string.
std::vector<std::string> strings_of(std::string_view text);

/// From x y z angle (rad). Empty for an axis of length 0, unless the angle is 0.
std::optional<glm::dquat> rotation_of(const double* axis_and_angle);

/// An SFImage: the texels row by row, the lowest first, each a number with a byte per component.
struct PixelImage {
  int width = 0, height = 0, components = 0;
  std::vector<uint32_t> texels;
};
/// Empty if the number of texels is not as stated, if there are not 1 to 4 components, or not 1 to
/// 65,536 texels.
std::optional<PixelImage> image_of(std::string_view text);

/// The shortest texts that parse to the same doubles.
std::string text_of(double number);
std::string text_of(const glm::dvec3& v);
std::string text_of(const glm::dquat& rotation);
/// "a" "b"; a quotation mark or backslash in them gets a backslash.
std::string text_of(const std::vector<std::string>& strings);

/// Escapes a text for an attribute in single quotation marks.
std::string escaped(std::string_view text);

}  // namespace palpate::x3d
