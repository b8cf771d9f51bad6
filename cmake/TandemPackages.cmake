# cpack makes Debian packages of what was built: libtandem0, libtandem-dev, tandem-tools where there are tools, and
# libtandem-cuda0 where there is CUDA. Presets package and package-cuda configure for them.
# The source archive: cpack --config CPackSourceConfig.cmake.
set(CPACK_PACKAGE_NAME tandem)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
# Whoever makes packages is their maintainer: DEBFULLNAME and DEBEMAIL, as Debian's own tools take them.
set(packager "The Tandem authors <tandem@localhost>")
if(DEFINED ENV{DEBFULLNAME} AND DEFINED ENV{DEBEMAIL})
  set(packager "$ENV{DEBFULLNAME} <$ENV{DEBEMAIL}>")
endif()
set(TANDEM_PACKAGER "${packager}" CACHE STRING "Maintainer of the packages that cpack makes: NAME <ADDRESS>")
set(CPACK_PACKAGE_CONTACT "${TANDEM_PACKAGER}")
set(CPACK_GENERATOR DEB)
# What was configured for another prefix than /usr is packed for it, so that its paths hold.
file(CONFIGURE OUTPUT packages/prefix.cmake @ONLY CONTENT "if(CPACK_GENERATOR STREQUAL \"DEB\")
  set(CPACK_PACKAGING_INSTALL_PREFIX \"@CMAKE_INSTALL_PREFIX@\")
endif()
")
set(CPACK_PROJECT_CONFIG_FILE ${PROJECT_BINARY_DIR}/packages/prefix.cmake)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS_POLICY ">=")

# tandem_package(dev NAME libtandem-dev SECTION libdevel TEXT "..." [DEPENDS "..."]): the component dev as a
# package, with the copyright and the changelog that Debian wants of one.
function(tandem_package component)
  cmake_parse_arguments(ARG "" "NAME;SECTION;TEXT;DEPENDS" "" ${ARGN})
  string(TOUPPER ${component} COMPONENT)
  string(REGEX REPLACE "\n *" "\n" text "${ARG_TEXT}")
  foreach(pair "PACKAGE_NAME|${ARG_NAME}" "PACKAGE_SECTION|${ARG_SECTION}" "PACKAGE_DEPENDS|${ARG_DEPENDS}" "PACKAGE_SHLIBDEPS|ON"
      "DESCRIPTION|${text}")
    string(REGEX MATCH "^([^|]*)\\|(.*)$" matched "${pair}")
    set(CPACK_DEBIAN_${COMPONENT}_${CMAKE_MATCH_1} "${CMAKE_MATCH_2}" PARENT_SCOPE)
  endforeach()
  if(NOT WIN32)
    set(folder ${CMAKE_INSTALL_DATADIR}/doc/${ARG_NAME})
    install(FILES ${PROJECT_BINARY_DIR}/packages/copyright ${PROJECT_BINARY_DIR}/packages/changelog.gz DESTINATION ${folder} COMPONENT ${component})
  endif()
  set(CPACK_COMPONENTS_ALL ${CPACK_COMPONENTS_ALL} ${component} PARENT_SCOPE)
endfunction()

# The time is SOURCE_DATE_EPOCH's, where it is set.
string(TIMESTAMP now "%a, %d %b %Y %H:%M:%S +0000" UTC)
file(CONFIGURE OUTPUT packages/changelog @ONLY
  CONTENT "tandem (@PROJECT_VERSION@) unstable; urgency=medium\n\n  * CHANGELOG.md in the source says what is new.\n\n -- @CPACK_PACKAGE_CONTACT@  @now@\n")
find_program(TANDEM_GZIP gzip)
if(TANDEM_GZIP)
  execute_process(COMMAND ${TANDEM_GZIP} -9nc ${PROJECT_BINARY_DIR}/packages/changelog OUTPUT_FILE ${PROJECT_BINARY_DIR}/packages/changelog.gz)
else()
  message(STATUS "Tandem: no gzip, so no packages")
  return()
endif()
file(READ ${PROJECT_SOURCE_DIR}/LICENSE licence)
file(CONFIGURE OUTPUT packages/copyright @ONLY CONTENT "@licence@
The program bvhbuild contains code of CGAL's packages that are under the GNU General Public License, version 3 or later
(/usr/share/common-licenses/GPL-3): as a whole it is under that licence. Libraries and headers contain none of it.
")

# Debian has these texts; a zip brings them along. What MinGW-w64 links statically is under the licences of its file.
if(WIN32)
  install(FILES ${PROJECT_BINARY_DIR}/packages/copyright DESTINATION licences RENAME tandem.txt)
  install(FILES /usr/share/common-licenses/GPL-3 DESTINATION licences RENAME GPL-3.txt OPTIONAL)
  install(FILES /usr/share/doc/mingw-w64-common/copyright DESTINATION licences RENAME mingw-w64.txt OPTIONAL)
endif()

set(triggers ${PROJECT_BINARY_DIR}/packages/triggers)
file(WRITE ${triggers} "activate-noawait ldconfig\n")
set(CPACK_COMPONENTS_ALL "")
set(about "Finds every pair of intersecting triangles between non-convex rigid meshes,
 exactly, with contact manifolds, certified distances and times of impact.")
set(exact "(= ${PROJECT_VERSION})")
tandem_package(libs NAME libtandem0 SECTION libs TEXT "${about}
 .
 This package has the shared library with the C interface.")
set(CPACK_DEBIAN_LIBS_PACKAGE_CONTROL_EXTRA ${triggers})
set(libraries "libtandem0 ${exact}")
if(TANDEM_HAVE_CUDA)
  tandem_package(cuda NAME libtandem-cuda0 SECTION libs TEXT "${about}
   .
   This package has the shared library with the C interface to queries on a GPU."
    DEPENDS "libtandem0 ${exact}")
  set(CPACK_DEBIAN_CUDA_PACKAGE_CONTROL_EXTRA ${triggers})
  # CUDA's runtime comes with NVIDIA's packages or in other ways, so dpkg-shlibdeps may find no package that has it.
  set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR}/bindings/c ${CUDAToolkit_LIBRARY_DIR})
  set(CPACK_DEBIAN_CUDA_PACKAGE_RECOMMENDS cuda-cudart-${CUDAToolkit_VERSION_MAJOR}-${CUDAToolkit_VERSION_MINOR})
  set(CPACK_DEBIAN_TOOLS_PACKAGE_RECOMMENDS ${CPACK_DEBIAN_CUDA_PACKAGE_RECOMMENDS})
  string(APPEND libraries ", libtandem-cuda0 ${exact}")
endif()
tandem_package(dev NAME libtandem-dev SECTION libdevel TEXT "${about}
 .
 This package has headers for C and C++, the static libraries of C++, the CMake
 package and the description for pkg-config."
  DEPENDS "${libraries}")
if(TANDEM_TOOLS)
  tandem_package(tools NAME tandem-tools SECTION utils TEXT "${about}
   .
   This package has bvhbuild, which makes trees of mesh files, bvhinfo, which
   shows and verifies them, and bvhbench, which runs queries and simulations.")
endif()

set(CPACK_SOURCE_GENERATOR TXZ)
set(CPACK_SOURCE_PACKAGE_FILE_NAME tandem-${PROJECT_VERSION})
set(CPACK_SOURCE_IGNORE_FILES "/\\\\.git(/|$)" "/__pycache__/" "\\\\.tmp$" "^${PROJECT_SOURCE_DIR}/(build[^/]*|out|dist|shared|\\\\.carry|\\\\.cache)(/|$)")
include(CPack)
