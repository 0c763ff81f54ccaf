# What another project gets, by components:
#   palpate_library      libpalpate.so.0
#   palpate_development  palpate.h and palpate_mode.h, CMake and pkg-config files; and the value types of space, the quality
#                        measures, the cross-check and the matchers for tests in C++
#   find_package(palpate); target_link_libraries(my_program PRIVATE palpate::palpate)
#   find_package(palpate COMPONENTS testing); target_link_libraries(my_test PRIVATE palpate::testing)
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(palpate_package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/palpate)
# The folders stay below include/palpate, so that headers include each other as they do in the source tree.
set(palpate_header_dir ${CMAKE_INSTALL_INCLUDEDIR}/palpate)

foreach(library volume quality opencv testing)
  set_target_properties(palpate_${library} PROPERTIES EXPORT_NAME ${library})
endforeach()
target_compile_features(palpate_volume INTERFACE cxx_std_20)
target_include_directories(palpate_volume INTERFACE $<INSTALL_INTERFACE:${palpate_header_dir}>)

install(TARGETS palpate_volume palpate_quality palpate_opencv palpate_testing
        EXPORT palpateTestingTargets
        ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT palpate_development
        LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT palpate_development)
install(EXPORT palpateTestingTargets NAMESPACE palpate:: DESTINATION ${palpate_package_dir}
        COMPONENT palpate_development)

set_target_properties(palpate_c PROPERTIES EXPORT_NAME palpate)
target_include_directories(palpate_c INTERFACE $<INSTALL_INTERFACE:${palpate_header_dir}>)
install(TARGETS palpate_c EXPORT palpateTargets
        LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT palpate_library
        NAMELINK_COMPONENT palpate_development)
install(EXPORT palpateTargets NAMESPACE palpate:: DESTINATION ${palpate_package_dir}
        COMPONENT palpate_development)
install(FILES ${PROJECT_SOURCE_DIR}/integration/toolkit/palpate.h
              ${PROJECT_SOURCE_DIR}/integration/loading/palpate_mode.h
        DESTINATION ${palpate_header_dir} COMPONENT palpate_development)
# Where Debian has the examples of a library; without those that are built in the source tree alone.
install(DIRECTORY ${PROJECT_SOURCE_DIR}/docs/examples/
        DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/libpalpate-dev/examples COMPONENT palpate_development
        PATTERN "snap_mode.*" EXCLUDE PATTERN "texture_mode.*" EXCLUDE PATTERN "my_device.h" EXCLUDE
        PATTERN "vtk_image.h" EXCLUDE PATTERN "gradient_length.*" EXCLUDE PATTERN "__pycache__" EXCLUDE)
# The sources of the extension for Godot, which is built against the engine that a user has.
install(DIRECTORY ${PROJECT_SOURCE_DIR}/integration/toolkit/godot DESTINATION ${CMAKE_INSTALL_DATADIR}/palpate
        COMPONENT palpate_development)
# Paths from where the file lies: the same for every prefix.
file(RELATIVE_PATH palpate_prefix_from_pc /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
configure_file(${PROJECT_SOURCE_DIR}/cmake/palpate.pc.in ${PROJECT_BINARY_DIR}/palpate.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/palpate.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig
        COMPONENT palpate_development)

install(DIRECTORY ${PROJECT_SOURCE_DIR}/compute/volume DESTINATION ${palpate_header_dir}/compute
        COMPONENT palpate_development FILES_MATCHING PATTERN "*.h")
install(FILES ${PROJECT_SOURCE_DIR}/compute/motion/frame_order.h
              ${PROJECT_SOURCE_DIR}/compute/motion/noise.h
              ${PROJECT_SOURCE_DIR}/compute/motion/quality.h
              ${PROJECT_SOURCE_DIR}/compute/motion/quality_folds.h
              ${PROJECT_SOURCE_DIR}/compute/motion/quality_inverse.h
              ${PROJECT_SOURCE_DIR}/compute/motion/quality_match.h
              ${PROJECT_SOURCE_DIR}/compute/motion/verdict.h
        DESTINATION ${palpate_header_dir}/compute/motion COMPONENT palpate_development)
install(FILES ${PROJECT_SOURCE_DIR}/integration/opencv/cross_check.h
              ${PROJECT_SOURCE_DIR}/integration/opencv/testing.h
        DESTINATION ${palpate_header_dir}/integration/opencv COMPONENT palpate_development)

configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/palpateConfig.cmake.in
  ${PROJECT_BINARY_DIR}/palpateConfig.cmake INSTALL_DESTINATION ${palpate_package_dir}
  PATH_VARS CMAKE_INSTALL_LIBDIR)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/palpateConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/palpateConfig.cmake ${PROJECT_BINARY_DIR}/palpateConfigVersion.cmake
        DESTINATION ${palpate_package_dir} COMPONENT palpate_development)
