# Helpers shared by every module's CMakeLists.txt.

# Warnings are a private interface target, so they never reach a consumer of the installed package.
add_library(dlsd_warnings INTERFACE)
target_compile_options(dlsd_warnings INTERFACE -Wall -Wextra -Wpedantic -Wconversion -Wshadow
                       $<$<BOOL:${DLSD_WERROR}>:-Werror>)
if(CMAKE_CXX_COMPILER_ID STREQUAL GNU AND CMAKE_CXX_FLAGS MATCHES -fsanitize=)
  target_compile_options(dlsd_warnings INTERFACE -Wno-maybe-uninitialized)  # GCC bug 105562: false in <regex>
endif()

# dlsd_add_library(NAME SOURCES a.cpp ... HEADERS a.h ... PUBLIC libs... PRIVATE libs...)
# Builds the static library dlsd_NAME with the alias dlsd::NAME, installs it and its headers.
function(dlsd_add_library name)
  cmake_parse_arguments(ARG "NO_INSTALL" "" "SOURCES;HEADERS;PUBLIC;PRIVATE" ${ARGN})
  set(target dlsd_${name})
  add_library(${target} STATIC ${ARG_SOURCES})
  add_library(dlsd::${name} ALIAS ${target})
  target_compile_features(${target} PUBLIC cxx_std_20)
  target_include_directories(${target} PUBLIC
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/dlsd>)
  target_link_libraries(${target} PUBLIC ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE} $<BUILD_INTERFACE:dlsd_warnings>)
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name} POSITION_INDEPENDENT_CODE ON)
  if(NOT ARG_NO_INSTALL)
    # Two export sets, so that a user of the detector needs Eigen and nothing else to find the package.
    if(name MATCHES "^(cameras|detector)$")
      set(export_set dlsdTargets)
    else()
      set(export_set dlsdDataTargets)
    endif()
    install(TARGETS ${target} EXPORT ${export_set} ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
    foreach(header ${ARG_HEADERS})
      file(RELATIVE_PATH folder ${PROJECT_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR}/${header})
      get_filename_component(folder ${folder} DIRECTORY)
      install(FILES ${header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/dlsd/${folder})
    endforeach()
  endif()
endfunction()

# dlsd_add_module(NAME SOURCES a.cpp ... LIBS ...)
# Builds libdlsd_NAME_module.so, which programs load when they first need it (synth/dataset/module.h). In the build tree
# all programs find it, of the installed ones those with dlsd_module_rpath as their INSTALL_RPATH.
set(CMAKE_BUILD_RPATH ${PROJECT_BINARY_DIR}/modules)
# As RPATH: RUNPATH is that of the caller of dlopen, and g++'s address sanitizer calls it for us.
add_link_options(-Wl,--disable-new-dtags)
file(RELATIVE_PATH dlsd_module_rpath ${CMAKE_INSTALL_FULL_BINDIR} ${CMAKE_INSTALL_FULL_LIBDIR}/dlsd)
set(dlsd_module_rpath "$ORIGIN/${dlsd_module_rpath}")
function(dlsd_add_module name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LIBS" ${ARGN})
  set(target dlsd_${name}_module)
  add_library(${target} MODULE ${ARG_SOURCES})
  target_compile_features(${target} PRIVATE cxx_std_20)
  target_include_directories(${target} PRIVATE ${PROJECT_SOURCE_DIR})
  target_link_libraries(${target} PRIVATE ${ARG_LIBS} dlsd_warnings)
  set_target_properties(${target} PROPERTIES LIBRARY_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/modules)
  install(TARGETS ${target} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/dlsd)
endfunction()

# dlsd_add_test(NAME LABELS quick nightly SHARDS n COST seconds SOURCES a_test.cpp ... LIBS ...)
# One GoogleTest binary; each of its tests becomes a ctest of its own, or with SHARDS each n-th part of them: OpenCV's
# larger libraries take 0.06 s to load, longer than many tests. COST is about how long the longest of them takes:
# ctest -j starts long tests first, and knows them by itself only the second time. Found only when DLSD_TESTS is on.
function(dlsd_add_test name)
  if(NOT DLSD_TESTS)
    return()
  endif()
  cmake_parse_arguments(ARG "" "TIMEOUT;SHARDS;COST" "SOURCES;LIBS;LABELS" ${ARGN})
  if(NOT ARG_LABELS)
    set(ARG_LABELS quick)
  endif()
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 300)
  endif()
  if(NOT ARG_COST)
    set(ARG_COST 0)
  endif()
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE ${ARG_LIBS} GTest::gmock GTest::gtest_main dlsd_warnings)
  target_compile_definitions(${name} PRIVATE DLSD_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
  # The libraries are built as they ship (what their headers hold, not); what tests them builds in two thirds of the time
  # without loop transformations.
  target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O1>)
  if(NOT ARG_SHARDS)
    gtest_discover_tests(${name} DISCOVERY_TIMEOUT 60 TEST_LIST ${name}_tests
                         PROPERTIES TIMEOUT ${ARG_TIMEOUT} COST ${ARG_COST})
    # gtest_discover_tests takes no property that is a list.
    set(labels ${CMAKE_CURRENT_BINARY_DIR}/${name}_labels.cmake)
    file(WRITE ${labels} "if(${name}_tests)
  set_tests_properties(\${${name}_tests} PROPERTIES LABELS \"${ARG_LABELS}\")\nendif()\n")
    set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES ${labels})
    return()
  endif()
  foreach(shard RANGE 1 ${ARG_SHARDS})
    math(EXPR index "${shard} - 1")
    add_test(NAME ${name}.${shard} COMMAND ${name})
    set_tests_properties(${name}.${shard} PROPERTIES LABELS "${ARG_LABELS}" TIMEOUT ${ARG_TIMEOUT} COST ${ARG_COST}
                         ENVIRONMENT "GTEST_TOTAL_SHARDS=${ARG_SHARDS};GTEST_SHARD_INDEX=${index}")
  endforeach()
endfunction()
