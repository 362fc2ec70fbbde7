# What `cmake --install` puts where: the command, both libraries, headers, the CMake package and the pkg-config
# file, manual page, completion and licence.
include(CMakePackageConfigHelpers)

# Third-party targets behind libhexopt.a: "target;CMake package;linker flags". Header-only ones have no flags and are
# of no interest to a user of the archive.
set(HEXOPT_STATIC_MAP
  "Threads::Threads|Threads|-pthread"
  "dl||-ldl"
  "TBB::tbb|TBB|-ltbb"
  "fmt::fmt|fmt|-lfmt"
  "ZLIB::ZLIB|ZLIB|-lz"
  "LibLZMA::LibLZMA|LibLZMA|-llzma"
  "PkgConfig::LZ4||-llz4"
  "Vulkan::Vulkan|Vulkan|-lvulkan"
  "CGAL::CGAL||-lmpfr -lgmp"
  "glm::glm||"
  "Eigen3::Eigen||"
  "nlohmann_json::nlohmann_json||")

foreach(toolkit IN LISTS HEXOPT_OCCT_TOOLKITS)
  list(APPEND HEXOPT_STATIC_MAP "${toolkit}||-l${toolkit}")
endforeach()

get_property(links GLOBAL PROPERTY HEXOPT_STATIC_LINKS)
set(HEXOPT_STATIC_TARGETS "")
set(HEXOPT_STATIC_FLAGS "")
set(HEXOPT_STATIC_DEPENDENCIES "")
foreach(link IN LISTS links)
  set(entry ${HEXOPT_STATIC_MAP})
  list(FILTER entry INCLUDE REGEX "^${link}\\|")
  if(entry STREQUAL "")
    message(FATAL_ERROR "tools/cmake/Install.cmake does not know how a user of libhexopt.a links ${link}")
  endif()
  string(REPLACE "|" ";" fields "${entry}")
  list(GET fields 1 package)
  list(GET fields 2 flags)
  if(package)
    list(APPEND HEXOPT_STATIC_TARGETS ${link})
    string(APPEND HEXOPT_STATIC_DEPENDENCIES "  find_dependency(${package})\n")
  elseif(flags)
    string(REPLACE " " ";" flag_list "${flags}")
    list(APPEND HEXOPT_STATIC_TARGETS ${flag_list})
  endif()
  if(flags)
    string(APPEND HEXOPT_STATIC_FLAGS " ${flags}")
  endif()
endforeach()

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/hexopt)
get_property(bundle GLOBAL PROPERTY HEXOPT_STATIC_BUNDLE)
configure_package_config_file(tools/cmake/hexopt-config.cmake.in ${PROJECT_BINARY_DIR}/hexopt-config.cmake
  INSTALL_DESTINATION ${package_dir} PATH_VARS CMAKE_INSTALL_INCLUDEDIR CMAKE_INSTALL_LIBDIR)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/hexopt-config-version.cmake COMPATIBILITY SameMinorVersion)
file(RELATIVE_PATH HEXOPT_PC_TO_PREFIX /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
configure_file(tools/cmake/hexopt.pc.in ${PROJECT_BINARY_DIR}/hexopt.pc @ONLY)

install(TARGETS hexopt EXPORT hexopt-shared LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(EXPORT hexopt-shared NAMESPACE hexopt:: DESTINATION ${package_dir})
install(FILES ${bundle} DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(DIRECTORY include/hexopt DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(FILES ${PROJECT_BINARY_DIR}/hexopt-config.cmake ${PROJECT_BINARY_DIR}/hexopt-config-version.cmake
  DESTINATION ${package_dir})
install(FILES ${PROJECT_BINARY_DIR}/hexopt.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
install(FILES LICENSE CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
if(HEXOPT_BUILD_TOOLS)
  install(TARGETS hexopt-gpu RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
  install(FILES ${PROJECT_BINARY_DIR}/tools/hexopt-gpu/hexopt-gpu.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1)
  install(FILES tools/completion/hexopt-gpu.bash RENAME hexopt-gpu
    DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions)
endif()
