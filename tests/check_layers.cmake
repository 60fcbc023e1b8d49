# Fails on an include against the direction of dependency (README, "Layout").
#   cmake -DROOT=<source tree> -P check_layers.cmake
#
# A rule: files whose path matches FILES must not include what matches FORBIDDEN, except files that
# match EXCEPT.
function(rule)
  cmake_parse_arguments(R "" "FILES;FORBIDDEN;EXCEPT;WHY" "" ${ARGN})
  set(matched 0)
  foreach(file ${all_files})
    if(NOT file MATCHES "${R_FILES}" OR (R_EXCEPT AND file MATCHES "${R_EXCEPT}"))
      continue()
    endif()
    math(EXPR matched "${matched} + 1")
    file(STRINGS ${ROOT}/${file} includes REGEX "^[ \t]*#[ \t]*include")
    foreach(line ${includes})
      if(line MATCHES "${R_FORBIDDEN}")
        message(SEND_ERROR "${file}: ${line}\n  ${R_WHY}")
      endif()
    endforeach()
  endforeach()
  if(matched EQUAL 0 AND NOT PARTIAL)
    message(SEND_ERROR "rule for '${R_FILES}' matches no file: it checks nothing")
  endif()
endfunction()

file(GLOB_RECURSE all_files RELATIVE ${ROOT} ${ROOT}/cameras/*.h ${ROOT}/cameras/*.cpp ${ROOT}/synth/*.h
     ${ROOT}/synth/*.cpp ${ROOT}/detector/*.h ${ROOT}/detector/*.cpp ${ROOT}/evaluation/*.h
     ${ROOT}/evaluation/*.cpp ${ROOT}/properties/*.h ${ROOT}/properties/*.cpp ${ROOT}/cli/*.h ${ROOT}/cli/*.cpp)

rule(FILES "^cameras/" FORBIDDEN "\"(synth|detector|evaluation|properties|cli)/"
     WHY "cameras is the lowest module")
rule(FILES "^cameras/[^/]*$" EXCEPT "_test\\.cpp$" FORBIDDEN "\"cameras/calibration/|yaml-cpp|nlohmann|opencv2|fmt/"
     WHY "dlsd::cameras needs Eigen alone")
rule(FILES "^synth/" FORBIDDEN "\"(detector|evaluation|properties|cli)/" WHY "synth never sees the detector")
rule(FILES "^synth/dataset/" FORBIDDEN "\"synth/[^d]|\"synth/d[^a]" WHY "dataset is below synth and is read without Embree")
rule(FILES "^detector/" FORBIDDEN "\"(synth|evaluation|properties|cli|cameras/calibration)/|yaml-cpp|nlohmann"
     WHY "dlsd::detector needs cameras alone")
rule(FILES "^detector/" EXCEPT "opencv_adaptor|_test\\.cpp$|^detector/examples/" FORBIDDEN "opencv2"
     WHY "dlsd::detector carries no OpenCV; detector/opencv_adaptor.h is the one place")
rule(FILES "^evaluation/" FORBIDDEN "\"(properties|cli)/|\"synth/[^d]|\"synth/d[^a]" WHY "evaluation reads datasets and does not render")
rule(FILES "." EXCEPT "^synth/raycaster\\.cpp$" FORBIDDEN "embree" WHY "only synth/raycaster.cpp knows Embree")
rule(FILES "\\.h$" EXCEPT "opencv_adaptor|_module\\.h$|^properties/|^cli/" FORBIDDEN "opencv2" WHY "OpenCV stands in no public header")
rule(FILES "." EXCEPT "^properties/|_test\\.cpp$|_fixture\\.h$" FORBIDDEN "rapidcheck|gtest|gmock" WHY "test libraries stay in tests")
rule(FILES "^properties/checks/" FORBIDDEN "rapidcheck|gtest|gmock" WHY "predicates are used by dlsd replay too")
rule(FILES "^(cameras|synth|detector|evaluation|cli)/" FORBIDDEN "\"properties/[^c]|\"properties/c[^h]"
     WHY "nothing depends on the suites; properties/checks alone may be used, by cli")
