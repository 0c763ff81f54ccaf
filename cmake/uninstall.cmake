# Removes what `cmake --install` put somewhere, by the lists that it left in the build folder:
#   cmake -DBUILD=build -P cmake/uninstall.cmake
# Folders stay: others may use them.
if(NOT BUILD)
  message(FATAL_ERROR "Name the build folder: cmake -DBUILD=build -P cmake/uninstall.cmake")
endif()
file(GLOB lists ${BUILD}/install_manifest*.txt)
if(NOT lists)
  message(FATAL_ERROR "Nothing was installed from '${BUILD}': it holds no install_manifest*.txt")
endif()
foreach(list ${lists})
  file(STRINGS ${list} files)
  foreach(file ${files})
    # A list does not know DESTDIR.
    set(file "$ENV{DESTDIR}${file}")
    if(EXISTS "${file}" OR IS_SYMLINK "${file}")
      file(REMOVE "${file}")
      message(STATUS "Removed ${file}")
    endif()
  endforeach()
  file(REMOVE ${list})
endforeach()
