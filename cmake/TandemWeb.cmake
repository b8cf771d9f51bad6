# WebAssembly. The walks' vectors of four are SSE's, which Emscripten writes with WebAssembly's own.
add_compile_options(-msimd128 -msse2 -fwasm-exceptions -include ${PROJECT_SOURCE_DIR}/bindings/web/src/missing_library.h)
set(CMAKE_POSITION_INDEPENDENT_CODE OFF)
