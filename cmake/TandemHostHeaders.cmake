# Libraries that are headers alone, as a cross build takes them from the build machine: each by links in a folder of its own, since the
# machine's own include folder has headers of its C library too. CGAL computes by Boost's numbers here, not by GMP's.
#
# tandem_host_headers(CGAL::CGAL CGAL boost): the target, and what of the include folder it needs.
function(tandem_host_headers target)
  string(MAKE_C_IDENTIFIER ${target} folder)
  set(folder ${PROJECT_BINARY_DIR}/host_headers/${folder})
  add_library(${target} INTERFACE IMPORTED GLOBAL)
  target_include_directories(${target} INTERFACE ${folder})
  foreach(name ${ARGN})
    find_path(place_of_${name} ${name} NO_CMAKE_FIND_ROOT_PATH PATHS /usr/include /usr/include/eigen3 REQUIRED)
    cmake_path(GET name FILENAME link)
    file(MAKE_DIRECTORY ${folder})
    file(CREATE_LINK ${place_of_${name}}/${name} ${folder}/${link} SYMBOLIC)
    unset(place_of_${name} CACHE)
  endforeach()
endfunction()

tandem_host_headers(CGAL::CGAL CGAL boost)
# Boost 1.74 takes std::unary_function, which libc++ has in C++20 where it is asked for it.
target_compile_definitions(CGAL::CGAL INTERFACE CGAL_DISABLE_GMP=1 CGAL_HEADER_ONLY=1 _LIBCPP_ENABLE_CXX17_REMOVED_UNARY_BINARY_FUNCTION)
target_compile_options(CGAL::CGAL INTERFACE -frounding-math)
# CGAL 5.5 has conversions to bool that name a member which is not there. Nothing uses them, but clang 19 reads them.
set(mended ${PROJECT_BINARY_DIR}/host_headers/mended)
file(READ ${PROJECT_BINARY_DIR}/host_headers/CGAL__CGAL/CGAL/boost/graph/iterator.h text)
string(REPLACE "this->base() == nullptr" "g == nullptr" text "${text}")
file(CONFIGURE OUTPUT ${mended}/CGAL/boost/graph/iterator.h CONTENT "${text}" @ONLY)
target_include_directories(CGAL::CGAL BEFORE INTERFACE ${mended})
tandem_host_headers(Eigen3::Eigen Eigen unsupported)
tandem_host_headers(CLI11::CLI11 CLI)
tandem_host_headers(nlohmann_json::nlohmann_json nlohmann)
# Its functions come with its header.
tandem_host_headers(xxhash xxhash.h)
target_compile_definitions(xxhash INTERFACE XXH_INLINE_ALL)
