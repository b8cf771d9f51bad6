// Nothing: tests/CMakeLists.txt precompiles GoogleTest's header for this file and for all tests.
