# What `cmake --install` and `cpack` bring: programs, configuration, systemd unit, documents. cpack makes a Debian package of it
# out of what is built (`cmake --build --preset release --target shaped shapectl`), in build/release/package, and one of shaped-trainer
# where that was built too: it brings LibTorch with it.
include(GNUInstallDirs)
set(CMAKE_SKIP_INSTALL_ALL_DEPENDENCY ON)  # tests and benchmarks are no part of it
set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME shaped)

install(TARGETS shaped shapectl RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
if(TARGET shaped-trainer)
  install(TARGETS shaped-trainer RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT trainer OPTIONAL)
  install(FILES deploy/package/copyright NOTICE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/shaped-trainer COMPONENT trainer)
endif()
install(FILES deploy/systemd/shaped.service DESTINATION lib/systemd/system)
# An absolute path: it is /etc, whatever the prefix.
install(FILES deploy/shaped.yaml DESTINATION /etc/shaped)
install(FILES deploy/package/copyright NOTICE README.md CHANGELOG.md docs/api.md docs/dependencies.md docs/files.md docs/operations.md
        DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/shaped)
# CHOLMOD is linked from its archive where there is one, and then no package of its own brings its licence.
if(SHAPED_SUPERNODAL)
  install(FILES /usr/share/doc/libsuitesparse-dev/copyright DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/shaped
          RENAME copyright.suitesparse)
endif()
install(DIRECTORY proto/shaped proto/google DESTINATION ${CMAKE_INSTALL_DATADIR}/shaped/proto)
install(DIRECTORY deploy/monitoring deploy/load-balancing DESTINATION ${CMAKE_INSTALL_DATADIR}/shaped)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/package)
set(CPACK_PACKAGE_NAME shaped)
set(CPACK_PACKAGE_VENDOR "the authors of shaped")
set(CPACK_PACKAGE_CONTACT "the authors of shaped <root@localhost>")
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL shaped)
# What is packaged is seen when cpack runs, by the programs that are there.
set(CPACK_PROJECT_CONFIG_FILE ${PROJECT_BINARY_DIR}/ShapedPackageParts.cmake)
file(CONFIGURE OUTPUT ShapedPackageParts.cmake @ONLY CONTENT
     "if(EXISTS \"@CMAKE_RUNTIME_OUTPUT_DIRECTORY@/shaped-trainer\")\n  set(CPACK_COMPONENTS_ALL shaped trainer)\nendif()\n")
set(CPACK_DEBIAN_SHAPED_PACKAGE_NAME shaped)
set(CPACK_DEBIAN_TRAINER_PACKAGE_NAME shaped-trainer)
set(CPACK_DEBIAN_SHAPED_DESCRIPTION
    "daemon for trained shape models over gRPC, and its client\nshaped keeps trained shape, pose and motion models in memory and answers\ngeometry requests over gRPC; shapectl is its client at the terminal.")
set(CPACK_DEBIAN_TRAINER_DESCRIPTION
    "trains the neural fields of shaped's body models\nshaped starts it where a body model grows by raw scans. It brings LibTorch.")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "daemon for trained shape models over gRPC, and its client")
set(CPACK_INSTALL_PREFIX /usr)
set(CPACK_SET_DESTDIR ON)  # /etc is outside the prefix
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_SHAPED_PACKAGE_DEPENDS adduser)
set(CPACK_DEBIAN_SHAPED_PACKAGE_SUGGESTS shaped-trainer)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_SHAPED_PACKAGE_CONTROL_EXTRA
    "${PROJECT_SOURCE_DIR}/deploy/package/conffiles;${PROJECT_SOURCE_DIR}/deploy/package/postinst;${PROJECT_SOURCE_DIR}/deploy/package/prerm;${PROJECT_SOURCE_DIR}/deploy/package/postrm")
include(CPack)
