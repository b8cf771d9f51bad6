include(GNUInstallDirs)
# Components of the installation: dev, but for shared libraries (libs, cuda), commands (tools) and the Python package (python).
set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME dev)

# CMake asks the Mac that it runs on whether it knows @rpath; all do since 2007.
if(APPLE AND CMAKE_CROSSCOMPILING)
  set(CMAKE_SHARED_LIBRARY_RUNTIME_C_FLAG "-Wl,-rpath,")
  set(CMAKE_SHARED_LIBRARY_RUNTIME_CXX_FLAG "-Wl,-rpath,")
endif()

# What a system does in its own way is in a file for each kind of system: file_bytes_posix.cpp, file_bytes_windows.cpp.
set(TANDEM_PLATFORM posix)
if(WIN32)
  set(TANDEM_PLATFORM windows)
endif()

# tandem_of_platform(file_bytes sources): adds the file of this system. Unity builds leave it alone: windows.h makes macros of common words.
macro(tandem_of_platform name list)
  list(APPEND ${list} ${name}_${TANDEM_PLATFORM}.cpp)
  set_source_files_properties(${name}_${TANDEM_PLATFORM}.cpp PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
endmacro()

# Compiles what follows in this folder with -O1 where TANDEM_ONLY_TESTED says that only tests run it. Not for what cost_test counts: of
# a template that two sources instantiate, the linker may choose either copy.
macro(tandem_compile_fast_for_tests)
  if(TANDEM_ONLY_TESTED)
    foreach(language CXX CUDA)
      string(REPLACE -O3 -O1 CMAKE_${language}_FLAGS_RELEASE "${CMAKE_${language}_FLAGS_RELEASE}")
    endforeach()
  endif()
endmacro()

# Flags that every target of the project is compiled with. -ffp-contract=off: promised results must not depend
# on whether a compiler fuses a multiply and an add. Headers that are not installed are spelled from the project's
# root on, such as "kernels/geometry/triangle_test.h".
function(tandem_flags target)
  # A library for macOS exports what the header marks; elsewhere a list of symbols or the mark for DLLs does the same.
  if(APPLE)
    set_target_properties(${target} PROPERTIES CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)
  endif()
  target_include_directories(${target} PRIVATE ${PROJECT_SOURCE_DIR})
  target_compile_options(${target} PRIVATE
    $<$<COMPILE_LANGUAGE:CXX>:-Wall -Wextra -Wshadow -Wconversion -Wno-sign-conversion -ffp-contract=off>)
  # GCC 12 sees overlapping copies in std::string's operator+ where there are none (GCC bug 105651).
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
    target_compile_options(${target} PRIVATE $<$<COMPILE_LANGUAGE:CXX>:-Wno-restrict>)
  endif()
  # A type of a source's unnamed namespace counts as a header's where several sources are compiled as one.
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    target_compile_options(${target} PRIVATE $<$<AND:$<COMPILE_LANGUAGE:CXX>,$<BOOL:$<TARGET_PROPERTY:UNITY_BUILD>>>:-Wno-subobject-linkage>)
  endif()
  # Truth values are combined without branches where both are cheap.
  if(CMAKE_CXX_COMPILER_ID MATCHES "Clang")
    target_compile_options(${target} PRIVATE $<$<COMPILE_LANGUAGE:CXX>:-Wno-bitwise-instead-of-logical>)
  endif()
  # Memory ends at 2 GiB there, so that 64-bit numbers that count bytes or elements of it fit in 32 bits.
  if(EMSCRIPTEN)
    target_compile_options(${target} PRIVATE -Wno-shorten-64-to-32 -Wno-unused-function -Wno-unneeded-internal-declaration)
  endif()
  if(TANDEM_WARNINGS_AS_ERRORS)
    target_compile_options(${target} PRIVATE $<$<COMPILE_LANGUAGE:CXX>:-Werror>)
  endif()
  if(TANDEM_SANITIZE)
    set(sanitize -fsanitize=${TANDEM_SANITIZE} -fno-omit-frame-pointer)
    if(TANDEM_SANITIZE MATCHES "undefined")
      list(APPEND sanitize -fno-sanitize-recover=all)
    endif()
    target_compile_options(${target} PRIVATE "$<$<COMPILE_LANGUAGE:CXX>:${sanitize}>")
    target_link_options(${target} PUBLIC -fsanitize=${TANDEM_SANITIZE})
  endif()
endfunction()

# tandem_library(formats SOURCES a.cpp DEPENDS tandem::x): target tandem_formats, alias tandem::formats,
# public headers under include/, exported by the install.
function(tandem_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPENDS" ${ARGN})
  set(target tandem_${name})
  if(ARG_SOURCES)
    add_library(${target} STATIC ${ARG_SOURCES})
    set(scope PUBLIC)
    tandem_flags(${target})
  else()
    add_library(${target} INTERFACE)
    set(scope INTERFACE)
  endif()
  add_library(tandem::${name} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name})
  target_compile_features(${target} ${scope} cxx_std_20)
  target_include_directories(${target} ${scope} $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  target_link_libraries(${target} ${scope} ${ARG_DEPENDS})
  install(TARGETS ${target} EXPORT tandemTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
  if(EXISTS ${CMAKE_CURRENT_SOURCE_DIR}/include)
    target_include_directories(${target} ${scope} $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include>)
    install(DIRECTORY include/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
  endif()
endfunction()

# The files of variants/ are compiled for machines that have the instructions; which of these the machine has is asked at run
# time (kernels/common/block_pair.cpp).
macro(tandem_lane_variants name)
  if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64|amd64)$")
    set_source_files_properties(variants/avx2.cpp PROPERTIES COMPILE_OPTIONS "-mavx2")
    set_source_files_properties(variants/avx512.cpp PROPERTIES
      COMPILE_OPTIONS "-mavx512f;-mavx512vl;-mavx512dq;-mavx512bw;-mprefer-vector-width=512;${TANDEM_AVX512_OPTIONS}")
    target_compile_definitions(tandem_${name} PRIVATE TANDEM_X86_LANES=1)
  endif()
endmacro()

# Includes are spelled from tools/ on, such as "bvhbench/scenes/scene_file.h".
# tandem_tool_library(scenes SOURCES a.cpp DEPENDS PUBLIC x PRIVATE y): target tandem_scenes.
function(tandem_tool_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPENDS" ${ARGN})
  add_library(tandem_${name} STATIC ${ARG_SOURCES})
  tandem_flags(tandem_${name})
  target_include_directories(tandem_${name} PUBLIC ${PROJECT_SOURCE_DIR}/tools)
  target_link_libraries(tandem_${name} ${ARG_DEPENDS})
endfunction()
