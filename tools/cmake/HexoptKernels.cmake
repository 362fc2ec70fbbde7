# hexopt_kernels(TARGET): reads shaders/kernels/kernels.def and makes, in the build tree, the wrapper of each kernel,
# its SPIR-V for every precision as a header, and the C++ files that gather them. Adds all to TARGET.
find_program(HEXOPT_GLSLANG glslangValidator REQUIRED)

function(hexopt_kernels target)
  set(shaders ${PROJECT_SOURCE_DIR}/shaders)
  set(out ${PROJECT_BINARY_DIR}/shaders)
  set(list ${shaders}/kernels/kernels.def)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${list})
  file(MAKE_DIRECTORY ${out})

  file(STRINGS ${list} lines REGEX "^(KERNEL|COOPERATIVE|BUFFER|SCALAR|END)")
  set(bodies "")
  set(includes "")
  set(table "")
  set(headers "")
  foreach(line IN LISTS lines)
    if(line MATCHES "^(KERNEL|COOPERATIVE)\\(([a-z0-9_]+), ([0-9]+),")
      set(kind ${CMAKE_MATCH_1})
      set(name ${CMAKE_MATCH_2})
      set(local_size ${CMAKE_MATCH_3})
      set(block "")
    elseif(line MATCHES "^BUFFER\\([a-z_]+, ([A-Za-z0-9]+), ([a-z0-9_]+)\\)")
      string(APPEND block "    ${CMAKE_MATCH_1} ${CMAKE_MATCH_2};\n")
    elseif(line MATCHES "^SCALAR\\(([a-z]+), ([a-z0-9_]+)\\)")
      string(APPEND block "    ${CMAKE_MATCH_1} ${CMAKE_MATCH_2};\n")
    elseif(line MATCHES "^END")
      hexopt_kernel_wrapper()
      foreach(precision f32 f64 mixed)
        hexopt_kernel_spirv()
      endforeach()
      string(APPEND table "    {f32_${name}, f64_${name}, mixed_${name}},\n")
    else()
      message(FATAL_ERROR "kernels.def: cannot read \"${line}\"")
    endif()
  endforeach()

  file(CONFIGURE OUTPUT ${out}/kernel_bodies.inc CONTENT "${bodies}" @ONLY)
  file(CONFIGURE OUTPUT ${out}/spirv_blobs.cpp CONTENT
"#include \"compute/kernel_table.hpp\"\n
namespace hexopt::compute {\n\nnamespace {\n\n${includes}
// One row a kernel: f32, f64, mixed.
const SpirvBlob kBlobs[][kPrecisionCount] = {\n${table}};\n\n} // namespace\n
SpirvBlob spirv_blob(KernelId id, Precision precision) { return kBlobs[id][static_cast<int>(precision)]; }\n
} // namespace hexopt::compute\n" @ONLY)
  set_property(SOURCE ${out}/spirv_blobs.cpp PROPERTY OBJECT_DEPENDS ${headers})
  target_sources(${target} PRIVATE ${out}/spirv_blobs.cpp)
  target_include_directories(${target} PRIVATE ${out})
endfunction()

# The ~6 lines that turn a kernel's body into a compute shader; reads the caller's name, kind, local_size and block.
macro(hexopt_kernel_wrapper)
  if(kind STREQUAL "COOPERATIVE")
    set(folder coop)
    set(call "uint gid = gl_WorkGroupID.x + gl_WorkGroupID.y * gl_NumWorkGroups.x;\n    if (gid < count) run(gid);")
  else()
    set(folder kernels)
    set(call "uint gid = gl_GlobalInvocationID.x + gl_WorkGroupID.y * gl_NumWorkGroups.x * ${local_size}u;
    if (gid < count) run(gid);")
  endif()
  file(CONFIGURE OUTPUT ${out}/${name}.comp CONTENT "#version 460
#extension GL_GOOGLE_include_directive : require
#include \"dialect/kernel.glsl\"
layout(local_size_x = ${local_size}) in;
layout(push_constant, scalar) uniform Args {
${block}    uint count;
};
#include \"${folder}/${name}.glsl\"
void main() {
    ${call}
}
" @ONLY)
  string(APPEND bodies "#include \"${folder}/${name}.glsl\"\n")
endmacro()

# One variant's SPIR-V; reads the caller's name and precision, appends to its includes and headers.
macro(hexopt_kernel_spirv)
  set(defines_f32 "")
  set(defines_f64 -DHEXOPT_F64)
  set(defines_mixed -DHEXOPT_WIDE_POINTS)
  set(header ${out}/${name}.${precision}.spv.h)
  add_custom_command(OUTPUT ${header}
    COMMAND ${HEXOPT_GLSLANG} --quiet -V --target-env vulkan1.2 -I${shaders} ${defines_${precision}}
            --vn ${precision}_${name} --depfile ${header}.d -o ${header} ${out}/${name}.comp
    DEPENDS ${out}/${name}.comp DEPFILE ${header}.d VERBATIM)
  string(APPEND includes "#include \"${name}.${precision}.spv.h\"\n")
  list(APPEND headers ${header})
endmacro()
