# HEXOPT_WITH_OCCT: whether STEP, IGES and BREP files can be read; on where OpenCASCADE is found. Sets
# HEXOPT_OCCT_INCLUDE, HEXOPT_OCCT_FOLDER (of its libraries) and HEXOPT_OCCT_TOOLKITS (those that the reader uses).
# Not by OpenCASCADE's own CMake package: that adds compile definitions to every target.
find_path(HEXOPT_OCCT_INCLUDE STEPControl_Reader.hxx PATH_SUFFIXES opencascade)
find_library(HEXOPT_OCCT_LIBRARY TKSTEP) # 7.8 renamed it
mark_as_advanced(HEXOPT_OCCT_INCLUDE HEXOPT_OCCT_LIBRARY)
set(found OFF)
if(HEXOPT_OCCT_INCLUDE AND HEXOPT_OCCT_LIBRARY)
  file(STRINGS ${HEXOPT_OCCT_INCLUDE}/Standard_Version.hxx version REGEX "define OCC_VERSION_COMPLETE")
  string(REGEX REPLACE "[^0-9.]" "" version "${version}")
  if(version VERSION_GREATER_EQUAL 7.6)
    set(found ON)
  endif()
endif()
option(HEXOPT_WITH_OCCT "Read STEP, IGES and BREP files through OpenCASCADE" ${found})
if(HEXOPT_WITH_OCCT)
  if(NOT found)
    message(FATAL_ERROR "HEXOPT_WITH_OCCT needs OpenCASCADE 7.6 or 7.7 (Debian: libocct-data-exchange-dev)")
  endif()
  get_filename_component(HEXOPT_OCCT_FOLDER ${HEXOPT_OCCT_LIBRARY} DIRECTORY)
  set(HEXOPT_OCCT_TOOLKITS TKSTEP TKSTEPBase TKIGES TKXSBase TKMesh TKTopAlgo TKBRep TKG3d TKMath TKernel)
endif()
message(STATUS "STEP, IGES and BREP files: ${HEXOPT_WITH_OCCT}")
