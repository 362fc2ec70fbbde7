# Writes the ctest entries of one Catch2 executable: a test for each TEST_CASE, labelled with those of its tags
# that ctest selects by ([slow], [gpu]). Run after the executable is linked, with EXECUTABLE, PREFIX, OUTPUT.
cmake_minimum_required(VERSION 3.25)

function(names_of out spec)
  execute_process(COMMAND ${EXECUTABLE} ${spec} --list-test-names-only
    OUTPUT_VARIABLE names RESULT_VARIABLE result ERROR_VARIABLE errors)
  if(NOT result MATCHES "^[0-9]+$")
    message(FATAL_ERROR "${EXECUTABLE} could not list its tests: ${result}\n${errors}")
  endif()
  string(REGEX REPLACE "[;\n]+" ";" names "${names}")
  list(REMOVE_ITEM names "")
  set(${out} "${names}" PARENT_SCOPE)
endfunction()

names_of(all "*")
names_of(slow "[slow]")
names_of(gpu "[gpu]")
set(script "")
foreach(name IN LISTS all)
  string(REGEX REPLACE "([][,\\*])" "\\\\\\1" spec "${name}")
  set(labels "")
  foreach(label slow gpu)
    if(name IN_LIST ${label})
      list(APPEND labels ${label})
    endif()
  endforeach()
  string(APPEND script
    "add_test([==[${PREFIX}${name}]==] [==[${EXECUTABLE}]==] [==[${spec}]==])\n"
    "set_tests_properties([==[${PREFIX}${name}]==] PROPERTIES TIMEOUT 300 "
    "SKIP_REGULAR_EXPRESSION \"(^|\\n)SKIPPED: \" LABELS \"${labels}\" ENVIRONMENT \"${ENVIRONMENT}\")\n")
endforeach()
file(WRITE ${OUTPUT} "${script}")
