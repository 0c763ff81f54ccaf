# cmake -D BUILD=.. -D WORK=.. -D SOURCE=.. -D COMPILER=.. -D GENERATOR=.. [-D SANITIZE=..] -P outside_project.cmake
function(must)
  execute_process(COMMAND ${ARGV} COMMAND_ECHO STDOUT RESULT_VARIABLE status)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "This step of the outside project failed: ${ARGV}")
  endif()
endfunction()

file(REMOVE_RECURSE ${WORK})
must(${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/prefix --component palpate_development)
set(flags "")
if(SANITIZE)  # the installed libraries ask for the sanitizer's runtime
  set(flags "-fsanitize=${SANITIZE}")
endif()
must(${CMAKE_COMMAND} -G ${GENERATOR} -S ${SOURCE} -B ${WORK}/build -D CMAKE_PREFIX_PATH=${WORK}/prefix
     -D CMAKE_CXX_COMPILER=${COMPILER} "-DCMAKE_CXX_FLAGS=${flags}")
must(${CMAKE_COMMAND} --build ${WORK}/build)
must(${WORK}/build/flow_test)
