#pragma once

#include <string_view>

/// Each gives untrusted bytes to one of palpate's parsers. The result must be an error message, or
/// a valid description. Else they end the process, which both libFuzzer and the tests detect.
namespace palpate::files::fuzz {

void parse_nrrd(std::string_view bytes);
void parse_sequence_motion(std::string_view bytes);
void parse_meta(std::string_view bytes);
void parse_nifti(std::string_view bytes);
void parse_vtk(std::string_view bytes);
void parse_dicom_file(std::string_view bytes);
void parse_points(std::string_view bytes);
void parse_followed(std::string_view bytes);
void parse_scene_file(std::string_view bytes);
void parse_calibration_file(std::string_view bytes);

}  // namespace palpate::files::fuzz
