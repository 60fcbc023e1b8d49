# Package files, so that find_package(dlsd) works from the installed tree.
#   find_package(dlsd)                  dlsd::cameras and dlsd::detector; needs Eigen alone
#   find_package(dlsd COMPONENTS data)  also calibration, dataset, synth, evaluation and what they need
include(CMakePackageConfigHelpers)
set(config_dir ${CMAKE_INSTALL_LIBDIR}/cmake/dlsd)
install(EXPORT dlsdTargets NAMESPACE dlsd:: DESTINATION ${config_dir})
if(DLSD_SYNTH)
  install(EXPORT dlsdDataTargets NAMESPACE dlsd:: DESTINATION ${config_dir})
  install(FILES cmake/FindOpenCVParts.cmake DESTINATION ${config_dir})
endif()
configure_package_config_file(cmake/dlsdConfig.cmake.in ${PROJECT_BINARY_DIR}/dlsdConfig.cmake
                              INSTALL_DESTINATION ${config_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/dlsdConfigVersion.cmake
                                 COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/dlsdConfig.cmake ${PROJECT_BINARY_DIR}/dlsdConfigVersion.cmake
        DESTINATION ${config_dir})
