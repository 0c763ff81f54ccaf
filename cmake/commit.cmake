# Writes the header with the commit that is being built; at build time, because the tree moves on
# after it was configured. cmake -D SOURCE=... -D HEADER=... -P commit.cmake
execute_process(COMMAND git describe --always --dirty --abbrev=10
                WORKING_DIRECTORY ${SOURCE} OUTPUT_VARIABLE commit
                OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE failed)
if(failed OR NOT commit)
  set(commit unknown)
endif()
# Touches the file only if the text is another, so that nothing is compiled in vain.
file(CONFIGURE OUTPUT ${HEADER} CONTENT "#pragma once
inline constexpr const char* kCommit = \"${commit}\";
")
