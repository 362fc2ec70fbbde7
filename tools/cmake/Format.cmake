# Targets `format` (rewrites) and `format-check` (fails on a difference) over all C++ files that git knows.
find_program(HEXOPT_CLANG_FORMAT NAMES clang-format-14 clang-format)
find_package(Git QUIET)
if(HEXOPT_CLANG_FORMAT AND Git_FOUND)
  set(files "${GIT_EXECUTABLE} ls-files -z -- '*.cpp' '*.hpp' '*.h'")
  foreach(rule "format;-i" "format-check;--dry-run -Werror")
    list(GET rule 0 name)
    list(GET rule 1 flags)
    add_custom_target(${name} COMMAND sh -c "${files} | xargs -0 ${HEXOPT_CLANG_FORMAT} ${flags}"
      WORKING_DIRECTORY ${PROJECT_SOURCE_DIR} VERBATIM)
  endforeach()
endif()
