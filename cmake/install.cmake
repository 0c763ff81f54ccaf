# What another project gets: the value types of space, the quality measures, the cross-check and the matchers.
#   cmake --install build --prefix PREFIX --component palpate_development
#   find_package(palpate REQUIRED); target_link_libraries(my_test PRIVATE palpate::testing)
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
        EXPORT palpateTargets
        ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT palpate_development
        LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT palpate_development)
install(EXPORT palpateTargets NAMESPACE palpate:: DESTINATION ${palpate_package_dir}
        COMPONENT palpate_development)

install(DIRECTORY ${PROJECT_SOURCE_DIR}/compute/volume DESTINATION ${palpate_header_dir}/compute
        COMPONENT palpate_development FILES_MATCHING PATTERN "*.h")
install(FILES ${PROJECT_SOURCE_DIR}/compute/motion/noise.h
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
  ${PROJECT_BINARY_DIR}/palpateConfig.cmake INSTALL_DESTINATION ${palpate_package_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/palpateConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/palpateConfig.cmake ${PROJECT_BINARY_DIR}/palpateConfigVersion.cmake
        DESTINATION ${palpate_package_dir} COMPONENT palpate_development)
