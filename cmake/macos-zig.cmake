# Toolchain file: macOS programs by the clang, the libc++ and the linker of Zig (PyPI's ziglang), which brings the headers of macOS. They are
# linked here and not run. TANDEM_MACOS_CPU: aarch64 (Apple silicon) or x86_64.
set(TANDEM_MACOS_CPU aarch64 CACHE STRING "The processor: aarch64 or x86_64")
file(GLOB zig_folders ${CMAKE_CURRENT_LIST_DIR}/../build/zig/lib/python3*/site-packages/ziglang)
find_program(TANDEM_ZIG zig HINTS ${zig_folders} REQUIRED)
set(TANDEM_ZIG_TOOLS ${CMAKE_BINARY_DIR}/zig CACHE PATH "Zig's commands, a script each")
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES TANDEM_MACOS_CPU TANDEM_ZIG TANDEM_ZIG_TOOLS)

# A compiler is a program of its own to CMake and to ccache; Zig is one program with many commands. zig_tool(c++ words): a script for `zig c++ words`.
function(zig_tool command)
  list(JOIN ARGN " " words)
  file(CONFIGURE OUTPUT ${TANDEM_ZIG_TOOLS}/${command} CONTENT "#!/bin/sh\nexec '${TANDEM_ZIG}' ${command} ${words} \"$@\"\n")
  file(CHMOD ${TANDEM_ZIG_TOOLS}/${command} PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE)
endfunction()

set(CMAKE_SYSTEM_NAME Darwin)
set(CMAKE_SYSTEM_PROCESSOR ${TANDEM_MACOS_CPU})
set(target ${TANDEM_MACOS_CPU}-macos.13.3)
zig_tool(cc -target ${target})
zig_tool(c++ -target ${target})
zig_tool(ar)
zig_tool(ranlib)
set(CMAKE_C_COMPILER ${TANDEM_ZIG_TOOLS}/cc)
set(CMAKE_CXX_COMPILER ${TANDEM_ZIG_TOOLS}/c++)
set(CMAKE_AR ${TANDEM_ZIG_TOOLS}/ar)
set(CMAKE_RANLIB ${TANDEM_ZIG_TOOLS}/ranlib)
# Nothing that is installed needs another path than it was linked with; if it did, false would fail.
set(CMAKE_INSTALL_NAME_TOOL /usr/bin/false)
# Zig tells clang of each feature of the processor whether it is there, so that AVX-512 does not bring its wide vectors along.
set(TANDEM_AVX512_OPTIONS -mevex512)
# The script of the compiler tells ccache nothing.
execute_process(COMMAND ${TANDEM_ZIG} version OUTPUT_VARIABLE version OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
set(TANDEM_CCACHE_SETTINGS CCACHE_COMPILERTYPE=clang CCACHE_COMPILERCHECK=string:zig-${version}-${target})
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
