# The steps of the motion engine in plain double precision: what the kernels are tested against. No Vulkan.
add_library(palpate_oracle
  ${CMAKE_CURRENT_LIST_DIR}/oracle_image.cpp
  ${CMAKE_CURRENT_LIST_DIR}/oracle_step.cpp
  ${CMAKE_CURRENT_LIST_DIR}/oracle_field.cpp
  ${CMAKE_CURRENT_LIST_DIR}/oracle_search.cpp)
target_link_libraries(palpate_oracle PUBLIC palpate_volume PRIVATE $<BUILD_INTERFACE:palpate_flags>)
