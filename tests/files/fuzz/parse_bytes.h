#pragma once

#include <string_view>

/// Each hands untrusted bytes to one parser of ours and checks what every answer must hold: either
/// a sentence, or a description that is sound. They end the process if it does not, which both
/// libFuzzer and the tests notice.
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
