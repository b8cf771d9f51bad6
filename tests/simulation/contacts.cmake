# Engines, mass properties and contact points.
set(contact_scene contact_scene.cpp ../kernels/query_scenes.cpp ../build/sample_asset.cpp)

tandem_test(contact_generation_test SOURCES contact_generation_test.cpp ${contact_scene}
  LIBRARIES tandem_contacts tandem_build TBB::tbb)
tandem_test(mass_properties_test SOURCES mass_properties_test.cpp ${contact_scene} LIBRARIES tandem_contacts tandem_build)
tandem_test(engine_test SOURCES engine_test.cpp ${contact_scene} LIBRARIES tandem_contacts tandem_build)
if(TANDEM_HAVE_CUDA)
  add_executable(engine_gpu_test engine_gpu_test.cpp ${contact_scene})
  tandem_flags(engine_gpu_test)
  target_include_directories(engine_gpu_test PRIVATE ${PROJECT_SOURCE_DIR}/tests)
  target_compile_definitions(engine_gpu_test PRIVATE TANDEM_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
  target_link_libraries(engine_gpu_test PRIVATE tandem_contacts tandem_build CUDA::cudart GTest::gtest_main)
  gtest_discover_tests(engine_gpu_test DISCOVERY_TIMEOUT 60 PROPERTIES LABELS gpu)
endif()
