# How good a field is, and one word for it. std and GLM only: no Vulkan, so that any tool can link it.
add_library(palpate_quality
  ${CMAKE_CURRENT_LIST_DIR}/frame_order.cpp
  ${CMAKE_CURRENT_LIST_DIR}/noise.cpp
  ${CMAKE_CURRENT_LIST_DIR}/quality.cpp
  ${CMAKE_CURRENT_LIST_DIR}/quality_folds.cpp
  ${CMAKE_CURRENT_LIST_DIR}/quality_inverse.cpp
  ${CMAKE_CURRENT_LIST_DIR}/quality_match.cpp
  ${CMAKE_CURRENT_LIST_DIR}/sequence_quality.cpp
  ${CMAKE_CURRENT_LIST_DIR}/verdict.cpp)
target_link_libraries(palpate_quality PUBLIC palpate_volume PRIVATE $<BUILD_INTERFACE:palpate_flags>)
# The determinants of a row are written for vector instructions; -O2 alone leaves them scalar.
set_source_files_properties(${CMAKE_CURRENT_LIST_DIR}/quality_folds.cpp PROPERTIES COMPILE_OPTIONS "-O3")
