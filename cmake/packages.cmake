# Debian packages: cpack --config build/CPackConfig.cmake (in the build folder: cpack), one per component.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME palpate)
set(CPACK_PACKAGE_VENDOR "palpate")
set(CPACK_PACKAGE_CONTACT "the founders of palpate <founders@palpate.example>")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${CMAKE_BINARY_DIR})
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_COMPONENTS_ALL palpate_program palpate_library palpate_development palpate_lab palpate_cohort)

# package(COMPONENT NAME SECTION DESCRIPTION): what is particular to one package, and what Debian asks of each.
include(GNUInstallDirs)
set(notes ${CMAKE_BINARY_DIR}/packages)
file(MAKE_DIRECTORY ${notes})
file(WRITE ${notes}/triggers "activate-noawait ldconfig\n")
find_program(GZIP gzip REQUIRED)
# Packages name the libraries of the Debian on which they are made.
cmake_host_system_information(RESULT suite QUERY DISTRIB_VERSION_CODENAME)
function(package component name section description)
  string(TOUPPER ${component} upper)
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${name} PARENT_SCOPE)
  set(CPACK_DEBIAN_${upper}_PACKAGE_SECTION ${section} PARENT_SCOPE)
  set(CPACK_COMPONENT_${upper}_DESCRIPTION "${description}" PARENT_SCOPE)
  set(folder ${CMAKE_INSTALL_DATADIR}/doc/${name})
  configure_file(${PROJECT_SOURCE_DIR}/cmake/changelog.in ${notes}/${name}/changelog @ONLY)
  execute_process(COMMAND ${GZIP} -9nf ${notes}/${name}/changelog)
  install(FILES ${PROJECT_SOURCE_DIR}/cmake/copyright DESTINATION ${folder} COMPONENT ${component})
  install(FILES ${notes}/${name}/changelog.gz DESTINATION ${folder} COMPONENT ${component})
endfunction()

package(palpate_program palpate science "feel, see and follow moving volumes
Palpate lets a person put a hand into a moving volume, such as a beating heart
from a scanner: it estimates how the data move on the GPU, shows them in
head-mounted stereo, and renders their forces at 1 kHz.")
set(CPACK_DEBIAN_PALPATE_PROGRAM_PACKAGE_RECOMMENDS "mesa-vulkan-drivers")
set(CPACK_DEBIAN_PALPATE_PROGRAM_PACKAGE_SUGGESTS "palpate-lab, palpate-cohort")
package(palpate_library libpalpate0 libs "feel, see and follow moving volumes, as a library
Contexts, scenes, sessions and views behind one C interface, for programs with
a haptic loop or a Vulkan device of their own.")
set(CPACK_DEBIAN_PALPATE_LIBRARY_PACKAGE_RECOMMENDS "mesa-vulkan-drivers")
set(CPACK_DEBIAN_PALPATE_LIBRARY_PACKAGE_CONTROL_EXTRA ${notes}/triggers)
package(palpate_development libpalpate-dev libdevel "feel, see and follow moving volumes, for developers
Headers of the C library and of haptic modes, CMake and pkg-config files, and
C++ matchers for tests of motion fields.")
set(CPACK_DEBIAN_PALPATE_DEVELOPMENT_PACKAGE_DEPENDS "libpalpate0 (= ${PROJECT_VERSION})")
set(CPACK_DEBIAN_PALPATE_DEVELOPMENT_PACKAGE_SUGGESTS "libopencv-dev, libgtest-dev, libglm-dev")
package(palpate_lab palpate-lab science "charts of palpate's speed, accuracy and limits
Measures palpate and its peers on this machine: speed against accuracy, and
maps of where methods fail, each as one page; motion, feel and view as tables.")
set(CPACK_DEBIAN_PALPATE_LAB_PACKAGE_DEPENDS "palpate (= ${PROJECT_VERSION})")
set(CPACK_DEBIAN_PALPATE_LAB_PACKAGE_SUGGESTS "elastix, plastimatch")
# One of its own: in "palpate", "Recommends: snakemake" would bring 365 packages to an empty Debian 12 (apt-get -s), for one volume too.
package(palpate_cohort palpate-cohort science "motion of many sequences, on one machine or a cluster
Runs palpate over a table of sequences with Snakemake, here or as jobs of Slurm:
fields, verdicts, pictures, a table and a page.")
set(CPACK_DEBIAN_PALPATE_COHORT_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_PALPATE_COHORT_PACKAGE_SHLIBDEPS OFF)
set(CPACK_DEBIAN_PALPATE_COHORT_PACKAGE_DEPENDS "palpate (>= ${PROJECT_VERSION}), python3 (>= 3.10), snakemake (>= 7)")
set(CPACK_DEBIAN_PALPATE_COHORT_PACKAGE_SUGGESTS "slurm-client")
if(TARGET palpate_python)
  list(APPEND CPACK_COMPONENTS_ALL palpate_python)
  package(palpate_python python3-palpate python "feel, see and follow moving volumes, for Python
Motion of numpy, nibabel, SimpleITK and itk images with verdict and inverse,
and scenes that are felt in a loop of Python's.")
  set(CPACK_DEBIAN_PALPATE_PYTHON_PACKAGE_DEPENDS "libpalpate0 (= ${PROJECT_VERSION}), ${palpate_module_depends}, python3-numpy")
  set(CPACK_DEBIAN_PALPATE_PYTHON_PACKAGE_SUGGESTS "python3-nibabel")
endif()
include(CPack)
