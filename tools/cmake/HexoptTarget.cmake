# One static library a folder of src/, with the project's warnings and floating-point rules.
# Contraction stays off: kernels must give the same bits on every CPU and on lavapipe (docs/dialect.md).
function(hexopt_compile_rules target)
  target_compile_options(${target} PRIVATE
    -Wall -Wextra -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual -ffp-contract=off -fno-math-errno)
  if(HEXOPT_WERROR)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
  if(HEXOPT_SANITIZE)
    # Instrumentation hides from GCC's flow analysis what is initialised: false alarms inside library headers.
    target_compile_options(${target} PRIVATE
      -fsanitize=${HEXOPT_SANITIZE} -fno-omit-frame-pointer -Wno-maybe-uninitialized -Wno-restrict)
    target_link_options(${target} PUBLIC -fsanitize=${HEXOPT_SANITIZE})
  endif()
endfunction()

# hexopt_library(NAME SOURCES... [LINKS target...] [PRIVATE_LINKS target...])
function(hexopt_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINKS;PRIVATE_LINKS" ${ARGN})
  add_library(hexopt_${name} STATIC ${ARG_SOURCES})
  target_include_directories(hexopt_${name} PUBLIC
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/src> $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/shaders>
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include>)
  target_link_libraries(hexopt_${name} PUBLIC ${ARG_LINKS} PRIVATE ${ARG_PRIVATE_LINKS})
  hexopt_compile_rules(hexopt_${name})
endfunction()
