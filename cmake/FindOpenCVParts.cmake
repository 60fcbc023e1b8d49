# Finds single OpenCV modules, so that a machine needs only the packages of the parts that are used:
# Debian's libopencv-{core,imgproc,imgcodecs}-dev come without OpenCVConfig.cmake, which is in the
# package of everything.
#
#   find_package(OpenCVParts REQUIRED COMPONENTS core imgproc imgcodecs)
# defines the imported targets opencv_parts::core and so on.
find_path(OpenCVParts_INCLUDE_DIR opencv2/core.hpp PATH_SUFFIXES opencv4)
foreach(component ${OpenCVParts_FIND_COMPONENTS})
  find_library(OpenCVParts_${component}_LIBRARY opencv_${component})
  find_path(OpenCVParts_${component}_INCLUDE_DIR opencv2/${component}.hpp
            HINTS ${OpenCVParts_INCLUDE_DIR} PATH_SUFFIXES opencv4)
  if(OpenCVParts_${component}_LIBRARY AND OpenCVParts_${component}_INCLUDE_DIR)
    set(OpenCVParts_${component}_FOUND TRUE)
    if(NOT TARGET opencv_parts::${component})
      add_library(opencv_parts::${component} UNKNOWN IMPORTED)
      set_target_properties(opencv_parts::${component} PROPERTIES
        IMPORTED_LOCATION "${OpenCVParts_${component}_LIBRARY}"
        INTERFACE_INCLUDE_DIRECTORIES "${OpenCVParts_${component}_INCLUDE_DIR}")
      if(NOT component STREQUAL "core")
        set_property(TARGET opencv_parts::${component} APPEND PROPERTY
                     INTERFACE_LINK_LIBRARIES opencv_parts::core)
      endif()
    endif()
  endif()
endforeach()
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(OpenCVParts REQUIRED_VARS OpenCVParts_INCLUDE_DIR HANDLE_COMPONENTS)
mark_as_advanced(OpenCVParts_INCLUDE_DIR)
